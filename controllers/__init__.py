"""auvdock.controllers."""
