"""What the rooms hand each other. Frozen, with shapes and units; arrays are checked where they cross a border."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from auvdock.core.arrays import Array, BoolArray, Image, IntArray, check_shape
from auvdock.core.camera import Camera
from auvdock.core.response import CameraResponse
from auvdock.numeric.constants import BLUE, RED

__all__ = [
    "BLUE",
    "RED",
    "AzimuthFix",
    "Bearing",
    "Command",
    "Detections",
    "Detector",
    "Frame",
    "Percept",
    "PoseEstimate",
    "Proprioception",
    "RegionOfInterest",
    "Sensed",
    "TagDetection",
    "TrackView",
]

_FOUR_VECTORS = ((3,),) * 4


@dataclass(frozen=True, eq=False)
class Frame:
    """One camera frame.

    Attributes:
        image: (H, W, 3) uint8, RGB.
        time_s: time of mid exposure.
        camera: the camera that took it.
        exposure_s: exposure time.
        gain: analogue gain.
        response: how its codes stand for light.
    """

    image: Image
    time_s: float
    camera: Camera
    exposure_s: float = 1.0
    gain: float = 1.0
    response: CameraResponse = CameraResponse()

    def __post_init__(self) -> None:
        """Check shape and type."""
        check_shape("image", self.image, (self.camera.height_px, self.camera.width_px, 3))
        if self.image.dtype != np.uint8:
            raise ValueError(f"image has type {self.image.dtype}, expected uint8")


@dataclass(frozen=True)
class RegionOfInterest:
    """Part of an image in pixels: columns x0 to x1 and rows y0 to y1, upper bounds excluded."""

    x0: int
    y0: int
    x1: int
    y1: int


@dataclass(frozen=True, eq=False)
class Detections:
    """What a detector saw in one frame; n may be 0.

    Attributes:
        xyxy: (n, 4) boxes, left, top, right, bottom, px.
        centre_px: (n, 2) light centres (for keypoint networks the keypoint), px.
        score: (n,) confidence in [0, 1].
        class_id: (n,) class, `BLUE` or `RED` for the beacon detectors.
        flux: (n,) light of each spot above its surroundings with exposure and gain divided out, in a unit that is
            constant over frames; None where the detector was not asked for it.
    """

    xyxy: Array
    centre_px: Array
    score: Array
    class_id: IntArray
    flux: Array | None = None

    def __post_init__(self) -> None:
        """Check shapes."""
        check_shape("score", self.score, (getattr(self.score, "shape", None) or (None,))[:1])
        n = len(self.score)
        if self.flux is not None:
            check_shape("flux", self.flux, (n,))
        check_shape("xyxy", self.xyxy, (n, 4))
        check_shape("centre_px", self.centre_px, (n, 2))
        check_shape("class_id", self.class_id, (n,))

    def __len__(self) -> int:
        """Number of detections."""
        return len(self.score)

    def select(self, index: IntArray | BoolArray) -> Detections:
        """Those at the given indices or under the given mask."""
        flux = None if self.flux is None else self.flux[index]
        return Detections(self.xyxy[index], self.centre_px[index], self.score[index], self.class_id[index], flux)

    @staticmethod
    def empty() -> Detections:
        """No detection."""
        return Detections(np.zeros((0, 4)), np.zeros((0, 2)), np.zeros(0), np.zeros(0, dtype=np.int64))

    @staticmethod
    def from_points(
        centre_px: Array, score: Array, class_id: IntArray, radius_px: float = 2.0, flux: Array | None = None
    ) -> Detections:
        """Detections with square boxes around given centres (n, 2)."""
        half = np.full((len(score), 2), radius_px)
        return Detections(np.hstack([centre_px - half, centre_px + half]), centre_px, score, class_id, flux)


@dataclass(frozen=True, eq=False)
class TagDetection:
    """One fiducial marker in one frame.

    Attributes:
        tag_id: number within the family.
        corners_px: (4, 2) corners of the black square: upper left, upper right, lower right, lower left as the tag is
            read.
        sigma_px: standard deviation of a corner per axis.
    """

    tag_id: int
    corners_px: Array
    sigma_px: float

    def __post_init__(self) -> None:
        """Check the shape."""
        check_shape("corners_px", self.corners_px, (4, 2))


class Detector(Protocol):
    """Finds lights in a frame."""

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame, or only in the given regions when there are any."""
        ...


@dataclass(frozen=True, eq=False)
class Bearing:
    """Direction to a light.

    Attributes:
        ray_camera: (3,) unit ray in the camera frame.
        centre_px: (2,) pixel.
        score: confidence in [0, 1].
        range_m: rough range where the sight carries one (from the spread of a group of known lights), else None.
    """

    ray_camera: Array
    centre_px: Array
    score: float
    range_m: float | None = None


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """Pose of the camera in the station frame, from authenticated beacons.

    Attributes:
        T_station_camera: (4, 4).
        covariance: (6, 6) of (translation in the station frame in m, small rotation in the camera frame in rad).
        beacon_ids: indices into the layout's array beacons that were used.
        solver: name of the PnP solver.
        reprojection_error_px: mean distance between observed and reprojected lights.
        measured: True if solved from this frame's detections, False if predicted from earlier ones.
    """

    T_station_camera: Array
    covariance: Array
    beacon_ids: tuple[int, ...]
    solver: str
    reprojection_error_px: float
    measured: bool = True

    def __post_init__(self) -> None:
        """Check shapes."""
        check_shape("T_station_camera", self.T_station_camera, (4, 4))
        check_shape("covariance", self.covariance, (6, 6))


@dataclass(frozen=True, eq=False)
class AzimuthFix:
    """Where the vehicle lies as seen from a rotating beacon, from the time at which its beam swept past.

    Attributes:
        time_s: vehicle time of the sweep.
        azimuth_rad: azimuth of the camera in the station frame about the beacon, counter-clockwise from the approach
            axis, in (-π, π].
        sigma_rad: its standard deviation.
        bearing: direction to the beacon in the camera frame at that time, with the range where it is known.
        turns: beacon turns that the fix rests on.
    """

    time_s: float
    azimuth_rad: float
    sigma_rad: float
    bearing: Bearing
    turns: int = 1


class TrackView(NamedTuple):
    """One track as others may see it: for recordings and for authentication's audit.

    Attributes:
        track_id: unique within an episode.
        centre_px: (2,) filtered position.
        class_id: `BLUE` or `RED`.
        beacon_id: index into the array beacons once authenticated, else None.
        missed: consecutive frames without a detection.
    """

    track_id: int
    centre_px: Array
    class_id: int
    beacon_id: int | None
    missed: int


@dataclass(frozen=True, eq=False)
class Percept:
    """What perception makes of one frame.

    Attributes:
        time_s: time of the frame.
        pose: pose from the array beacons, None while there is none; check `pose.measured`.
        long_range: bearing of the far light or of the group of blue lights seen as one, None if none is seen.
        entrance: bearing of the red entrance lamps' centre, None if none is seen.
        array_count: authenticated array beacons in this frame.
        detections: the frame's detections.
        tracks: the tracks alive after this frame.
        azimuth: a new azimuth from the rotating beacon, None in frames without one.
    """

    time_s: float
    pose: PoseEstimate | None
    long_range: Bearing | None
    entrance: Bearing | None
    array_count: int
    detections: Detections
    tracks: Sequence[TrackView] = ()
    azimuth: AzimuthFix | None = None


@dataclass(frozen=True, eq=False)
class Proprioception:
    """The vehicle's own sensors, with their noise: what a real vehicle knows without looking.

    Attributes:
        time_s: time of the sample.
        depth_m: pressure depth, positive down.
        euler_zyx_rad: (3,) roll, pitch, yaw of the body (x forward, y left, z up) in the world: inclinometer and
            compass. A positive pitch is nose down, a positive yaw is to port.
        angular_velocity_rad_s: (3,) p, q, r in the body frame: gyroscopes.
        velocity_ground_m_s: (3,) velocity over ground in the body frame: DVL bottom lock, or what the log makes of the
            last one (`sim.dvl`).
        velocity_water_m_s: (3,) velocity through the water in the body frame: DVL water track, or the last one.
        contact: True while the touch switch is pressed: the bow's, in landing the underside's.
        latched: True once the station has reported over its short link that the latch closed.
        ground_age_s: time since the last bottom lock.
        water_age_s: time since the last water track.
    """

    time_s: float
    depth_m: float
    euler_zyx_rad: Array
    angular_velocity_rad_s: Array
    velocity_ground_m_s: Array
    velocity_water_m_s: Array
    contact: bool = False
    latched: bool = False
    ground_age_s: float = 0.0
    water_age_s: float = 0.0

    def __post_init__(self) -> None:
        """Check shapes."""
        shapes = self.euler_zyx_rad.shape, self.angular_velocity_rad_s.shape
        shapes += self.velocity_ground_m_s.shape, self.velocity_water_m_s.shape
        if shapes == _FOUR_VECTORS:
            return  # the common case, at a third of the cost
        for name in ("euler_zyx_rad", "angular_velocity_rad_s", "velocity_ground_m_s", "velocity_water_m_s"):
            check_shape(name, getattr(self, name), (3,))


@dataclass(frozen=True, eq=False)
class Sensed:
    """What the vehicle can know at one moment.

    Attributes:
        proprioception: its own sensors.
        frame: a new camera frame, None between frames or where `detections` stands in for it.
        detections: in the `beacons` fidelity, the detections of a new frame, else None.
        tags: in the `beacons` fidelity of a landing, the tags seen in that frame.
    """

    proprioception: Proprioception
    frame: Frame | None = None
    detections: Detections | None = None
    tags: tuple[TagDetection, ...] = ()


@dataclass(frozen=True, eq=False)
class Command:
    """Actuator commands.

    Attributes:
        values: (n,) in [-1, 1], in the order of the vehicle's actuators.
        mode: the guidance mode that gave it, for the log.
        setpoint: named set-points behind it (surge_m_s, heading_rad, ...), for the log.
        giving_up: True if the pilot has abandoned the docking for good.
    """

    values: Array
    mode: str = ""
    setpoint: dict[str, float] = field(default_factory=dict)
    giving_up: bool = False
