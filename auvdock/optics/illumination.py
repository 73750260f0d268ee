"""Light on surfaces at the station: daylight, spill of the station's lamps, and the vehicle's own lamps."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.bands import BANDS_NM
from auvdock.optics.scene import LitScene

__all__ = ["LAMP_M2", "Illumination"]

LAMP_M2 = 0.05**2
"""Least squared distance from a lamp to what it lights: its housing."""


class Illumination:
    """What falls on a surface.

    Each of the station's lamps gives Φ s / (4π d²) e^{-a d} with Φ its flux, s the share that leaves its mount and the
    nearby water in all directions, and a quarter of that for the mean obliquity.

    Attributes:
        lamps_m: (n, 3) places of the station's lamps in the world.
        spill_w_sr: (n, 3) Φ s / 16π of each, per band; 0 for dead ones.
        absorption_per_m: (n,) at each lamp's wavelength.
    """

    def __init__(self, lit: LitScene) -> None:
        """Precompute what each lamp gives."""
        self._lit = lit
        count = lit.lights.station_count
        nm = np.array([beacon.wavelength_nm for beacon in lit.setup.layout.beacons])
        bands = np.array([np.interp(nm, BANDS_NM, row) for row in np.eye(3)]).T
        spill = lit.lights.column("flux_w")[:count] * lit.setup.imaging.lamp_spill / (16.0 * math.pi)
        rotation, origin = lit.setup.T_world_station[:3, :3], lit.setup.T_world_station[:3, 3]
        self.lamps_m: Array = lit.lights.column("place_m")[:count] @ rotation.T + origin
        self.spill_w_sr: Array = spill[:, None] * bands
        self.absorption_per_m: Array = lit.lights.column("absorption_per_m")[:count]

    def at(self, points_world: Array, T_world_camera: Array) -> Array:
        """(n, 3) irradiance per band at points (n, 3) on surfaces that face up, the camera being at a pose (4, 4)."""
        lit = self._lit
        offset = points_world[:, None, :] - self.lamps_m
        d2 = np.maximum(np.einsum("ijk,ijk->ij", offset, offset), LAMP_M2)
        light = (np.exp(-np.sqrt(d2) * self.absorption_per_m) / d2) @ self.spill_w_sr
        light += lit.daylight_w_m2(-float(T_world_camera[2, 3]))
        if lit.lamp is not None:
            light += lit.lamp.irradiance((points_world - T_world_camera[:3, 3]) @ T_world_camera[:3, :3])
        return light
