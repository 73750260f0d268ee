"""Bearings without a pose: the far lamp or the blue group as a whole, and the red entrance lamps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, RED, Bearing
from auvdock.core.errors import ConfigError
from auvdock.perception.pnp import PnpSolution
from auvdock.perception.tracker import LightTracker

__all__ = ["LineOfSight", "LineOfSightCfg"]


@dataclass(frozen=True)
class LineOfSightCfg:
    """When a light is steady enough to steer by."""

    min_occurrences: int = 3
    """Detections within the tracker's window: a light seen once or twice does not steer."""
    max_missed: int = 5
    """A light may be bridged by prediction for this many frames."""
    group_size: int = 3
    """From this many blue lights on, the group's centre is the target and its spread gives a rough range."""
    loyalty: float = 0.7
    """A single light is kept until another scores more than its own score over this."""

    def __post_init__(self) -> None:
        """Refuse thresholds without meaning."""
        if self.min_occurrences < 1:
            raise ConfigError("line_of_sight.min_occurrences", self.min_occurrences, "1 or more")
        if self.group_size < 2:
            raise ConfigError("line_of_sight.group_size", self.group_size, "2 or more")
        if not 0.0 < self.loyalty <= 1.0:
            raise ConfigError("line_of_sight.loyalty", self.loyalty, "a fraction above 0 and up to 1")


class _Light(NamedTuple):
    u: float
    v: float
    weight: float
    track_id: int


class LineOfSight:
    """Bearings from the tracks of one camera."""

    def __init__(self, cfg: LineOfSightCfg, camera: Camera, layout: BeaconLayout) -> None:
        """Precompute the layout's spreads."""
        self._cfg = cfg
        self._map = _PixelMap(camera)
        blue = layout.indices("array") + layout.indices("long_range")
        self._blue_spread_m = _spread(layout.positions_m[list(blue)])
        red = layout.indices("entrance")
        self._red_spread_m = _spread(layout.positions_m[list(red)]) if len(red) > 1 else 0.0
        self._centre_m = layout.array_positions_m.mean(axis=0)
        self.reset()

    def reset(self) -> None:
        """Forget which light was followed."""
        self._followed = -1

    def update(self, tracks: LightTracker, solution: PnpSolution | None) -> tuple[Bearing | None, Bearing | None]:
        """(long range, entrance) bearings of this frame; with a pose the first is that of the array's centre."""
        lights = self._steady(tracks, (RED,) if solution is not None else (BLUE, RED))
        red = lights[RED]
        entrance = self._group(red, self._red_spread_m) if red else None
        if solution is not None:
            return self._array_centre(solution), entrance
        blue = lights[BLUE]
        if len(blue) >= self._cfg.group_size:
            return self._group(blue, self._blue_spread_m), entrance
        return (self._single(blue) if blue else None), entrance

    def _steady(self, tracks: LightTracker, classes: tuple[int, ...]) -> dict[int, list[_Light]]:
        found: dict[int, list[_Light]] = {BLUE: [], RED: []}
        rows = [
            row
            for row, (class_id, hits, missed) in enumerate(
                zip(tracks.class_id.tolist(), tracks.hits.tolist(), tracks.missed.tolist(), strict=True)
            )
            if class_id in classes and hits >= self._cfg.min_occurrences and missed <= self._cfg.max_missed
        ]
        if not rows:
            return found
        window = tracks.history.shape[1]
        for row in rows:
            scores = tracks.history[row].tolist()
            if window - scores.count(0.0) >= self._cfg.min_occurrences:
                u, v = tracks.state[row, :2].tolist()
                found[int(tracks.class_id[row])].append(_Light(u, v, sum(scores) / window, int(tracks.track_id[row])))
        return found

    def _single(self, lights: list[_Light]) -> Bearing:
        """The brightest and steadiest light: greatest sum of scores over the window, with loyalty to the last."""
        best = max(lights, key=lambda light: light.weight)
        for light in lights:
            if light.track_id == self._followed and light.weight >= self._cfg.loyalty * best.weight:
                best = light
        self._followed = best.track_id
        return self._bearing(best.u, best.v, best.weight, None)

    def _group(self, lights: list[_Light], spread_m: float) -> Bearing:
        """Centre of the group, strays left out; range = spread of the layout over spread of the angles."""
        kept = _without_strays(lights)
        n = len(kept)
        u = sum(light.u for light in kept) / n
        v = sum(light.v for light in kept) / n
        score = sum(light.weight for light in kept) / n
        range_m = None
        if n >= 3 and spread_m > 0.0:
            square = sum((light.u - u) ** 2 + (light.v - v) ** 2 for light in kept) / n
            if square > 1.0:
                range_m = spread_m * self._map.focal_px / math.sqrt(square)
        return self._bearing(u, v, score, range_m)

    def _array_centre(self, solution: PnpSolution) -> Bearing:
        centre = solution.rotation.dot(self._centre_m)
        centre += solution.translation_m
        range_m = math.sqrt(float(centre.dot(centre)))
        x, y, z = centre.tolist()
        return Bearing(centre / range_m, self._map.pixel(x / z, y / z), 1.0, range_m)

    def _bearing(self, u: float, v: float, score: float, range_m: float | None) -> Bearing:
        x, y = self._map(u, v)
        scale = 1.0 / math.sqrt(1.0 + x * x + y * y)
        return Bearing(np.array([x * scale, y * scale, scale]), np.array([u, v]), min(score, 1.0), range_m)


class _PixelMap:
    """The camera's projection for one pixel at a time, in plain floats: a tenth of the cost of the array version."""

    def __init__(self, camera: Camera) -> None:
        self.focal_px = float(camera.matrix[0, 0])
        self._fx, self._fy = float(camera.matrix[0, 0]), float(camera.matrix[1, 1])
        self._cx, self._cy = float(camera.matrix[0, 2]), float(camera.matrix[1, 2])
        self._k = tuple(camera.distortion.tolist())

    def pixel(self, x: float, y: float) -> Array:
        k1, k2, p1, p2, k3 = self._k
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.array([u * self._fx + self._cx, v * self._fy + self._cy])

    def __call__(self, u: float, v: float) -> tuple[float, float]:
        k1, k2, p1, p2, k3 = self._k
        x0, y0 = (u - self._cx) / self._fx, (v - self._cy) / self._fy
        x, y = x0, y0
        for _ in range(50):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            x_new = (x0 - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial
            y_new = (y0 - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial
            done = abs(x_new - x) + abs(y_new - y) < 1e-10
            x, y = x_new, y_new
            if done:
                break
        return x, y


def _spread(positions_m: Array) -> float:
    """RMS distance from the centroid, across the approach axis: what the camera sees of it from afar."""
    across = positions_m[:, 1:] - positions_m[:, 1:].mean(axis=0)
    return float(np.sqrt((across**2).sum(axis=1).mean()))


def _without_strays(lights: list[_Light]) -> list[_Light]:
    """Lights within three median distances of the component-wise median; with two, the surer one if they are apart."""
    n = len(lights)
    if n < 3:
        return lights if n < 2 else [max(lights, key=lambda light: light.weight)]
    u = sorted(light.u for light in lights)[n // 2]
    v = sorted(light.v for light in lights)[n // 2]
    distances = [math.hypot(light.u - u, light.v - v) for light in lights]
    limit = 3.0 * sorted(distances)[n // 2] + 2.0
    return [light for light, distance in zip(lights, distances, strict=True) if distance <= limit]
