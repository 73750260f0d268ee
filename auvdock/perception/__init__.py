"""auvdock.perception."""
