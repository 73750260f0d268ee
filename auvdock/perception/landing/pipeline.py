"""Perception of a landing as a whole: detections and tags in, percept out (paper C, algorithm 1 and remarks 1 to 3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import (
    Detections,
    Percept,
    PoseEstimate,
    Proprioception,
    RegionOfInterest,
    TagDetection,
)
from auvdock.core.landing_station import LandingStationCfg
from auvdock.perception.landing.agreement import Agreement
from auvdock.perception.landing.bearing import group_bearing
from auvdock.perception.landing.config import LandingPerceptionCfg
from auvdock.perception.landing.filter import LandingFilter
from auvdock.perception.landing.fusion import agree, weighted_mean
from auvdock.perception.landing.level import LevelPose, LevelSolver
from auvdock.perception.landing.lights import LightLevel, NamedLights
from auvdock.perception.landing.tag import TagLevel
from auvdock.perception.tracker import LightTracker
from auvdock.perception.views import TrackViews

__all__ = ["LandingPercept", "LandingPerception"]


@dataclass(frozen=True, eq=False)
class LandingPercept(Percept):
    """What perception makes of one frame over the landing station.

    `pose` is the filtered pose; `pose.measured` is True if a level measured in this frame. `long_range` is the bearing
    to the group of lights while there is no pose.

    Attributes:
        lights: level I's own pose in this frame.
        tag: level II's own pose in this frame.
        level: what the frame's pose rests on: "none", "lights", "tag" or "fused".
        status: "searching" before the first pose, "tracking" with a measurement in this frame, "holding" while the pose
            is carried on by dead reckoning alone, "lost" once both levels have been silent for too long.
        missed_lights: C_L, consecutive frames without level I.
        missed_tag: C_A, consecutive frames without level II.
        tags: the frame's tags.
    """

    lights: PoseEstimate | None = None
    tag: PoseEstimate | None = None
    level: str = "none"
    status: str = "searching"
    missed_lights: int = 0
    missed_tag: int = 0
    tags: tuple[TagDetection, ...] = ()


class LandingPerception:
    """The two levels, their fusion and its filter for one camera over one station."""

    def __init__(self, cfg: LandingPerceptionCfg, camera: Camera, station: LandingStationCfg) -> None:
        """Build the parts."""
        self._cfg = cfg
        self._camera = camera
        self._station = station
        self._points_m = np.ascontiguousarray(station.layout.array_positions_m)
        solver = LevelSolver(cfg.attitude, camera)
        self._lights = LightLevel(cfg.lights, station, camera, solver)
        self._tag = TagLevel(cfg.tag, station.tag, camera, solver)
        self._tracks = LightTracker(cfg.tracker, camera.rate_hz, camera.width_px, camera.height_px)
        self._filter = LandingFilter(cfg.filter, cfg.attitude, camera, math.radians(cfg.station_yaw_deg))
        self._new_lights, self._new_tag = (
            Agreement(LandingFilter(cfg.filter, cfg.attitude, camera, math.radians(cfg.station_yaw_deg)))
            for _ in range(2)
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything; call at the start of an episode."""
        self._tracks.reset()
        self._filter.reset()
        self._forget()
        self._status = "searching"
        self._missed_lights = self._missed_tag = 0

    def tag_regions(self, proprioception: Proprioception) -> tuple[RegionOfInterest, ...]:
        """Where to look for the tag in the frame of this sample: empty for the whole frame.

        An empty region (x0 = x1) says that the tag must be out of view.
        """
        if self._missed_tag % self._cfg.tag.whole_frame_every_n == self._cfg.tag.whole_frame_every_n - 1:
            return ()
        expected = self._filter.expected(proprioception)
        region = None if expected is None else self._tag.region(*expected)
        return () if region is None else (region,)

    def update(
        self, detections: Detections, tags: Sequence[TagDetection], proprioception: Proprioception
    ) -> LandingPercept:
        """Process one frame's detections and tags with the vehicle's own sensors of the same instant."""
        cfg = self._cfg
        self._tracks.update(detections)
        self._filter.predict(proprioception)
        attitude = self._filter.measured_attitude(proprioception)
        expected = self._filter.pose(proprioception) if self._filter.running else None
        place = expected[0] if expected is not None else None
        tag = self._tag.measure(tags, attitude, place) if cfg.levels != "lights" else None
        height_m = self._height_m(attitude, proprioception)
        named = self._name(detections, attitude, height_m, expected) if cfg.levels != "tag" else None
        lights = named.pose if named is not None else None
        used_lights, used_tag = self._fuse(named, tag, proprioception)
        self._missed_lights = 0 if used_lights else self._missed_lights + 1
        self._missed_tag = 0 if used_tag else self._missed_tag + 1
        measured = used_lights or used_tag
        self._settle(measured)
        level = "fused" if used_lights and used_tag else "lights" if used_lights else "tag" if used_tag else "none"
        pose = self._estimate(lights, tag, used_lights, used_tag, proprioception)
        return LandingPercept(
            time_s=proprioception.time_s,
            pose=pose,
            long_range=group_bearing(self._tracks, self._camera, self._points_m) if pose is None else None,
            entrance=None,
            array_count=named.count if named is not None and used_lights else 0,
            detections=detections,
            tracks=self._views(named),
            lights=None if lights is None else lights.estimate,
            tag=None if tag is None else tag.estimate,
            level=level,
            status=self._status,
            missed_lights=self._missed_lights,
            missed_tag=self._missed_tag,
            tags=tuple(tags),
        )

    def _forget(self) -> None:
        """Forget the poses that wait to be believed."""
        self._new_lights.reset()
        self._new_tag.reset()

    def _height_m(self, attitude: Array, proprioception: Proprioception) -> float:
        """Height of the camera above the station's origin by the pressure gauge and the station's charted depth."""
        arm = self._camera.T_body_camera[:3, 3]
        above = float((attitude @ self._camera.T_body_camera[:3, :3].T @ arm)[2])
        return self._station.depth_m - proprioception.depth_m + above

    def _name(
        self, detections: Detections, attitude: Array, height_m: float, expected: tuple[Array, Array] | None
    ) -> NamedLights | None:
        if expected is not None:
            named = self._lights.follow(detections, attitude, *expected)
            if named is not None:
                return named
        return self._lights.find(detections, attitude, height_m)

    def _fuse(
        self, named: NamedLights | None, tag: LevelPose | None, proprioception: Proprioception
    ) -> tuple[bool, bool]:
        """Put the levels into the filter; which of them were used."""
        if not self._filter.running:
            return self._begin(named, tag, proprioception)
        gate, patience = self._cfg.filter.gate, self._cfg.filter.reset_after_n
        lights = named.pose if named is not None else None
        good_tag = tag is not None and self._filter.distance2(tag, proprioception) <= gate
        good_lights = lights is not None and self._filter.distance2(lights, proprioception) <= gate
        new_tag = self._new_tag.add(None if good_tag else tag, proprioception)
        new_lights = self._new_lights.add(None if good_lights else _convincing(named), proprioception)
        # The tag's code is proof of what it is, so it is believed against the lights; these only against no one.
        if tag is not None and new_tag >= patience:
            return self._restart(tag, False, proprioception)
        if lights is not None and new_lights >= patience and self._missed_tag >= patience:
            return self._restart(lights, True, proprioception)
        self._apply(lights if good_lights else None, tag if good_tag else None, proprioception)
        return good_lights, good_tag

    def _begin(
        self, named: NamedLights | None, tag: LevelPose | None, proprioception: Proprioception
    ) -> tuple[bool, bool]:
        """The first pose: at once from a tag, from lights alone once some consecutive frames agree."""
        lights = named.pose if named is not None else None
        if tag is not None:
            both = lights is not None and agree(lights, tag, self._cfg.filter.gate)
            self._start(lights if both else None, tag, proprioception)
            return both, True
        if self._new_lights.add(_convincing(named), proprioception) < self._cfg.lights.confirm_n:
            return False, False
        self._start(lights, None, proprioception)
        return True, False

    def _start(self, lights: LevelPose | None, tag: LevelPose | None, proprioception: Proprioception) -> None:
        self._filter.reset()
        levels = [level for level in (lights, tag) if level is not None]
        self._filter.start(levels, proprioception)
        self._forget()
        if self._cfg.fusion == "weighted":
            self._apply(lights, tag, proprioception)

    def _restart(self, level: LevelPose, is_lights: bool, proprioception: Proprioception) -> tuple[bool, bool]:
        if is_lights:
            self._start(level, None, proprioception)
        else:
            self._start(None, level, proprioception)
        return is_lights, not is_lights

    def _apply(self, lights: LevelPose | None, tag: LevelPose | None, proprioception: Proprioception) -> None:
        levels = [level for level in (lights, tag) if level is not None]
        if not levels:
            return
        if self._cfg.fusion == "ekf":
            self._filter.update(levels, proprioception)
            return
        if lights is not None and tag is not None:
            pose, covariance = weighted_mean(lights, tag)
        else:
            pose, covariance = levels[0].T_station_camera, levels[0].estimate.covariance
        self._filter.place(pose, covariance, proprioception)

    def _settle(self, measured: bool) -> None:
        """Status after this frame; a pose is dropped once both levels are dead."""
        if measured:
            self._status = "tracking"
        elif self._filter.running:
            cfg = self._cfg
            lights_dead = cfg.levels == "tag" or self._missed_lights >= cfg.max_missed_lights_n
            tag_dead = cfg.levels == "lights" or self._missed_tag >= cfg.max_missed_tag_n
            self._status = "holding"
            if lights_dead and tag_dead:
                self._status = "lost"
                self._filter.reset()
                self._forget()

    def _estimate(
        self,
        lights: LevelPose | None,
        tag: LevelPose | None,
        used_lights: bool,
        used_tag: bool,
        proprioception: Proprioception,
    ) -> PoseEstimate | None:
        if not self._filter.running:
            return None
        pose, covariance = self._filter.pose(proprioception)
        used = [level.estimate for level, use in ((lights, used_lights), (tag, used_tag)) if level is not None and use]
        return PoseEstimate(
            T_station_camera=pose,
            covariance=covariance,
            beacon_ids=lights.estimate.beacon_ids if lights is not None and used_lights else (),
            solver=self._cfg.fusion,
            reprojection_error_px=max((estimate.reprojection_error_px for estimate in used), default=0.0),
            measured=bool(used),
        )

    def _views(self, named: NamedLights | None) -> TrackViews:
        tracks = self._tracks
        tracks.beacon_id[:] = -1
        if named is not None:
            for light, detection in enumerate(named.detection.tolist()):
                if detection >= 0:
                    tracks.beacon_id[tracks.detection == detection] = light
        return tracks.views()


def _convincing(named: NamedLights | None) -> LevelPose | None:
    """The pose of lights that strays hardly explain."""
    return named.pose if named is not None and named.convincing else None
