"""What touches the vehicle, and how hard."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.sim.mj import MjData, MjModel, mujoco

__all__ = ["Contacts"]


class Contacts:
    """Follows the forces that the station puts on the vehicle.

    Attributes:
        force_n: magnitude of the net force of contacts and latch in the last step (MuJoCo's impulse over the step,
            divided by its length).
        peak_force_n: the greatest so far.
    """

    def __init__(self, model: MjModel, data: MjData, nose_x_m: float, radius_m: float) -> None:
        """Bind to a model's vehicle."""
        self._floor: int = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor")
        self._bow_from_m = nose_x_m - radius_m
        self.force_n = self.peak_force_n = 0.0
        self.bind(data)

    def bind(self, data: MjData) -> None:
        """Take hold of the data's memory, anew after unpickling."""
        self._data = data
        self._force = data.qfrc_constraint[:3]

    def reset(self) -> None:
        """Nothing touched yet."""
        self.force_n = self.peak_force_n = 0.0

    def update(self) -> None:
        """Take in the step just made."""
        if self._data.nefc == 0:
            self.force_n = 0.0
            return
        x, y, z = self._force.tolist()
        self.force_n = math.sqrt(x * x + y * y + z * z)
        if self.force_n > self.peak_force_n:
            self.peak_force_n = self.force_n

    @property
    def touching_station(self) -> bool:
        """True while the hull touches anything but the floor."""
        if self.force_n == 0.0 or self._data.ncon == 0:
            return False
        contact = self._data.contact
        return bool(np.any(np.all(contact.geom != self._floor, axis=1) & (contact.dist < 0.0)))

    def bow_force_n(self, position_world_m: Array, axis_world: Array) -> float:
        """`force_n` while any contact lies on the rounded bow, else 0."""
        if self.force_n == 0.0 or self._data.ncon == 0:
            return 0.0
        along = (self._data.contact.pos - position_world_m) @ axis_world
        return self.force_n if bool(np.any(along > self._bow_from_m)) else 0.0

    def underside_force_n(self, position_world_m: Array, up_world: Array, below_m: float) -> float:
        """`force_n` while any contact lies lower in the body than `below_m` (package axes, z up), else 0."""
        if self.force_n == 0.0 or self._data.ncon == 0:
            return 0.0
        height = (self._data.contact.pos - position_world_m) @ up_world
        return self.force_n if bool(np.any(height < below_m)) else 0.0
