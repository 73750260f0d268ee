"""Fits the `beacons` fidelity of a landing to detectors of lights and tags on rendered frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import minimize

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.contracts import Detector, Frame, RegionOfInterest, TagDetection
from auvdock.core.landing_station import LandingStationCfg
from auvdock.optics.detection_fit import Observation
from auvdock.optics.ground import Ground
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.sensing import meet
from auvdock.optics.tag_model import TagModelCfg, TagSight, inward, tag_chance, tag_sight

__all__ = ["TagObservation", "TagSeer", "fit_tag_model", "observe_landing"]

_GOOD_CELL_PX, _GOOD_SNR = 8.0, 60.0
_LOG_SLOPE, _LOG_LEAST_PX = math.log(8.0), math.log(2.0)
_SAME_SHARE = 0.25
"""Farther off than this share of the tag's edge, a detection is of something else."""


class TagSeer(Protocol):
    """Finds tags in a frame."""

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> tuple[TagDetection, ...]:
        """Detect in the whole frame, or only in the given regions when there are any."""
        ...


@dataclass(frozen=True, eq=False)
class TagObservation:
    """One frame: the tag that is there and what the detector gave.

    Attributes:
        sight: the tag on the sensor.
        corners_px: (4, 2) corners found, None if it was not.
    """

    sight: TagSight
    corners_px: Array | None


def observe_landing(
    camera: UnderwaterCamera,
    station: LandingStationCfg,
    lights: Detector,
    tags: TagSeer,
    poses: Iterable[Array],
    rng: np.random.Generator,
) -> tuple[list[Observation], list[TagObservation]]:
    """Render one frame at each body pose (4, 4), with fresh noise and settled exposure, and run both detectors on it.

    Frames without a light tell nothing of the detector of lights: what it finds there is white paint. The detector of
    tags gets the region in which a pilot would look for it: the tag with a border of its own size.
    """
    if camera.tag is None:
        raise ValueError("the camera draws no tag")
    scene = camera.tag.scene
    lit, ground = camera.lit, Ground(scene, station)
    size = (lit.camera.width_px, lit.camera.height_px)
    seen_lights: list[Observation] = []
    seen_tags: list[TagObservation] = []
    for pose in poses:
        camera.reset(rng.spawn(1)[0])
        shot = camera.take(pose, 0.0)
        view = shot.view
        spots = lit.spots.spread(view.arrivals, view.inside)
        below = np.median(ground.electrons_per_s(view.T_world_camera), axis=0)
        seen, _ = meet(lit, view, spots, shot.exposure_s, shot.gain, ground_e_s=below)
        if len(seen.lights):
            seen_lights.append(Observation(seen, lights.detect(shot.frame), size))
        tag_view = scene.look(view)
        sight = None if tag_view is None else tag_sight(tag_view, lit, shot.exposure_s, shot.gain)
        if sight is not None:
            found = tags.detect(shot.frame, (_around(sight.corners_px, size),))
            seen_tags.append(TagObservation(sight, _matching(sight, scene.tag.tag_id, found)))
    return seen_lights, seen_tags


def fit_tag_model(name: str, source: str, observations: Sequence[TagObservation]) -> TagModelCfg:
    """The model that explains the observations best, by maximum likelihood.

    Args:
        name: of the detector.
        source: what the observations are, for the record.
        observations: a few hundred frames that cover the heights, waters and lamps of interest.

    Raises:
        ValueError: fewer than 20 observations, or none of a tag that was found.
    """
    whole = [item for item in observations if item.sight.whole]
    found = [item for item in observations if item.corners_px is not None]
    if len(whole) < 20 or not found:
        raise ValueError("at least 20 frames that show the tag, and one in which it was found")
    cell = np.array([item.sight.cell_px for item in whole])
    snr = np.array([max(item.sight.contrast_snr, 1e-3) for item in whole])
    hit = np.array([item.corners_px is not None for item in whole])
    good = (cell > _GOOD_CELL_PX) & (snr > _GOOD_SNR)
    ceiling = float(np.mean(hit[good])) if np.count_nonzero(good) > 20 else 1.0
    ceiling = min(max(ceiling, 0.05), 1.0)
    cell_50, cell_slope, snr_50, snr_slope = _fit_curve(cell, snr, hit, ceiling)
    floor, noise, shift = _fit_corners(found)
    model = TagModelCfg(name, source, cell_50, cell_slope, snr_50, snr_slope, ceiling, ceiling, floor, noise, shift)
    cut = [item for item in observations if not item.sight.whole and tag_chance(item.sight, model) > 0.8 * ceiling]
    share = float(np.mean([item.corners_px is not None for item in cut])) if len(cut) >= 10 else 0.0
    return TagModelCfg(name, source, cell_50, cell_slope, snr_50, snr_slope, ceiling, share, floor, noise, shift)


def _around(corners_px: Array, size_px: tuple[int, int]) -> RegionOfInterest:
    low, high = corners_px.min(axis=0), corners_px.max(axis=0)
    margin = float((high - low).max()) + 12.0
    x0, y0 = (int(max(value, 0.0)) for value in low - margin)
    x1, y1 = (int(min(value, limit)) for value, limit in zip(high + margin, size_px, strict=True))
    return RegionOfInterest(x0, y0, x1, y1)


def _matching(sight: TagSight, tag_id: int, found: Sequence[TagDetection]) -> Array | None:
    for tag in found:
        miss = np.linalg.norm(tag.corners_px - sight.corners_px, axis=1).max()
        if tag.tag_id == tag_id and miss < 8.0 * sight.cell_px * _SAME_SHARE:
            return tag.corners_px
    return None


def _fit_curve(cell: Array, snr: Array, hit: BoolArray, ceiling: float) -> tuple[float, float, float, float]:
    log_cell, log_snr = np.log(cell), np.log(snr)

    def cost(x: Array) -> float:
        size = np.exp(np.clip(-math.exp(x[1]) * (log_cell - x[0]), -60.0, 60.0))
        contrast = np.exp(np.clip(-math.exp(x[3]) * (log_snr - x[2]), -60.0, 60.0))
        p = np.clip(ceiling / ((1.0 + size) * (1.0 + contrast)), 1e-6, 1.0 - 1e-6)
        # Slopes without bound fit data that are parted sharply, and frames may show no tag too small to be read: a
        # weak prior keeps slopes finite, and cells of two pixels, which no detector reads, the limit of size.
        return -float(np.sum(np.where(hit, np.log(p), np.log(1.0 - p)))) + 0.1 * float(
            (x[0] - _LOG_LEAST_PX) ** 2 + (x[1] - _LOG_SLOPE) ** 2 + (x[3] - _LOG_SLOPE) ** 2
        )

    starts = [
        np.array([math.log(c), math.log(8.0), math.log(s), math.log(4.0)]) for c in (1.5, 2.5, 4.0) for s in (5.0, 20.0)
    ]
    fits = [minimize(cost, start, method="Nelder-Mead", options={"maxiter": 1500}) for start in starts]
    best = fits[int(np.argmin([float(fit.fun) for fit in fits]))].x
    cell_50, cell_slope, snr_50, snr_slope = (math.exp(float(value)) for value in best)
    return cell_50, min(cell_slope, 40.0), snr_50, min(snr_slope, 40.0)


def _fit_corners(found: Sequence[TagObservation]) -> tuple[float, float, float]:
    """Floor, factor of 1/q, and share of the spread, under a t distribution with 3 degrees of freedom per corner."""
    errors: list[Array] = []
    ways: list[Array] = []
    weakness: list[float] = []
    for item in found:
        if item.corners_px is not None:
            errors.append(item.corners_px - item.sight.corners_px)
            ways.append(inward(item.sight.corners_px) * item.sight.spread_px)
            weakness.extend([1.0 / max(item.sight.contrast_snr, 1e-3)] * 4)
    error, way = np.concatenate(errors), np.concatenate(ways)
    shift = float(np.sum(error * way) / max(float(np.sum(way * way)), 1e-9))
    square = np.sum((error - shift * way) ** 2, axis=1)
    weak2 = np.array(weakness) ** 2

    def cost(x: Array) -> float:
        variance = math.exp(2.0 * x[0]) + math.exp(2.0 * x[1]) * weak2
        return float(np.sum(np.log(variance) + 2.5 * np.log1p(square / (3.0 * variance))))

    best = minimize(cost, np.array([math.log(0.05), math.log(1.0)]), method="Nelder-Mead", options={"maxiter": 800})
    return max(math.exp(float(best.x[0])), 0.005), math.exp(float(best.x[1])), shift
