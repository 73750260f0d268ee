"""auvdock.sim."""
