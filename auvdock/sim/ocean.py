"""Currents: uniform, sheared with depth, and Gauss-Markov gusts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.limits import Positive, between
from auvdock.sim.stepping import flow

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
    and discretised exactly (`stepping.blow`).

    Attributes:
        current: (6,) mean velocity (2) in m/s, its shear per metre and the depth in m at which it holds, and the gusts'
            decay e^(−dt/T) and drive σ √(1 − e^(−2 dt/T)) in m/s.
        gust: (2,) present gust, world frame, m/s; the simulator's steps advance it.
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
        mean = cfg.speed_m_s * math.cos(azimuth), cfg.speed_m_s * math.sin(azimuth)
        drive = cfg.gust_std_m_s * math.sqrt(1.0 - decay * decay)
        self.current = np.array([*mean, cfg.shear_per_m, self._reference_depth_m, decay, drive])
        self.gust: Array = np.zeros(2)
        self._rng = rng
        self._gusty = cfg.gust_std_m_s > 0.0
        self._noise: Array = np.zeros((0, 2))
        if self._gusty:
            self.gust[:] = cfg.gust_std_m_s * rng.standard_normal(2)

    def velocity(self, z_world_m: float) -> Array:
        """(3,) velocity of the water in the world frame, m/s, at a height z (0 at the surface, negative below)."""
        water = np.zeros(3)
        flow(z_world_m, self.current, self.gust, water)
        return water

    def noise(self, steps: int) -> Array:
        """(m, 2) normal numbers that drive the next gusts, a row a step, m from 1 to `steps`; (0, 2) without gusts."""
        if self._gusty and not len(self._noise):
            # Taken from the end, as ever: the same seed gives the same gusts in every version.
            self._noise = np.ascontiguousarray(self._rng.standard_normal(2 * _BLOCK)[::-1]).reshape(_BLOCK, 2)
        return self._noise[:steps]

    def used(self, steps: int) -> None:
        """Take note that so many rows of `noise` have driven the gusts."""
        self._noise = self._noise[steps:]
