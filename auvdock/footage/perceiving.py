"""The perception of episodes put to footage: no simulator, no DVL, and of the attitude what the user tells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections, Frame, Percept, Proprioception, Sensed
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.limits import Positive
from auvdock.core.station import ConicalStationCfg
from auvdock.core.stations import StationCfg
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.estimation.perceiver import BeaconPerceiver, LandingPerceiver, Perceiver
from auvdock.footage.attitude import AttitudeLog, Pose, sensed_attitude
from auvdock.footage.rows import FootageRow
from auvdock.footage.sources import Shot
from auvdock.perception.authentication import AuthenticationCfg
from auvdock.perception.credibility import CredibilityCfg
from auvdock.perception.detectors import make_detector
from auvdock.perception.landing.config import AttitudeCfg, FilterCfg, LandingPerceptionCfg, LightLevelCfg, TagLevelCfg
from auvdock.perception.landing.tag_detectors import make_tag_detector
from auvdock.perception.landing.tag_families import TagFamily
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg
from auvdock.perception.pnp import PnpCfg
from auvdock.perception.tracker import TrackerCfg

__all__ = ["FootageCfg", "FootagePerceiver", "Seen"]

_OF_A_RING = "halos"
_STRAYS_N = 1.0
"""Spurious lights a frame that `halos` stays well below on real footage (docs/real_frames.md)."""
_TRACKER = TrackerCfg(pixel_sigma_px=0.7)
"""σ of a light of a real lamp in a real lens: interlace, compression, calibration (docs/real_frames.md)."""
_RANGE_SIGMA = 0.2
"""A pose is given up to twice the uncertainty that a pilot accepts: the row tells it, and nothing is steered."""
_SPEED_M_S = 2.0
"""Without a DVL the vehicle may have gone this fast between two poses, any way."""
_TURN_RAD_S = 0.5
"""And turned so fast."""
_ANY_HEADING_DEG = 90.0


@dataclass(frozen=True)
class FootageCfg(Checked):
    """How footage is looked at."""

    detector: str | None = None
    """Of lights: the package's own or "package.module:Name"; None for the station's."""
    tag_family: TagFamily = "36h11"
    """Family of the landing station's tag."""
    tag_clahe: bool = False
    """Equalise contrast before tags are looked for."""
    attitude_sigma_deg: Positive = 10.0
    """Standard deviation of roll and pitch as told, or of an upright vehicle's."""
    station_heading_deg: float | None = None
    """Heading, clockwise from north, in which the station faces: from its mouth to the vehicle, or to a platform's
    head. None where nobody knows it."""


class Seen(NamedTuple):
    """One frame and what was made of it.

    Attributes:
        shot: the frame.
        own: what the vehicle was taken to know of itself.
        percept: all that perception says.
        row: that in short.
    """

    shot: Shot
    own: Proprioception
    percept: Percept
    row: FootageRow


class FootagePerceiver:
    """Perceives frames one after the other."""

    def __init__(self, cfg: FootageCfg, station: StationCfg, camera: Camera, log: AttitudeLog | None = None) -> None:
        """Put detectors and perception together for one station and one camera.

        Args:
            cfg: settings.
            station: with its lights.
            camera: that took the footage.
            log: the vehicle's attitude; None to take it as upright.

        Raises:
            ConfigError: a name that does not exist or a value that does not fit.
        """
        self._cfg, self._camera, self._log = cfg, camera, log
        self._own = Pose()
        self._count = 0
        knows_heading = cfg.station_heading_deg is not None and log is not None and log.has_heading
        if isinstance(station, LandingStationCfg):
            knows_depth = log is not None and log.has_depth
            self._perceiver, self.detector = _of_landing(cfg, station, camera, knows_heading, knows_depth)
        else:
            self._perceiver, self.detector = _of_lights(cfg, station, camera, knows_heading)

    def skip(self) -> None:
        """Let a frame's time pass of which nothing can be seen."""
        own = self._sense(None)
        self._perceiver.perceive(Sensed(own, detections=Detections.empty()))

    def perceive(self, shot: Shot) -> Seen:
        """Perceive the next frame, which must have an image of the camera's size."""
        if shot.image is None:
            raise ValueError("a frame without an image is to be skipped")
        own = self._sense(shot)
        percept = self._perceiver.perceive(Sensed(own, Frame(shot.image, own.time_s, self._camera)))
        if percept is None:
            raise RuntimeError("a frame gave no percept")
        return Seen(shot, own, percept, _row(shot.frame, percept))

    def _sense(self, shot: Shot | None) -> Proprioception:
        time_s = self._count / self._camera.rate_hz
        if shot is not None and shot.time_s is not None:
            time_s = shot.time_s
        self._count += 1
        if self._log is not None and shot is not None:
            self._own = self._log.after(self._own, shot.frame)
        return sensed_attitude(self._own, time_s, self._cfg.station_heading_deg or 0.0)


def _of_lights(
    cfg: FootageCfg, station: ConicalStationCfg, camera: Camera, knows_heading: bool
) -> tuple[Perceiver, str]:
    """What perceives a ring of lights, and the detector's name."""
    sigma = cfg.attitude_sigma_deg
    name = cfg.detector or _OF_A_RING
    is_clean = name == _OF_A_RING
    perception = PerceptionCfg(
        detector=name,
        tracker=_TRACKER,
        authentication=AuthenticationCfg(
            pairs="every", min_occurrences=1 if is_clean else AuthenticationCfg.min_occurrences
        ),
        pnp=PnpCfg(attitude_sigma_deg=max(sigma, PnpCfg.attitude_sigma_deg), attitude_prior_sigma_deg=sigma),
        credibility=CredibilityCfg(
            max_range_sigma=_RANGE_SIGMA,
            speed_error_m_s=_SPEED_M_S,
            strays_n=_STRAYS_N if is_clean else None,
        ),
    )
    lights = BeaconPerception(perception, camera, station.layout, heading_surveyed=knows_heading)
    return BeaconPerceiver(make_detector(name), lights), name


def _of_landing(
    cfg: FootageCfg, station: LandingStationCfg, camera: Camera, knows_heading: bool, knows_depth: bool
) -> tuple[Perceiver, str]:
    """What perceives a platform, and the name of the lights' detector."""
    heading = max(cfg.attitude_sigma_deg, AttitudeCfg.heading_deg) if knows_heading else _ANY_HEADING_DEG
    lights = LightLevelCfg() if knows_depth else LightLevelCfg(max_height_error_m=0.0)
    name = cfg.detector or LandingPerceptionCfg.detector
    perception = LandingPerceptionCfg(
        detector=name,
        attitude=AttitudeCfg(tilt_noise_deg=cfg.attitude_sigma_deg, heading_deg=heading),
        lights=lights,
        tag=TagLevelCfg(family=cfg.tag_family, clahe=cfg.tag_clahe),
        filter=FilterCfg(velocity_noise_m_s=_SPEED_M_S, gyro_noise_rad_s=_TURN_RAD_S),
    )
    tags = make_tag_detector(perception.tag_detector, (station.tag.tag_id,), cfg.tag_family, cfg.tag_clahe)
    return LandingPerceiver(make_detector(name), tags, LandingEstimator(perception, camera, station)), name


def _row(frame: str | int, percept: Percept) -> FootageRow:
    pose = percept.pose
    tags = percept.tags if isinstance(percept, LandingPercept) else ()
    return FootageRow(
        frame=frame,
        lights=percept.detections.centre_px.tolist(),
        beacon_ids=_names(percept),
        pose=None if pose is None else pose.T_station_camera.tolist(),
        measured=pose is not None and pose.measured,
        reprojection_error_px=None if pose is None else pose.reprojection_error_px,
        position_sigma_m=None if pose is None else math.sqrt(np.linalg.eigvalsh(pose.covariance[:3, :3])[-1]),
        tag_ids=[tag.tag_id for tag in tags],
        tag_corners=[tag.corners_px.tolist() for tag in tags],
    )


def _names(percept: Percept) -> list[int | None]:
    """The beacon of each detection: that of the track which was seen in this frame and lies nearest to it."""
    names: list[int | None] = [None] * len(percept.detections)
    for track in percept.tracks:
        if track.beacon_id is not None and track.missed == 0 and names:
            gap = np.linalg.norm(percept.detections.centre_px - track.centre_px, axis=1)
            names[int(gap.argmin())] = track.beacon_id
    return names
