"""Currents: uniform, sheared with depth, and Gauss-Markov gusts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.errors import ConfigError

__all__ = ["CurrentCfg", "Ocean"]

_BLOCK = 512
"""Gust samples drawn at once: one call of the generator costs as much as fifty samples."""


@dataclass(frozen=True)
class CurrentCfg:
    """A horizontal, irrotational current in the world frame."""

    speed_m_s: float = 0.0
    """Mean speed at the depth of the station's mouth."""
    direction_deg: float = 0.0
    """Where the water flows to: world azimuth, counter-clockwise from +x."""
    shear_per_m: float = 0.0
    """Relative change of the mean speed per metre upwards: speed × (1 + shear × height above the mouth), at least 0."""
    gust_std_m_s: float = 0.0
    """Standard deviation of each horizontal gust component."""
    gust_time_constant_s: float = 10.0
    """Correlation time of the gusts."""

    def __post_init__(self) -> None:
        """Refuse what no water does."""
        for name in ("speed_m_s", "gust_std_m_s"):
            if not 0.0 <= getattr(self, name) <= 5.0:
                raise ConfigError(f"sim.current.{name}", getattr(self, name), "a speed of 0 to 5 m/s")
        for name in ("direction_deg", "shear_per_m"):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"sim.current.{name}", getattr(self, name), "a finite number")
        if not self.gust_time_constant_s > 0.0:
            raise ConfigError("sim.current.gust_time_constant_s", self.gust_time_constant_s, "a time above 0 s")


class Ocean:
    """The water's velocity at the vehicle.

    Gusts are a first-order Gauss-Markov process, T ġ + g = white noise (Fossen 2011, section 8.3), uniform in space
    and discretised exactly: g[k+1] = e^(−dt/T) g[k] + σ √(1 − e^(−2 dt/T)) n[k].
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
        self._mean_x = cfg.speed_m_s * math.cos(azimuth)
        self._mean_y = cfg.speed_m_s * math.sin(azimuth)
        self._shear = cfg.shear_per_m
        self._std = cfg.gust_std_m_s
        self._decay = math.exp(-self._dt_s / cfg.gust_time_constant_s)
        self._drive = cfg.gust_std_m_s * math.sqrt(1.0 - self._decay * self._decay)
        self._rng = rng
        self._block: list[float] = []
        self._gust_x = self._gust_y = 0.0
        if self._std > 0.0:
            self._gust_x, self._gust_y = (self._std * rng.standard_normal(2)).tolist()

    def velocity(self, z_world_m: float) -> tuple[float, float, float]:
        """Velocity of the water in the world frame, m/s, at a height z (0 at the surface, negative below)."""
        factor = max(0.0, 1.0 + self._shear * (z_world_m + self._reference_depth_m)) if self._shear else 1.0
        return factor * self._mean_x + self._gust_x, factor * self._mean_y + self._gust_y, 0.0

    def step(self) -> tuple[float, float]:
        """Advance the gusts by one step; returns their horizontal acceleration over it in m/s²."""
        if self._std == 0.0:
            return 0.0, 0.0
        if not self._block:
            self._block = self._rng.standard_normal(2 * _BLOCK).tolist()
        x = self._decay * self._gust_x + self._drive * self._block.pop()
        y = self._decay * self._gust_y + self._drive * self._block.pop()
        acceleration = (x - self._gust_x) / self._dt_s, (y - self._gust_y) / self._dt_s
        self._gust_x, self._gust_y = x, y
        return acceleration
