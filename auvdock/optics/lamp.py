"""Lamps that the vehicle carries beside its camera: light on what is seen, and backscatter from the water between.

A lamp of radiant intensity I f(θ) lights a surface at distance d that faces along its axis with

    E = I f(θ) cos θ e^{-(a + b_b) d} / d²:

what is scattered forwards arrives all the same (Gordon 1973, as the veil of `optics.surfaces`), what is scattered back
is lost. On the way the water scatters light straight into the camera. By single scattering, along a ray up to the
surface at distance s1,

    L = ∫_0^s1 I f(θ(s)) e^{-(a + b_b) d(s)} / d(s)² · b_b / (2π) · e^{-(a + b_b) s} ds,

with b_b / 2π the volume scattering function in the backward half space, taken as even there. Lamp and camera move as
one, so L depends on the pixel and on s1 alone and is tabulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative, PositiveShare, between
from auvdock.optics.lamp_light import add_beamed
from auvdock.optics.lens import Lens
from auvdock.optics.light import beam_profile, profile_solid_angle_sr
from auvdock.optics.water import WaterCfg

__all__ = ["LampCfg", "VehicleLamp"]

_LEAST_M2 = 0.03**2
"""Least squared distance from a lamp: its own window."""
_FIRST_M, _LAST_M = 0.02, 40.0
_NODES = 40
_FINE = 16
_GRID = (25, 19)


@dataclass(frozen=True)
class LampCfg(Checked):
    """One or more equal lamps, rigid to the camera and parallel to its axis; all figures are ours."""

    power_w: NotNegative = 20.0
    """Electrical power of each lamp."""
    efficiency: PositiveShare = 0.35
    """Radiant flux over electrical power."""
    beam_angle_deg: Annotated[float, between(5.0, 170.0)] = 70.0
    """Full beam angle at half of the peak intensity."""
    band_shares: tuple[NotNegative, NotNegative, NotNegative] = (0.4, 0.4, 0.2)
    """Shares of the flux in the bands 450, 530 and 620 nm: a cold white LED."""
    positions_m: tuple[tuple[float, float, float], ...] = ((0.0, -0.25, 0.0), (0.0, 0.25, 0.0))
    """Where the lamps sit in the camera frame (x right, y down, z forward): before and behind a belly camera."""

    def __post_init__(self) -> None:
        """Refuse more light than there is, and no lamp."""
        if not 0.0 < sum(self.band_shares) <= 1.0 + 1e-9:
            raise ConfigError("band_shares", self.band_shares, "shares of 0 or more that add up to at most 1")
        if not self.positions_m:
            raise ConfigError("positions_m", self.positions_m, "at least one lamp; 'lamp' left out for none")


class VehicleLamp:
    """A `LampCfg` in one water beside one camera."""

    def __init__(self, cfg: LampCfg, lens: Lens, water: WaterCfg) -> None:
        """Tabulate the backscatter."""
        self.cfg = cfg
        self._positions = np.array(cfg.positions_m, dtype=np.float64)
        flux = cfg.power_w * cfg.efficiency * np.array(cfg.band_shares)
        self.peak_w_sr = flux / profile_solid_angle_sr(cfg.beam_angle_deg)
        """(3,) on-axis radiant intensity of one lamp per band."""
        self._loss_per_m = water.absorption + water.backscattering
        self._phase_per_m_sr = water.backscattering / (2.0 * math.pi)
        self._tabulate(lens)

    def irradiance(self, points_camera: Array) -> Array:
        """(n, 3) irradiance per band on surfaces at points (n, 3) of the camera frame that face along the axis."""
        points = np.asarray(points_camera, dtype=np.float64)
        light = np.zeros((len(points), 3))
        for position in self._positions:
            offset = points - position
            d2 = np.maximum(np.einsum("ij,ij->i", offset, offset), _LEAST_M2)
            d = np.sqrt(d2)
            cosine = np.maximum(offset[:, 2] / d, 0.0)
            shape = beam_profile(np.arccos(np.minimum(cosine, 1.0)), self.cfg.beam_angle_deg) * cosine / d2
            light += shape[:, None] * np.exp(-d[:, None] * self._loss_per_m)
        return light * self.peak_w_sr

    def add_along(self, light: NDArray[np.float32], rays: NDArray[np.float32], distance: NDArray[np.float32]) -> None:
        """Add `irradiance` to light (3, n) at distances (n,) along unit rays (3, n): single precision, and faster."""
        half = math.radians(self.cfg.beam_angle_deg) / 2.0
        add_beamed(
            light,
            rays,
            distance,
            self._positions.astype(np.float32),
            self._loss_per_m.astype(np.float32),
            self.peak_w_sr.astype(np.float32),
            np.float32(2.0 * math.log(2.0) / half**2),
            np.float32(_LEAST_M2),
        )

    def brightest(self, distance_m: Array) -> Array:
        """(n, 3) upper bound of the irradiance on anything at distances (n,) from the camera."""
        reach = float(np.linalg.norm(self._positions, axis=1).max())
        d2 = np.maximum(distance_m - reach, math.sqrt(_LEAST_M2)) ** 2
        least = np.maximum(distance_m - reach, 0.0)
        return len(self._positions) / d2[:, None] * np.exp(-least[:, None] * self._loss_per_m) * self.peak_w_sr

    def backscatter(self, distance: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """Backscattered radiance (rows, columns, 3) in W/(m² sr) on the coarse grid of the lens.

        Args:
            distance: (rows, columns) metres along the rays to what they meet, `inf` for nothing; None is nothing.
        """
        if distance is None:
            return self._table[-1]
        place = np.log(np.clip(distance, _FIRST_M, _LAST_M).astype(np.float32) / np.float32(_FIRST_M))
        place *= np.float32((_NODES - 1) / math.log(_LAST_M / _FIRST_M))
        row = np.minimum(place.astype(np.int32), _NODES - 2)
        place -= row
        row *= self._pixels
        row += self._column
        flat = self._table.reshape(-1, 3)
        lower = flat.take(row, 0)
        row += self._pixels
        upper = flat.take(row, 0)
        upper -= lower
        upper *= cv2.cvtColor(place, cv2.COLOR_GRAY2RGB)
        upper += lower
        return upper

    def backscatter_near(self, pixels: Array, distance_m: float) -> Array:
        """(n, 3) backscattered radiance at pixels (n, 2) up to one distance, from the table."""
        _, height, width, _ = self._table.shape
        columns = np.clip(pixels[:, 0] / self._factor, 0, width - 1).astype(np.int64)
        rows = np.clip(pixels[:, 1] / self._factor, 0, height - 1).astype(np.int64)
        place = math.log(min(max(distance_m, _FIRST_M), _LAST_M) / _FIRST_M)
        place *= (_NODES - 1) / math.log(_LAST_M / _FIRST_M)
        node = min(int(place), _NODES - 2)
        lower, upper = self._table[node, rows, columns], self._table[node + 1, rows, columns]
        return (lower + (upper - lower) * np.float32(place - node)).astype(np.float64)

    def backscatter_at(self, rays: Array, distance_m: float) -> Array:
        """(n, 3) backscattered radiance along unit rays (n, 3) up to one distance: the integral itself."""
        return self._integrate(rays, np.array([max(distance_m, 2.0 * _FIRST_M)]))[:, 0]

    def _tabulate(self, lens: Lens) -> None:
        camera = lens.camera
        columns, rows = _GRID
        x = np.linspace(-0.5, camera.width_px - 0.5, columns)
        y = np.linspace(-0.5, camera.height_px - 0.5, rows)
        rays = camera.rays(np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2))
        nodes = np.geomspace(_FIRST_M, _LAST_M, _NODES)
        radiance = self._integrate(rays, nodes).reshape(rows, columns, _NODES, 3).transpose(2, 0, 1, 3)
        # From the loose grid, whose outermost nodes lie on the image's edges, to the centres of the coarse pixels.
        height, width = lens.shape
        centre_x = ((np.arange(width) + 0.5) * lens.factor) / camera.width_px * (columns - 1)
        centre_y = ((np.arange(height) + 0.5) * lens.factor) / camera.height_px * (rows - 1)
        map_x, map_y = (m.astype(np.float32) for m in np.meshgrid(centre_x, centre_y))
        table = [
            cv2.remap(
                np.ascontiguousarray(layer, dtype=np.float32),
                map_x,
                map_y,
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
            for layer in radiance
        ]
        self._table = np.ascontiguousarray(np.array(table, dtype=np.float32))
        self._factor = lens.factor
        self._pixels = height * width
        self._column = np.arange(self._pixels, dtype=np.int32).reshape(height, width)

    def _integrate(self, rays: Array, upper_m: Array) -> Array:
        """(n, k, 3) integrals along rays (n, 3) from 0 to each of `upper_m` (k,), by trapezoids in ln s."""
        fine = np.unique(np.concatenate([[1e-3], np.geomspace(_FIRST_M / 10.0, float(upper_m[-1]), _FINE * _NODES)]))
        fine = np.unique(np.concatenate([fine, upper_m]))
        points = rays[:, None, :] * fine[None, :, None]
        source = np.zeros((len(rays), len(fine), 3))
        for position in self._positions:
            offset = points - position
            d2 = np.maximum(np.einsum("ijk,ijk->ij", offset, offset), _LEAST_M2)
            d = np.sqrt(d2)
            angle = np.arccos(np.clip(offset[:, :, 2] / d, -1.0, 1.0))
            lit = beam_profile(angle, self.cfg.beam_angle_deg) / d2
            source += lit[:, :, None] * np.exp(-d[:, :, None] * self._loss_per_m)
        source *= np.exp(-fine[:, None] * self._loss_per_m) * self.peak_w_sr * self._phase_per_m_sr
        step = np.diff(fine)[None, :, None]
        pieces = 0.5 * (source[:, 1:] + source[:, :-1]) * step
        total = np.concatenate([source[:, :1] * fine[0], pieces], axis=1).cumsum(axis=1)
        return total[:, np.searchsorted(fine, upper_m)]
