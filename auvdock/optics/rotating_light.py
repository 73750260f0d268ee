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
from auvdock.numeric.compiled import compiled
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
_TURNS = 97
_LEAST_LEAD_RAD = 1e-6
_TURN_RAD = np.geomspace(_LEAST_LEAD_RAD, math.pi, 512)
"""Angles at which the phase function is kept."""
_FIRST_LOG_TURN, _LAST_LOG_TURN = math.log(_LEAST_LEAD_RAD), math.log(math.pi)
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
        self._log_phase = np.log(self._halo.phase_per_sr(_TURN_RAD))
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
        lead = float(self._spread.lead_rad(np.array([self._b * r]), np.array([angle]))[0])
        depth = self._b * np.append(s, r)
        # By how much scattering turns light in the mean, the unscattered counted as 0.
        widening = self._halo.median_rad(depth, self.halo_row) * -np.expm1(-depth)
        many = float(widening[-1])
        lead *= lead / (lead + many + 1e-9)
        share = _share_along(edge, max(lead, _LEAST_LEAD_RAD), apart, self._a * r, self._log_phase)
        width = np.hypot(self._sigma, widening[:-1]) * s / d
        middle = phi.mean(axis=1)
        rays = np.cos(middle)[:, None] * ray + np.sin(middle)[:, None] * along
        # What was turned little spreads over the whole path, as a lamp's light does; what was turned much, from there.
        turned = (apart + middle) / (apart + middle + many)
        beam = Beam(angle, ray, along, edge, rays, d, self._b * (r + (d - r) * turned), halo * share, width)
        return beam, halo * (1.0 - float(share.sum()))


@compiled
def _share_along(edge: Array, lead: float, apart: float, way_per_a: float, log_phase: Array) -> Array:
    """(k,) shares of the scattered light that come from the pieces; the rest is from the lamp itself.

    Trapezoids over the logarithm of the scattering angle, from `lead` to what comes from the last border.

    Args:
        edge: (k + 1,) borders of the pieces, apparent angle from the lamp.
        lead: at which the light left the lamp.
        apart: angle between the beam's axis and the line to the camera.
        way_per_a: a r.
        log_phase: (n,) logarithm of the phase function at `_TURN_RAD`.
    """
    running, share = np.zeros(_TURNS), np.zeros(len(edge))
    span = math.log(1.0 + edge[-1] / lead)
    step, per_log = span / (_TURNS - 1), (len(log_phase) - 1) / (_LAST_LOG_TURN - _FIRST_LOG_TURN)
    before = 0.0
    for i in range(_TURNS):
        turn = lead * math.exp(i * step)
        log_turn = math.log(lead) + i * step
        place = (log_turn - _FIRST_LOG_TURN) * per_log
        column = min(max(int(place), 0), len(log_phase) - 2)
        phase = log_phase[column] + (place - column) * (log_phase[column + 1] - log_phase[column])
        way = (math.sin(turn - lead) + math.sin(apart)) / math.sin(apart + turn - lead)
        weight = math.exp(phase + log_turn - way_per_a * (way - 1.0))
        if i > 0:
            running[i] = running[i - 1] + 0.5 * (before + weight) * step
        before = weight
    for border in range(len(edge)):
        angle = _AT_LAMP * edge[1] if border == 0 else edge[border]
        place = min(math.log(1.0 + angle / lead) / step, _TURNS - 1.0)
        i = min(int(place), _TURNS - 2)
        share[border] = running[i] + (place - i) * (running[i + 1] - running[i])
    return (share[1:] - share[:-1]) / running[-1]
