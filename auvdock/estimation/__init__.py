"""Estimation: measured poses and dead reckoning in, what is believed of the place before the station out."""
