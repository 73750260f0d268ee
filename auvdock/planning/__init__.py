"""auvdock.planning."""
