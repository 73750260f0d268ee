"""What flickers, drops out, passes before the lamps or mirrors them: steps on the light that arrives."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.optics.lens import Lens
from auvdock.optics.nuisance import NuisanceCfg, ReflectionLevel
from auvdock.optics.view import Moment, View

__all__ = ["Flicker", "Mirror"]

_WATER_INDEX = 1.34


class Flicker:
    """Scintillation and dropouts of the station's lamps, and what passes before them, in one episode."""

    def __init__(
        self,
        nuisance: NuisanceCfg,
        count: int,
        source: IntArray,
        flicker_rng: np.random.Generator,
        snow_rng: np.random.Generator,
        rotating: int | None,
    ) -> None:
        """Start with every lamp lit.

        Args:
            nuisance: gives the levels.
            count: number of the station's lamps.
            source: (n,) for each light the lamp of the station whose fluctuation it shares; `count` for none.
            flicker_rng: stream of scintillation and dropouts.
            snow_rng: stream of what passes.
            rotating: the rotating beacon's lamp, None without one.
        """
        self._flicker, self._snow, self._rotating = nuisance.flicker_level, nuisance.snow_level, rotating
        self._source, self._flicker_rng, self._snow_rng = source, flicker_rng, snow_rng
        self._log = flicker_rng.standard_normal(count)
        self._dark_until, self._occluded_until = np.full(count, -np.inf), np.full(count, -np.inf)
        self._last_s: float | None = None

    def dim(self, view: View, moment: Moment) -> View:
        """A step: multiply the light of each lamp, and of the beam, by its factor now."""
        factor = self._factors(moment.time_s, view.arrivals["range_m"])[self._source]
        view.arrivals["core_w_m2"] *= factor
        view.arrivals["halo_w_m2"] *= factor
        beam = view.beam
        if beam is None or self._rotating is None:
            return view
        return view._replace(beam=beam._replace(light_w_m2=beam.light_w_m2 * factor[self._rotating]))

    def _factors(self, time_s: float, range_m: Array) -> Array:
        """(station's lamps + 1,) factors on their light; the last entry is 1."""
        flicker, snow, n = self._flicker, self._snow, len(self._log)
        step = 0.0 if self._last_s is None else max(time_s - self._last_s, 0.0)
        self._last_s = time_s
        keep = math.exp(-step / flicker.correlation_s)
        self._log *= keep
        self._log += math.sqrt(1.0 - keep * keep) * self._flicker_rng.standard_normal(n)
        std = flicker.log_std_at_10_m * np.sqrt(range_m[:n] / 10.0)
        factor = np.exp(std * self._log - 0.5 * std * std)
        _strike(self._dark_until, time_s, step, flicker.dropouts_per_s, flicker.dropout_s, self._flicker_rng)
        factor[self._dark_until > time_s] = 0.0
        _strike(self._occluded_until, time_s, step, snow.occlusions_per_s, snow.occlusion_s, self._snow_rng)
        factor[self._occluded_until > time_s] *= snow.occlusion_transmission
        return np.append(factor, 1.0)


class Mirror:
    """The sea surface, which mirrors lamps from below and jitters their images by waves."""

    def __init__(self, level: ReflectionLevel, lens: Lens, first: int, rng: np.random.Generator) -> None:
        """The images are the lights from `first` on; `rng` is the stream of the waves."""
        self._level, self._lens, self._images, self._rng = level, lens, slice(first, None), rng

    def reflect(self, view: View, moment: Moment) -> View:
        """A step: weaken the mirror images and move them."""
        images = view.arrivals[self._images]
        rays = images["ray_camera"].copy()
        up = rays @ view.T_world_camera[2, :3]
        factor = self._level.share * _fresnel_from_water(np.abs(up)) * (up > 0.0)
        images["core_w_m2"] *= factor
        images["halo_w_m2"] *= factor
        rays += self._rng.normal(0.0, 2.0 * self._level.slope_rad, rays.shape)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        images["ray_camera"] = rays
        images["pixel"], images["inside"] = self._lens.locate(rays)
        return view


def _strike(
    until_s: Array, time_s: float, step_s: float, per_s: float, mean_s: float, rng: np.random.Generator
) -> None:
    """Let events begin at a rate, each lasting a time drawn from an exponential law; (n,) when the last one ends."""
    draws = rng.random((2, len(until_s)))
    starts = draws[0] < 1.0 - math.exp(-per_s * step_s)
    ends = time_s - mean_s * np.log(np.maximum(draws[1], 1e-12))
    until_s[starts] = ends[starts]


def _fresnel_from_water(cosine: Array) -> Array:
    """Reflectance (n,) for unpolarised light that meets the surface from below (total beyond 48.3°)."""
    sine2 = np.minimum(_WATER_INDEX**2 * (1.0 - cosine**2), 1.0)
    inside, outside = cosine, np.sqrt(1.0 - sine2)
    s = (_WATER_INDEX * inside - outside) / (_WATER_INDEX * inside + outside + 1e-12)
    p = (inside - _WATER_INDEX * outside) / (inside + _WATER_INDEX * outside + 1e-12)
    return 0.5 * (s * s + p * p)
