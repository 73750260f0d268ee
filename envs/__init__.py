"""auvdock.envs."""
