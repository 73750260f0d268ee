"""Lights followed in compass bearing, with the history of their brightness."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.camera import Camera
from auvdock.core.contracts import Detections
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.motion import CameraPlace

__all__ = ["Candidate", "Candidates", "Pass", "Spot", "merge_spots"]

_KNOWN = 20
_STEADY = 0.6
"""A light in view for 20 frames or more and seen in six of ten is a lamp (ours): a flash is seen in fewer."""


@dataclass(frozen=True, eq=False)
class Spot:
    """One light of one frame: detections that lie close together.

    Attributes:
        ray_camera: (3,) unit ray.
        flux: the brightest detection's flux.
        score: its score.
        rows: its rows in the frame's detections.
    """

    ray_camera: Array
    flux: float
    score: float
    rows: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Pass:
    """The beam swept past once.

    Attributes:
        time_s: time of the peak.
        sigma_rad: its standard deviation as beam angle.
        amplitude: flux at the peak, above steady light.
        widening: of the pass profile.
        ray_compass: (3,) unit direction to the light in level compass axes.
        place_m: (2,) place of the camera at the peak.
        covered: the light was in view for most of the turn before.
        score: mean detection score.
    """

    time_s: float
    sigma_rad: float
    amplitude: float
    widening: float
    ray_compass: Array
    place_m: Array
    covered: bool
    score: float


@dataclass(eq=False)
class Candidate:
    """One light over time; times, fluxes and rays of the frames in which its direction was in view.

    Attributes:
        ray_compass: (3,) direction as last seen, or predicted.
        last_seen_s: time of the last detection.
        times_s, flux, seen: samples; flux is 0 where the light was not found.
        rays: compass rays of the samples, None where the light was not found.
        scores: detection scores, 0 likewise.
        judged_s: samples up to here have been judged.
        chain: coherent passes so far.
        hits: detections so far.
    """

    ray_compass: Array
    last_seen_s: float
    times_s: list[float] = field(default_factory=list[float])
    flux: list[float] = field(default_factory=list[float])
    seen: list[bool] = field(default_factory=list[bool])
    rays: list[Array | None] = field(default_factory=list["Array | None"])
    scores: list[float] = field(default_factory=list[float])
    judged_s: float = -math.inf
    chain: list[Pass] = field(default_factory=list[Pass])
    hits: int = 0

    @property
    def lamp(self) -> bool:
        """Whether the light is there most of the time: no flash."""
        return len(self.seen) >= _KNOWN and sum(self.seen) >= _STEADY * len(self.seen)

    def add(self, time_s: float, spot: Spot, ray_compass: Array, keep_s: float) -> None:
        """One frame in which the light was seen."""
        self.times_s.append(time_s)
        self.flux.append(spot.flux)
        self.seen.append(True)
        self.rays.append(ray_compass)
        self.scores.append(spot.score)
        self.last_seen_s, self.ray_compass, self.hits = time_s, ray_compass, self.hits + 1
        self._forget(time_s - keep_s)

    def share(self, time_s: float, spot: Spot | None, ray_compass: Array | None, keep_s: float) -> None:
        """One frame with the light in view and no spot of its own: not found, or part of another light's `spot`."""
        self.times_s.append(time_s)
        self.flux.append(spot.flux if spot is not None else 0.0)
        self.seen.append(spot is not None)
        self.rays.append(ray_compass)
        self.scores.append(spot.score if spot is not None else 0.0)
        self._forget(time_s - keep_s)

    def _forget(self, before_s: float) -> None:
        if self.times_s[0] < before_s:
            cut = next(k for k, t in enumerate(self.times_s) if t >= before_s)
            del self.times_s[:cut], self.flux[:cut], self.seen[:cut], self.rays[:cut], self.scores[:cut]


def merge_spots(detections: Detections, camera: Camera, cfg: ForwardBeaconCfg) -> list[Spot]:
    """Lights of a frame, brightest first.

    Detections within `merge_deg` of a brighter one are the same light; its direction is their mean, weighted by flux.
    Much dimmer ones within `glare_deg` are parts of its halo and left out: they flash with it.
    Without flux, brightness comes from the score: (s / (1 - s))² goes with light in a code that is the root of it, for
    one exposure only.
    """
    if len(detections) == 0:
        return []
    rays = camera.rays(detections.centre_px)
    flux = detections.flux
    if flux is None:
        score = np.clip(detections.score, 0.0, 0.999)
        flux = (score / (1.0 - score)) ** 2
    close, glare = math.cos(math.radians(cfg.merge_deg)), math.cos(math.radians(cfg.glare_deg))
    free = np.ones(len(rays), dtype=np.bool_)
    spots: list[Spot] = []
    for first in np.argsort(-flux, kind="stable"):
        if not free[first]:
            continue
        cosine = rays @ rays[first]
        rows = np.flatnonzero(free & (cosine >= close))
        free[rows] = False
        free &= (cosine < glare) | (flux * cfg.glare_ratio > flux[first])
        ray = (flux[rows] + 1e-12) @ rays[rows]
        norm = float(np.linalg.norm(ray))
        ray = ray / norm if norm > 0.0 else rays[first]
        spots.append(Spot(ray, float(flux[first]), float(detections.score[first]), tuple(rows.tolist())))
    return spots


class Candidates:
    """The lights that are followed."""

    def __init__(self, cfg: ForwardBeaconCfg, camera: Camera, turn_s: float) -> None:
        """Keep the settings.

        Args:
            cfg: gates and limits.
            camera: the camera.
            turn_s: duration of a turn of the beacon.
        """
        self._cfg, self._camera, self._turn_s = cfg, camera, turn_s
        self._gate_cosine = math.cos(math.radians(cfg.gate_deg))
        self._flash_cosine = math.cos(math.radians(cfg.flash_deg))
        self._wander_cosine = math.cos(math.radians(2.0 * cfg.flash_deg))
        self._merge_cosine = math.cos(math.radians(cfg.merge_deg))
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self.all: list[Candidate] = []
        self._before: tuple[CameraPlace, list[Array], set[int]] | None = None
        """The frame before: the camera, its spots' compass rays, and which of them are lamps'."""

    def update(
        self, spots: list[Spot], place: CameraPlace, kept: Candidate | None, lit: bool
    ) -> tuple[dict[int, Candidate], list[int]]:
        """Give each spot to its candidate or make a new one.

        While the beacon is lit, the brightest spot near its direction is it: its centre wanders along the beam. New
        spots beside it are parts of its halo and make no candidates.

        Args:
            spots: lights of this frame, brightest first.
            place: the camera's place and attitude.
            kept: the beacon's candidate, which is never dropped.
            lit: the beacon is lit.

        Returns:
            Candidates by their spot's index, and the indices of the beacon's halo's parts.
        """
        cfg = self._cfg
        self._drop(place.time_s, kept)
        rays = [place.R_compass_camera @ spot.ray_camera for spot in spots]
        near: list[int] = []
        if kept is not None and lit:
            limit = math.cos(math.radians(cfg.max_gate_deg))
            near = [
                index
                for index, ray in enumerate(rays)
                if (cosine := float(ray @ kept.ray_compass)) >= limit and not self._lamp(ray, cosine, kept)
            ]
        owner = self._assign(rays, place.time_s, kept if near else None, near[0] if near else -1)
        parts = [index for index in near if index not in owner]
        in_view = self._in_view(place)
        keep_s = 2.5 * self._turn_s
        by_candidate = {id(candidate): index for index, candidate in owner.items()}
        of_lamps = {index for index, candidate in owner.items() if candidate.lamp}
        for candidate, visible in zip(self.all, in_view.tolist(), strict=True):
            index = by_candidate.get(id(candidate))
            alone = index is not None and (candidate.lamp or candidate is kept)
            shared = index if alone else self._shared(candidate, rays, of_lamps)
            if index is not None and (shared is None or shared >= index):
                candidate.add(place.time_s, spots[index], rays[index], keep_s)
            elif visible:
                # Two lights that melt into one from time to time share its brightness then.
                if shared is None:
                    candidate.share(place.time_s, None, None, keep_s)
                else:
                    candidate.share(place.time_s, spots[shared], rays[shared], keep_s)
        for index, spot in enumerate(spots):
            if index in owner or index in parts or len(self.all) - len(owner) > 2 * cfg.max_candidates:
                continue
            candidate = Candidate(rays[index], place.time_s)
            self._look_back(candidate, keep_s)
            candidate.add(place.time_s, spot, rays[index], keep_s)
            self.all.append(candidate)
            owner[index] = candidate
        self._before = place, rays, of_lamps
        return owner, parts

    def _look_back(self, candidate: Candidate, keep_s: float) -> None:
        """Note that a new candidate was dark in the frame before, if it was in view: that brackets its pass."""
        if self._before is None:
            return
        place, rays, of_lamps = self._before
        in_view = self._camera.in_view((candidate.ray_compass @ place.R_compass_camera)[None])[0]
        if in_view and self._shared(candidate, rays, of_lamps) is None:
            candidate.share(place.time_s, None, None, keep_s)

    def _assign(self, rays: list[Array], time_s: float, beacon: Candidate | None, own: int) -> dict[int, Candidate]:
        """The lit beacon's spot `own` to it, then nearest pairs first, each candidate and each spot once."""
        if not rays or not self.all:
            return {}
        directions = np.array([candidate.ray_compass for candidate in self.all])
        cosine = np.clip(np.array(rays) @ directions.T, -1.0, 1.0)
        gap = np.degrees(np.arccos(cosine))
        since = time_s - np.array([candidate.last_seen_s for candidate in self.all])
        gate = np.minimum(self._cfg.gate_deg + self._cfg.gate_rise_deg_s * since, self._cfg.max_gate_deg)
        gap = np.where(gap <= gate, gap, np.inf)
        owner: dict[int, Candidate] = {}
        if beacon is not None:
            owner[own] = beacon
            gap[own, :] = np.inf
            gap[:, [candidate is beacon for candidate in self.all]] = np.inf
        while np.isfinite(gap.min()):
            spot, row = np.unravel_index(int(gap.argmin()), gap.shape)
            owner[int(spot)] = self.all[int(row)]
            gap[spot, :] = np.inf
            gap[:, row] = np.inf
        return owner

    def _lamp(self, ray: Array, cosine: float, beacon: Candidate) -> bool:
        """Whether a spot is a lamp's, nearer to that than to the beacon."""
        gate = max(cosine, self._gate_cosine)
        return any(c is not beacon and float(ray @ c.ray_compass) > gate and c.lamp for c in self.all)

    def _shared(self, candidate: Candidate, rays: list[Array], of_lamps: set[int]) -> int | None:
        """The spot that a candidate may be part of.

        A lamp without a spot of its own melts into the nearest within the merging distance. A flash is the brightest
        spot near it that is no lamp's: a faint one's halo has its centre now here, now there, and falls apart.
        """
        if not candidate.lamp:
            # Its centre wanders along the beam: it is looked for where it was in the frame before.
            last = candidate.rays[-1] if candidate.rays else None
            centre = last if last is not None else candidate.ray_compass
            for index, ray in enumerate(rays):
                wandered = float(ray @ candidate.ray_compass) < self._wander_cosine
                if index not in of_lamps and not wandered and float(ray @ centre) >= self._flash_cosine:
                    return index
        return self._nearest(candidate, rays)

    def _nearest(self, candidate: Candidate, rays: list[Array]) -> int | None:
        """The nearest spot within the merging distance."""
        best, index = self._merge_cosine, None
        for k, ray in enumerate(rays):
            if (cosine := float(ray @ candidate.ray_compass)) >= best:
                best, index = cosine, k
        return index

    def _in_view(self, place: CameraPlace) -> BoolArray:
        if not self.all:
            return np.zeros(0, dtype=np.bool_)
        directions = np.array([candidate.ray_compass for candidate in self.all])
        return self._camera.in_view(directions @ place.R_compass_camera)

    def _drop(self, time_s: float, kept: Candidate | None) -> None:
        """Lights not seen for two and a half turns go, and the rarest of too many."""
        oldest = time_s - 2.5 * self._turn_s
        self.all = [c for c in self.all if c.last_seen_s >= oldest or c is kept]
        if len(self.all) > self._cfg.max_candidates:
            ranked = sorted(self.all, key=lambda c: (c is kept, len(c.chain), c.hits, c.last_seen_s), reverse=True)
            chosen = {id(c) for c in ranked[: self._cfg.max_candidates]}
            self.all = [c for c in self.all if id(c) in chosen]
