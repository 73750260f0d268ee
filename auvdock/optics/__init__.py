"""auvdock.optics."""
