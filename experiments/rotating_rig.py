"""Paper B's pool: a rotating beacon at one end, a camera on a gantry that looks along it (section 5.1, figure 11).

The paper's X runs along the gantry, across the pool, its Y along the pool from the beacon to the camera. Beacon and
camera are 3 m deep; camera 1920 x 1080, 30 Hz, 85° x 50°; water c = 0.40 1/m ("pool"). Here the beacon is the origin of
the station frame, whose x is the paper's Y and whose y is the paper's X.

Day is the level "mild" of the daylight nuisance: 0.3 W/m² per band below the surface, a three-hundredth of full sun.
The pool is deep and, by its gantry, indoors; the paper gives no light level, so this one is ours.

Two more things that the paper does not say decide how far the flash is seen. Its network sees all of a halo, where the
threshold detector takes for background what is broader than its window: `network_stand_in` has a window that holds the
halos of 50 m. And how sensitive the camera is: `MAX_GAIN`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.contracts import Detections, Detector, Frame, RegionOfInterest
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import make_transform
from auvdock.optics.imaging import ImagingCfg, Shot, UnderwaterCamera
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.settings import ExposureCfg
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import WaterCfg, load_water
from auvdock.perception.threshold import ThresholdCfg, ThresholdDetector

__all__ = [
    "FLUX_DISC_RAD",
    "MAX_GAIN",
    "NETWORK_PX",
    "RIG",
    "X_M",
    "Y_M",
    "PoolRig",
    "ShrunkDetector",
    "Visibility",
    "flash_visibility",
    "network_stand_in",
    "share_of_turns",
]

X_M = (4.5, 1.5, -1.5, -4.5)
"""Paper B, table 5: positions along the gantry."""
Y_M = (20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
"""Paper B, table 5: distances along the pool."""
DEPTH_M = 3.0
MAX_GAIN = 1.64
"""Greatest gain of the rig's camera at its longest exposure, 16 ms: calibrated on the night rows of paper B's table 5.

With 1.60 to 1.67 the flash is found at Y = 50 m, X = ±1.5 m in more than half of the turns and at X = ±4.5 m in fewer:
the four places differ by 5 % of light. A fifth less and no line reaches 50 m, a fifth more and all do."""
NETWORK_PX = 640
FLUX_DISC_RAD = 0.025
"""Radius of the disc in which the stand-in measures flux: no other lamp is near, and halos are broad. Of 12, 25 and 50
mrad, tried on the first video of each place."""
_HALO_PX = 120
_LEAST_PX = 20
RIG = (MAX_GAIN, _HALO_PX, _LEAST_PX, FLUX_DISC_RAD)
"""What a kept result depends on beside its place: videos of another rig are not taken for this one's."""
_NEAR_RAD = 0.06


class PoolRig:
    """A camera that stands still before a rotating beacon, with no other light in the water."""

    def __init__(
        self,
        day: bool,
        *,
        camera: CameraCfg | None = None,
        beacon: RotatingBeaconCfg | None = None,
        water: WaterCfg | None = None,
        nuisance: NuisanceCfg | None = None,
        lamps: tuple[BeaconCfg, ...] = (),
    ) -> None:
        """Set the rig up.

        Args:
            day: daylight "mild", else none.
            camera: by default the paper's.
            beacon: by default the paper's, in the origin.
            water: by default the paper's.
            nuisance: further nuisances; its daylight is replaced.
            lamps: steady lamps beside the beacon.
        """
        self.beacon = beacon if beacon is not None else RotatingBeaconCfg(position_m=(0.0, 0.0, 0.0))
        self.camera_cfg = camera if camera is not None else CameraCfg(width_px=1920, height_px=1080)
        self.layout = _no_array(lamps)
        level = "mild" if day else "none"
        parts = nuisance if nuisance is not None else NuisanceCfg()
        self.camera: Camera = make_camera(
            self.camera_cfg, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
        )
        self.imager = UnderwaterCamera(
            OpticalSetup(
                self.camera,
                water if water is not None else load_water("pool"),
                self.layout,
                make_transform(np.eye(3), np.array([0.0, 0.0, -DEPTH_M])),
                ImagingCfg(surfaces=False, exposure=ExposureCfg(max_gain=MAX_GAIN)),
                dataclasses.replace(parts, daylight=level),
                self.beacon,
            )
        )

    def azimuth_rad(self, x_m: float, y_m: float) -> float:
        """Azimuth of the camera from the beacon."""
        return math.atan2(x_m, y_m)

    def pose(self, x_m: float, y_m: float) -> Array:
        """(4, 4) pose of the camera's body in the world: it looks along the pool, not at the beacon."""
        return make_transform(np.diag([-1.0, -1.0, 1.0]), np.array([y_m, x_m, -DEPTH_M]))

    def facing_s(self, x_m: float, y_m: float) -> float:
        """A time at which the beam points at the camera."""
        turn = (self.azimuth_rad(x_m, y_m) - math.radians(self.beacon.initial_azimuth_deg)) / math.tau
        return turn / self.beacon.rate_rev_s

    def video(
        self, x_m: float, y_m: float, turns: float, rng: np.random.Generator, start_s: float = 0.0
    ) -> Iterator[Shot]:
        """Frames at the camera's rate over some turns of the beacon, exposure settled on its flash."""
        count = round(turns * self.camera_cfg.rate_hz / self.beacon.rate_rev_s)
        times = (start_s + k / self.camera_cfg.rate_hz for k in range(count))
        return self.shots(x_m, y_m, times, rng)

    def shots(self, x_m: float, y_m: float, times_s: Iterable[float], rng: np.random.Generator) -> Iterator[Shot]:
        """Frames at given times, exposure settled on the flash before the first."""
        self.imager.reset(rng)
        pose = self.pose(x_m, y_m)
        self.imager.take(pose, self.facing_s(x_m, y_m))
        for time_s in times_s:
            yield self.imager.take(pose, time_s)

    def beacon_px(self, x_m: float, y_m: float) -> Array:
        """(2,) where the beacon is on the sensor."""
        return self.camera.project(np.array([[-x_m, 0.0, y_m]]))[0]


class ShrunkDetector:
    """A detector that looks at frames shrunk to a width, as networks do (paper B, section 3.3.1: 640 pixels).

    Boxes and centres come back in the pixels of the whole frame.
    """

    def __init__(self, detector: Detector, camera: CameraCfg, width_px: int = NETWORK_PX) -> None:
        """Take the detector and the size that it is to see."""
        self._detector = detector
        self._factor = camera.width_px / width_px
        height_px = round(camera.height_px / self._factor)
        small = CameraCfg(width_px, height_px, camera.rate_hz, camera.horizontal_fov_deg, camera.vertical_fov_deg)
        self._camera = make_camera(small, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame; regions are not looked at."""
        size = (self._camera.width_px, self._camera.height_px)
        image = np.asarray(cv2.resize(frame.image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        shrunk = Frame(image, frame.time_s, self._camera, frame.exposure_s, frame.gain, frame.response)
        found = self._detector.detect(shrunk)
        factor = self._factor
        # Pixel centres are whole numbers: the frame's left edge lies at -1/2 in both.
        return Detections(
            (found.xyxy + 0.5) * factor - 0.5,
            (found.centre_px + 0.5) * factor - 0.5,
            found.score,
            found.class_id,
            found.flux,
        )


def network_stand_in(camera: CameraCfg) -> ShrunkDetector:
    """What stands in for the paper's network here: the threshold detector on frames shrunk to 640 pixels.

    What is broader than 120 of them (16°) is background; by default that is 40, less than the halo at 50 m.
    """
    cfg = ThresholdCfg(min_area_px=_LEAST_PX, background_px=_HALO_PX, flux=True, flux_disc_rad=FLUX_DISC_RAD)
    return ShrunkDetector(ThresholdDetector(cfg), camera)


@dataclass(frozen=True)
class Visibility:
    """Over how much of a turn the flash is seen from one place.

    Attributes:
        x_m: along the gantry.
        y_m: along the pool.
        day: daylight or night.
        arc_deg: turn of the beacon over which it is detected, summed over the turn.
        facing_share: share of frames in which it is detected with the beam within 3° of the camera.
        frames_a_turn: arc over the angle between two frames.
    """

    x_m: float
    y_m: float
    day: bool
    arc_deg: float
    facing_share: float
    frames_a_turn: float


def flash_visibility(
    rig: PoolRig,
    detector: Detector,
    x_m: float,
    y_m: float,
    day: bool,
    seed: int = 0,
    step_deg: float = 1.5,
    reach_deg: float = 60.0,
) -> Visibility:
    """Measure over which arc a detector finds the flash: a detection within 60 mrad of the beacon, size below 0.25 rad.

    Args:
        rig: the pool.
        detector: finds lights.
        x_m: along the gantry.
        y_m: along the pool.
        day: what the rig was set up for.
        seed: of the noise.
        step_deg: between the beam's directions that are tried.
        reach_deg: greatest angle between beam and camera.
    """
    offsets = np.arange(-reach_deg, reach_deg + 0.5 * step_deg, step_deg)
    order = np.argsort(np.abs(offsets), kind="stable")
    facing_s, rate = rig.facing_s(x_m, y_m), rig.beacon.rate_rev_s
    times = (facing_s + float(offsets[k]) / 360.0 / rate for k in order)
    seen = np.zeros(len(offsets), dtype=np.bool_)
    for k, shot in zip(order, rig.shots(x_m, y_m, times, np.random.default_rng(seed)), strict=True):
        seen[k] = _found(rig, detector.detect(shot.frame), x_m, y_m)
    facing = np.abs(offsets) <= 3.0
    arc = float(np.count_nonzero(seen)) * step_deg
    frame_deg = 360.0 * rate / rig.camera_cfg.rate_hz
    return Visibility(x_m, y_m, day, arc, float(seen[facing].mean()), arc / frame_deg)


def share_of_turns(rig: PoolRig, detector: Detector, x_m: float, y_m: float, turns: int = 24, seed: int = 0) -> float:
    """Share of turns in which a detector finds the flash in at least one frame.

    Frames and beam are not in step: over the turns, the beam's nearest frame falls on directions that are spread evenly
    over the angle between two frames. The frames with the beam within one and a half such angles are looked at.

    Args:
        rig: the pool.
        detector: finds lights.
        x_m: along the gantry.
        y_m: along the pool.
        turns: so many.
        seed: of the noise.
    """
    phases = (np.arange(turns) + 0.5) / turns - 0.5
    times = rig.facing_s(x_m, y_m) + (phases[:, None] + np.array([-1.0, 0.0, 1.0])) / rig.camera_cfg.rate_hz
    shots = rig.shots(x_m, y_m, times.ravel().tolist(), np.random.default_rng(seed))
    seen = np.array([_found(rig, detector.detect(shot.frame), x_m, y_m) for shot in shots])
    return float(seen.reshape(turns, -1).any(axis=1).mean())


def _found(rig: PoolRig, found: Detections, x_m: float, y_m: float) -> bool:
    """Whether one of the detections is the beacon: within 60 mrad of it, and no larger than a quarter of a radian."""
    near_px = _NEAR_RAD * float(rig.camera.matrix[0, 0])
    size = found.xyxy[:, 2:] - found.xyxy[:, :2]
    close = np.linalg.norm(found.centre_px - rig.beacon_px(x_m, y_m), axis=1) < near_px
    return bool(np.any(close & (size.max(axis=1, initial=0.0) < 4.0 * near_px)))


def _no_array(lamps: tuple[BeaconCfg, ...]) -> BeaconLayout:
    """A layout must have an array: four lamps of a nanowatt, a kilometre away."""
    return BeaconLayout(
        lamps
        + tuple(
            BeaconCfg(f"B{k}", "array", (900.0, float(k), 0.0), (1.0, 0.0, 0.0), 450.0, 1e-9, 0.35, 45.0)
            for k in range(4)
        )
    )
