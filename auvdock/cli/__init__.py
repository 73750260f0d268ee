"""auvdock.cli."""
