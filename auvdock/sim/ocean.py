"""Currents: uniform, sheared with depth, and Gauss-Markov gusts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.limits import Positive, between
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Records
from auvdock.numeric.scalars import Vector
from auvdock.numeric.water import Water, water_velocity

__all__ = ["CurrentCfg", "Ocean"]

_BLOCK = 512
"""Gust samples drawn at once: one call of the generator costs as much as fifty samples."""

_Speed = Annotated[float, between(0.0, 5.0)]


@dataclass(frozen=True)
class CurrentCfg(Checked):
    """A horizontal, irrotational current in the world frame."""

    speed_m_s: _Speed = 0.0
    """Mean speed at the depth of the station's mouth."""
    direction_deg: float = 0.0
    """Where the water flows to: world azimuth, counter-clockwise from +x."""
    shear_per_m: float = 0.0
    """Relative change of the mean speed per metre upwards: speed × (1 + shear × height above the mouth), at least 0."""
    gust_std_m_s: _Speed = 0.0
    """Standard deviation of each horizontal gust component."""
    gust_time_constant_s: Positive = 10.0
    """Correlation time of the gusts."""


class Ocean:
    """The water's velocity at the vehicle.

    Gusts are a first-order Gauss-Markov process, T ġ + g = white noise (Fossen 2011, section 8.3), uniform in space
    and discretised exactly (`numeric.water.advance_gust`).

    Attributes:
        water: (1,) current and present gust, world frame; the simulator's steps advance it.
    """

    def __init__(self, cfg: CurrentCfg, reference_depth_m: float, dt_s: float) -> None:
        """Prepare; call `reset` before use.

        Args:
            cfg: the current.
            reference_depth_m: depth at which `cfg.speed_m_s` holds.
            dt_s: physics step.
        """
        self._reference_depth_m = reference_depth_m
        self._dt_s = dt_s
        self.reset(cfg, np.random.default_rng(0))

    def reset(self, cfg: CurrentCfg, rng: np.random.Generator) -> None:
        """Start anew, with gusts drawn from their stationary distribution."""
        azimuth = math.radians(cfg.direction_deg)
        decay = math.exp(-self._dt_s / cfg.gust_time_constant_s)
        self._rng = rng
        self._gusty = cfg.gust_std_m_s > 0.0
        self._noise: Array = np.zeros((0, 2))
        self.water: Records[Water] = Water(
            mean_m_s=np.array([cfg.speed_m_s * math.cos(azimuth), cfg.speed_m_s * math.sin(azimuth)]),
            shear_1_m=cfg.shear_per_m,
            reference_depth_m=self._reference_depth_m,
            gust_decay=decay,
            gust_drive_m_s=cfg.gust_std_m_s * math.sqrt(1.0 - decay * decay),
            gust_m_s=cfg.gust_std_m_s * rng.standard_normal(2) if self._gusty else np.zeros(2),
            gust_m_s2=np.zeros(2),
        ).packed()

    def velocity(self, z_world_m: float) -> Array:
        """(3,) velocity of the water in the world frame, m/s, at a height z (0 at the surface, negative below)."""
        return np.array(_velocity(self.water, z_world_m))

    def noise(self, steps: int) -> Array:
        """(m, 2) normal numbers that drive the next gusts, a row a step, m from 1 to `steps`; (0, 2) without gusts."""
        if self._gusty and not len(self._noise):
            # Taken from the end, as ever: the same seed gives the same gusts in every version.
            self._noise = np.ascontiguousarray(self._rng.standard_normal(2 * _BLOCK)[::-1]).reshape(_BLOCK, 2)
        return self._noise[:steps]

    def used(self, steps: int) -> None:
        """Take note that so many rows of `noise` have driven the gusts."""
        self._noise = self._noise[steps:]


@compiled
def _velocity(water: Records[Water], z_world_m: float) -> Vector:
    """`water_velocity` of an array (1,), as Python hands it over."""
    return water_velocity(water[0], z_world_m)
