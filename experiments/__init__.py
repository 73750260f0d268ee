"""auvdock.experiments."""
