"""The rotating beacon's light at the camera: core, halo, and the beam seen from the side.

Core: I0 f(θ) e^{-(a+b) r} / r², as every lamp's, θ the angle between beam axis and the line to the camera.

Scattered light: I0 e^{-a r} / r² times the whole of the water's halo and g(θ), the beam's profile folded with that halo
(`optics.beam_spread`), so that a beam that does not point at the camera is still seen. Of such a beam the light comes
along the beam: a ray that left at `lead` from the line of sight and turned once, at s from the lamp and d from the
camera, reaches it at φ from the lamp, towards where the beam goes. With ds / d² = dφ / (r sin θ) its weight is

    dE ∝ p(lead + φ) e^{-a (s + d)} dφ,    s = r sin φ / sin(θ + φ),    d = r sin θ / sin(θ + φ),

p the water's phase function, forward scattering before and after taken as no loss (as Gordon 1973 does for the veil).
For a beam that faces the camera lead is 0 and all comes from the lamp. Many small turns tell no place on the beam: they
make some m = (1 - e^{-b r}) × the halo's median angle, and lead counts as lead² / (lead + m).

Inside the beam sin θ is bounded by the mean distance from the rays of a Gaussian beam, √(2/π) σ.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.optics.arrival import Lamp
from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.light import beam_profile
from auvdock.optics.radiometry import LightSet
from auvdock.optics.view import Beam, Moment, View

__all__ = ["RotatingLight"]

_PIECES = 10
_NODES = 4
_STEPS = (np.arange(_PIECES + 1) / _PIECES) ** 1.5
"""The pieces' borders in the logarithm of the scattering angle: fine by the lamp."""
_AT_LAMP = 0.35
"""Up to this share of the first piece, light counts as from the lamp itself."""
_TURN_STEPS = np.linspace(0.0, 1.0, 97)
_LEAST_LEAD_RAD = 1e-6
_REACH_RAD = 1.7
"""A little more than a camera's diagonal."""
_TURN_NODES, _TURN_WEIGHTS = np.polynomial.legendre.leggauss(3)


class RotatingLight:
    """A rotating beacon among the lamps of a scene."""

    def __init__(self, cfg: RotatingBeaconCfg, lights: LightSet, lamp: int, image: int | None = None) -> None:
        """Make or find the table of the beam's spread.

        Args:
            cfg: the beacon.
            lights: the scene's lamps in their water.
            lamp: its index among the lamps.
            image: index of its mirror image in the surface, None without.
        """
        own = Lamp.read(lights.lamps, lamp)
        self.cfg, self.lamp = cfg, lamp
        self.halo_row: int = own.halo_row
        """First row of its light in the halo's table."""
        self._index = np.array([lamp] if image is None else [lamp, image])
        self._flip = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, -1.0]])[: len(self._index)]
        half = math.radians(cfg.divergence_deg) / 2.0
        self._halo = lights.halo
        self._spread = beam_spread(self._halo, self.halo_row, half)
        self._sigma = half / math.sqrt(2.0 * math.log(2.0))
        self._near2 = 2.0 / math.pi * self._sigma**2
        self._peak, self._a, self._b = own.peak_w_sr, own.absorption_per_m, own.scattering_per_m
        self._cos_elevation = math.cos(math.radians(cfg.elevation_deg))
        self._sin_elevation = math.sin(math.radians(cfg.elevation_deg))

    def axis(self, station_time_s: float) -> Array:
        """(3,) unit direction of the beam in the station frame."""
        azimuth = self.cfg.azimuth_rad(station_time_s)
        level = self._cos_elevation
        return np.array([level * math.cos(azimuth), level * math.sin(azimuth), self._sin_elevation])

    def shine(self, view: View, moment: Moment) -> View:
        """A step: put the beacon's light and that of its image into a view, with what lies beside the lamp."""
        R_station_camera = view.T_station_camera[:3, :3]
        arrivals = view.arrivals
        r, rays = arrivals["range_m"][self._index], arrivals["ray_camera"][self._index]
        back = -(rays @ R_station_camera.T)
        angle = np.empty((len(_TURN_NODES), len(r)))
        for k, node in enumerate(_TURN_NODES):
            axis = self.axis(moment.station_time_s + 0.5 * moment.exposure_s * float(node))
            angle[k] = np.arccos(np.clip((back * self._flip) @ axis, -1.0, 1.0))
        depth = self._b * r
        weight = 0.5 * _TURN_WEIGHTS
        total = self._peak * np.exp(-self._a * r) / r**2
        arrivals["core_w_m2"][self._index] = (
            total * np.exp(-depth) * (weight @ beam_profile(angle, self.cfg.divergence_deg))
        )
        scattered = self._spread.share(np.broadcast_to(depth, angle.shape), angle)
        halo = total * self._halo.scattered(depth, self.halo_row) * (weight @ scattered)
        axis_camera = self.axis(moment.station_time_s) @ R_station_camera
        beam, at_lamp = self._beam(rays[0], axis_camera, float(r[0]), float(halo[0]))
        halo[0] = at_lamp
        arrivals["halo_w_m2"][self._index] = halo
        return view._replace(beam=beam)

    def _beam(self, ray: Array, axis: Array, r: float, halo: float) -> tuple[Beam, float]:
        """The pieces along the beam, and what remains of the halo at the lamp itself."""
        angle = math.acos(min(max(-float(ray @ axis), -1.0), 1.0))
        along = axis - float(axis @ ray) * ray
        size = float(np.linalg.norm(along))
        along = (
            along / size if size > 1e-9 else np.cross(ray, (0.0, 1.0, 0.0) if abs(ray[1]) < 0.9 else (1.0, 0.0, 0.0))
        )
        along = along / np.linalg.norm(along)
        # The angle as the rays of a beam of some width have it in the mean.
        apart = min(math.sqrt(angle**2 + self._near2), math.pi - 0.02)
        reach = min(_REACH_RAD, 0.98 * (math.pi - apart))
        edge = apart * (((apart + reach) / apart) ** _STEPS - 1.0)
        step = np.diff(edge) / _NODES
        phi = edge[:-1, None] + step[:, None] * (np.arange(_NODES) + 0.5)
        opening = np.sin(apart + phi)
        s, d = (r * np.sin(phi) / opening).mean(axis=1), (r * math.sin(apart) / opening).mean(axis=1)
        whole_path = np.array([self._b * r])
        lead = float(self._spread.lead_rad(whole_path, np.array([angle]))[0])
        many = float(self._widening_rad(whole_path)[0])
        lead *= lead / (lead + many + 1e-9)
        share = self._shares(edge, max(lead, _LEAST_LEAD_RAD), apart, r)
        width = np.hypot(self._sigma, self._widening_rad(self._b * s)) * s / d
        middle = phi.mean(axis=1)
        rays = np.cos(middle)[:, None] * ray + np.sin(middle)[:, None] * along
        # What was turned little spreads over the whole path, as a lamp's light does; what was turned much, from there.
        turned = (apart + middle) / (apart + middle + many)
        beam = Beam(angle, ray, along, edge, rays, d, self._b * (r + (d - r) * turned), halo * share, width)
        return beam, halo * (1.0 - float(share.sum()))

    def _widening_rad(self, depth: Array) -> Array:
        """(n,) angle by which scattering turns light in the mean over b s (n,), the unscattered counted as 0."""
        return self._halo.median_rad(depth, self.halo_row) * -np.expm1(-depth)

    def _shares(self, edge: Array, lead: float, apart: float, r: float) -> Array:
        """(k,) shares of the scattered light that come from the pieces; the rest is from the lamp itself."""
        turn = lead * (1.0 + edge[-1] / lead) ** _TURN_STEPS
        opening = np.sin(apart + turn - lead)
        way = r * (np.sin(turn - lead) + math.sin(apart)) / opening
        weight = self._halo.phase_per_sr(turn) * np.exp(-self._a * (way - r)) * turn
        steps = 0.5 * (weight[1:] + weight[:-1]) * np.diff(np.log(turn))
        running = np.concatenate([[0.0], np.cumsum(steps)])
        border = edge.copy()
        border[0] = _AT_LAMP * edge[1]
        return np.diff(np.interp(np.log(lead + border), np.log(turn), running)) / running[-1]
