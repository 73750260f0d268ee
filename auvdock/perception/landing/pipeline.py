"""Perception of a landing as a whole: detections and tags in, measured poses out (paper C, algorithm 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Bearing, Detections, Proprioception, RegionOfInterest, TagDetection
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.transforms import rotation_from_euler_zyx
from auvdock.perception.landing.bearing import group_bearing
from auvdock.perception.landing.config import LandingPerceptionCfg
from auvdock.perception.landing.level import LevelPose, LevelSolver
from auvdock.perception.landing.lights import LightLevel, NamedLights
from auvdock.perception.landing.tag import TagLevel
from auvdock.perception.tracker import LightTracker
from auvdock.perception.views import TrackViews

__all__ = ["LandingPerception", "LandingSight"]


@dataclass(frozen=True, eq=False)
class LandingSight:
    """What perception measures in one frame over the landing station, each level by itself.

    Attributes:
        lights: level I: its pose and which detection is which light.
        tag: level II.
        tracks: the tracks alive after this frame.
    """

    lights: NamedLights | None
    tag: LevelPose | None
    tracks: TrackViews


class LandingPerception:
    """The two levels for one camera over one station."""

    def __init__(self, cfg: LandingPerceptionCfg, camera: Camera, station: LandingStationCfg) -> None:
        """Build the parts."""
        self._cfg = cfg
        self._camera = camera
        self._station = station
        self._points_m = np.ascontiguousarray(station.layout.array_positions_m)
        self._body_camera = np.ascontiguousarray(camera.T_body_camera[:3, :3])
        self._station_yaw_rad = float(np.radians(cfg.station_yaw_deg))
        solver = LevelSolver(cfg.attitude, camera)
        self._lights = LightLevel(cfg.lights, station, camera, solver)
        self._tag = TagLevel(cfg.tag, station.tag, camera, solver)
        self._tracks = LightTracker(cfg.tracker, camera.rate_hz, camera.width_px, camera.height_px)

    def reset(self) -> None:
        """Forget the tracks; call at the start of an episode."""
        self._tracks.reset()

    def tag_region(self, T_station_camera: Array, covariance: Array) -> RegionOfInterest | None:
        """Where the tag must be in the image of an expected pose (4, 4), (6, 6); see `TagLevel.region`."""
        return self._tag.region(T_station_camera, covariance)

    def update(
        self,
        detections: Detections,
        tags: Sequence[TagDetection],
        proprioception: Proprioception,
        expected: tuple[Array, Array] | None,
    ) -> LandingSight:
        """Measure in one frame.

        Args:
            detections: the frame's lights.
            tags: the frame's tags.
            proprioception: the vehicle's own sensors at the same instant.
            expected: (T_station_camera (4, 4), its covariance (6, 6)) where the camera is believed to be, if anywhere.
        """
        levels = self._cfg.levels
        self._tracks.update(detections)
        attitude = self._attitude(proprioception)
        tag = None
        if levels != "lights":
            tag = self._tag.measure(tags, attitude, expected[0] if expected is not None else None)
        named = None
        if levels != "tag":
            named = self._name(detections, attitude, self._height_m(attitude, proprioception), expected)
        return LandingSight(named, tag, self._views(named))

    def bearing(self) -> Bearing | None:
        """Bearing to the group of lights after the newest frame."""
        return group_bearing(self._tracks, self._camera, self._points_m)

    def _attitude(self, proprioception: Proprioception) -> Array:
        """(3, 3) R_station_camera by inclinometer and compass alone."""
        roll, pitch, yaw = proprioception.euler_zyx_rad.tolist()
        return rotation_from_euler_zyx(roll, pitch, yaw - self._station_yaw_rad) @ self._body_camera

    def _height_m(self, attitude: Array, proprioception: Proprioception) -> float:
        """Height of the camera above the station's origin by the pressure gauge and the station's charted depth."""
        arm = self._camera.T_body_camera[:3, 3]
        above = float((attitude @ self._body_camera.T @ arm)[2])
        return self._station.depth_m - proprioception.depth_m + above

    def _name(
        self, detections: Detections, attitude: Array, height_m: float, expected: tuple[Array, Array] | None
    ) -> NamedLights | None:
        if expected is not None:
            named = self._lights.follow(detections, attitude, *expected)
            if named is not None:
                return named
        return self._lights.find(detections, attitude, height_m)

    def _views(self, named: NamedLights | None) -> TrackViews:
        tracks = self._tracks
        tracks.beacon_id[:] = -1
        if named is not None:
            for light, detection in enumerate(named.detection.tolist()):
                if detection >= 0:
                    tracks.beacon_id[tracks.detection == detection] = light
        return tracks.views()
