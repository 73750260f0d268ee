"""One belief of a landing: what perception measures goes into one filter (paper C, algorithm 1 and remarks 1 to 3)."""

from __future__ import annotations

from collections.abc import Sequence

from auvdock.core.camera import Camera
from auvdock.core.contracts import Detections, PoseEstimate, Proprioception, RegionOfInterest, TagDetection
from auvdock.core.landing_station import LandingStationCfg
from auvdock.estimation.landing.agreement import Agreement
from auvdock.estimation.landing.filter import LandingFilter
from auvdock.estimation.landing.fusion import agree, weighted_mean
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.perception.landing.config import LandingPerceptionCfg
from auvdock.perception.landing.level import LevelPose
from auvdock.perception.landing.lights import NamedLights
from auvdock.perception.landing.pipeline import LandingPerception

__all__ = ["LandingEstimator"]


class LandingEstimator:
    """Where the camera is over one station: tells perception what to expect, judges and fuses what it measures."""

    def __init__(self, cfg: LandingPerceptionCfg, camera: Camera, station: LandingStationCfg) -> None:
        """Build perception and filter."""
        self._cfg = cfg
        self._perception = LandingPerception(cfg, camera, station)
        self._filter, lights, tag = (LandingFilter(cfg.filter, cfg.attitude, camera) for _ in range(3))
        self._new_lights, self._new_tag = Agreement(lights), Agreement(tag)
        self.reset()

    def reset(self) -> None:
        """Forget everything; call at the start of an episode."""
        self._perception.reset()
        self._filter.reset()
        self._forget()
        self._status = "searching"
        self._missed_lights = self._missed_tag = self._restarts = 0

    def tag_regions(self, proprioception: Proprioception) -> tuple[RegionOfInterest, ...]:
        """Where to look for the tag in the frame of this sample: empty for the whole frame.

        An empty region (x0 = x1) says that the tag must be out of view.
        """
        if self._missed_tag % self._cfg.tag.whole_frame_every_n == self._cfg.tag.whole_frame_every_n - 1:
            return ()
        expected = self._filter.expected(proprioception)
        region = None if expected is None else self._perception.tag_region(*expected)
        return () if region is None else (region,)

    def update(
        self, detections: Detections, tags: Sequence[TagDetection], proprioception: Proprioception
    ) -> LandingPercept:
        """Process one frame's detections and tags with the vehicle's own sensors of the same instant."""
        expected = self._filter.expected(proprioception)
        sight = self._perception.update(detections, tags, proprioception, expected)
        named, tag = sight.lights, sight.tag
        used_lights, used_tag = self._fuse(named, tag, proprioception)
        self._missed_lights = 0 if used_lights else self._missed_lights + 1
        self._missed_tag = 0 if used_tag else self._missed_tag + 1
        self._settle(used_lights or used_tag)
        of_lights = named.pose.estimate if named is not None else None
        of_tag = tag.estimate if tag is not None else None
        used = [pose for pose, use in ((of_lights, used_lights), (of_tag, used_tag)) if pose is not None and use]
        pose = self._estimate(used, proprioception)
        return LandingPercept(
            time_s=proprioception.time_s,
            pose=pose,
            long_range=self._perception.bearing() if pose is None else None,
            entrance=None,
            array_count=named.count if named is not None and used_lights else 0,
            detections=detections,
            tracks=sight.tracks,
            lights=of_lights,
            tag=of_tag,
            level="fused" if len(used) == 2 else "lights" if used_lights else "tag" if used_tag else "none",
            status=self._status,
            missed_lights=self._missed_lights,
            missed_tag=self._missed_tag,
            tags=tuple(tags),
            restarts=self._restarts,
        )

    def _forget(self) -> None:
        """Forget the poses that wait to be believed."""
        self._new_lights.reset()
        self._new_tag.reset()

    def _fuse(
        self, named: NamedLights | None, tag: LevelPose | None, proprioception: Proprioception
    ) -> tuple[bool, bool]:
        """Put the levels into the filter; which of them were used."""
        if not self._filter.running:
            return self._begin(named, tag, proprioception)
        gate, patience = self._cfg.filter.gate, self._cfg.filter.reset_after_n
        lights = named.pose if named is not None else None
        of_tag = None if tag is None else self._filter.compare(tag, proprioception)
        of_lights = None if lights is None else self._filter.compare(lights, proprioception)
        good_tag = of_tag is not None and of_tag.distance2 <= gate
        good_lights = of_lights is not None and of_lights.distance2 <= gate
        new_tag = self._new_tag.add(None if good_tag else tag, proprioception)
        new_lights = self._new_lights.add(None if good_lights else _convincing(named), proprioception)
        # The tag's code is proof of what it is, so it is believed against the lights; these only against no one.
        if tag is not None and new_tag >= patience:
            self._restart(tag, proprioception)
            return False, True
        if lights is not None and new_lights >= patience and self._missed_tag >= patience:
            self._restart(lights, proprioception)
            return True, False
        good = [each for each in (of_lights, of_tag) if each is not None and each.distance2 <= gate]
        if good and self._cfg.fusion == "ekf":
            self._filter.update(good)
        elif good:
            self._place([each.level for each in good], proprioception)
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
        levels = [level for level in (lights, tag) if level is not None]
        self._filter.start(levels, proprioception)
        self._forget()
        if self._cfg.fusion == "weighted":
            self._place(levels, proprioception)

    def _restart(self, level: LevelPose, proprioception: Proprioception) -> None:
        self._start(level, None, proprioception)
        self._restarts += 1

    def _place(self, levels: Sequence[LevelPose], proprioception: Proprioception) -> None:
        """Bare weighted fusion of one or two levels, lights first."""
        pose, covariance = levels[0].T_station_camera, levels[0].estimate.covariance
        if len(levels) == 2:
            pose, covariance = weighted_mean(*levels)
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

    def _estimate(self, used: Sequence[PoseEstimate], proprioception: Proprioception) -> PoseEstimate | None:
        """The belief, which rests on these poses of this frame."""
        if not self._filter.running:
            return None
        pose, covariance = self._filter.pose(proprioception)
        return PoseEstimate(
            T_station_camera=pose,
            covariance=covariance,
            beacon_ids=tuple(index for estimate in used for index in estimate.beacon_ids),
            solver=self._cfg.fusion,
            reprojection_error_px=max((estimate.reprojection_error_px for estimate in used), default=0.0),
            measured=bool(used),
        )


def _convincing(named: NamedLights | None) -> LevelPose | None:
    """The pose of lights that strays hardly explain."""
    return named.pose if named is not None and named.convincing else None
