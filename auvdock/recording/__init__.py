"""auvdock.recording."""
