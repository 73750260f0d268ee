"""auvdock.episode."""
