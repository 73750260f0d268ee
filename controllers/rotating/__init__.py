"""Docking with a rotating beacon: from any side, around the station, into the cone of the fixed lamps."""
