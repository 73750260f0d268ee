"""The rotating beacon's light at the camera: core, halo, and the beam seen from the side.

Core: I0 f(θ) e^{-(a+b) r} / r², as every lamp's, θ the angle between beam axis and the line to the camera.

Scattered light: I0 e^{-a r} (1 - e^{-b r}) / r² g(θ), g the beam's profile convolved with the water's small-angle
spread (`optics.beam_spread`), so that a beam that does not point at the camera is still seen. Of such a beam the light
comes along the beam: a ray that left at `lead` from the line of sight and turned once reaches the camera at φ from the
lamp, towards where the beam goes, with a weight p(lead + φ), p the phase function. Wells' is ∝ β^-3 there, hence the
share up to φ is 1 - (1 + φ / lead)^-2. For a beam that faces the camera lead is 0 and all comes from the lamp.

At wide angles real water scatters more than Wells' law says; the excess (`optics.phase_function`) comes on top as
single scattering along the beam, forward scattering before and after it taken as no loss (as Gordon 1973 does for the
veil): with ds / d² = dφ / (r sin θ),

    dE = Φ b p(θ + φ) e^{-a (s + d)} dφ / (r sin θ),    s = r sin φ / sin(θ + φ),    d = r sin θ / sin(θ + φ).

Inside the beam sin θ is bounded by the mean distance from the rays of a Gaussian beam, √(2/π) σ.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.optics.arrival import Lamp
from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.halo import halo_of
from auvdock.optics.light import beam_profile
from auvdock.optics.phase_function import wide_angle_phase
from auvdock.optics.radiometry import LightSet
from auvdock.optics.view import Beam, Moment, View
from auvdock.optics.water import WaterCfg

__all__ = ["RotatingLight"]

_PIECES = 10
_NODES = 4
_STEPS = (np.arange(_PIECES + 1) / _PIECES) ** 1.5
"""The pieces' borders in the logarithm of the scattering angle: fine by the lamp."""
_AT_LAMP = 0.35
"""Up to this share of the first piece, light counts as from the lamp itself."""
_REACH_RAD = 1.7
"""A little more than a camera's diagonal."""
_TURN_NODES, _TURN_WEIGHTS = np.polynomial.legendre.leggauss(3)


class RotatingLight:
    """A rotating beacon among the lamps of a scene."""

    def __init__(
        self, cfg: RotatingBeaconCfg, lights: LightSet, water: WaterCfg, lamp: int, image: int | None = None
    ) -> None:
        """Make or find the table of the beam's spread.

        Args:
            cfg: the beacon.
            lights: the scene's lamps.
            water: the water.
            lamp: its index among the lamps.
            image: index of its mirror image in the surface, None without.
        """
        self.cfg, self.lamp = cfg, lamp
        self._index = np.array([lamp] if image is None else [lamp, image])
        self._flip = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, -1.0]])[: len(self._index)]
        half = math.radians(cfg.divergence_deg) / 2.0
        self._halo = halo_of(water)
        self._spread = beam_spread(self._halo, half)
        self._theta0 = water.scattering_angle_rad
        self._sigma = half / math.sqrt(2.0 * math.log(2.0))
        self._near2 = 2.0 / math.pi * self._sigma**2
        own = Lamp.read(lights.lamps, lamp)
        self._peak, self._flux, self._a, self._b = own.peak_w_sr, own.flux_w, own.absorption_per_m, own.scattering_per_m
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
        halo = total * self._halo.scattered(depth) * (weight @ scattered)
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
        s, d = r * np.sin(phi) / opening, r * math.sin(apart) / opening
        phase = wide_angle_phase((apart + phi).ravel(), self._theta0).reshape(phi.shape)
        excess = phase * np.exp(-self._a * (s + d))
        light = self._flux * self._b / (r * math.sin(apart)) * excess.sum(axis=1) * step
        lead = float(self._spread.lead_rad(np.array([self._b * r]), np.array([angle]))[0])
        # One turn stands out only beyond what many small ones make, some θ0 b r / 2; within, the halo stays a whole.
        lead *= lead / (lead + 0.5 * self._theta0 * self._b * r + 1e-9)
        border = edge.copy()
        border[0] = _AT_LAMP * edge[1]
        beyond = (1.0 + border / max(lead, 1e-6)) ** -2
        share = np.diff(beyond) / (beyond[-1] - 1.0)
        bent = halo * share
        s, d = s.mean(axis=1), d.mean(axis=1)
        width = np.hypot(self._sigma, 0.5 * self._theta0 * self._b * s) * s / d
        middle = phi.mean(axis=1)
        rays = np.cos(middle)[:, None] * ray + np.sin(middle)[:, None] * along
        # What was turned little spreads over the whole path, as a lamp's light does; what was turned much, from there.
        depth = self._b * (bent * r + light * d) / np.maximum(bent + light, 1e-300)
        beam = Beam(angle, ray, along, edge, rays, d, depth, light + bent, width)
        return beam, halo * (1.0 - float(share.sum()))
