"""Pose to command: modes, guidance, autopilot, thrust allocation."""
