"""Places in the array of a vehicle's own motion that the controllers' kernels read (`controllers.senses`)."""

from __future__ import annotations

__all__ = ["GROUND", "LEVEL", "MOTION", "PITCH", "RATE", "ROLL", "WATER"]

ROLL, PITCH, RATE, GROUND, WATER, LEVEL = 0, 1, 2, 5, 8, 11
"""Roll and pitch (positive nose down) in rad; p, q, r in rad/s; velocity over ground and through the water in body axes
in m/s (3 each); rotation from body axes to the level heading frame (ahead, port, up), row by row (9)."""
MOTION = 20
"""Numbers in all."""
