"""Perception as a whole: detections in, percept out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections, Percept, Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.perception.algorithm_1 import Algorithm1Association, Algorithm1Cfg
from auvdock.perception.association import Association
from auvdock.perception.authentication import AuthenticationCfg
from auvdock.perception.credibility import CredibilityCfg
from auvdock.perception.hungarian_ransac import HungarianRansacAssociation, HungarianRansacCfg
from auvdock.perception.line_of_sight import LineOfSight, LineOfSightCfg
from auvdock.perception.pnp import Attitude, PnpCfg
from auvdock.perception.prior import AttitudePrior, FacingHeading
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.forward_beacon import ForwardBeacon
from auvdock.perception.spatiotemporal import SpatiotemporalAssociation
from auvdock.perception.tracker import LightTracker, TrackerCfg

__all__ = ["ASSOCIATIONS", "AssociationName", "BeaconPerception", "PerceptionCfg"]

_LEAST_SIGMA_RAD = math.radians(1.0)
"""What compass and clock leave of the station's heading at best (ours)."""
AssociationName = Literal["spatiotemporal", "hungarian_ransac", "algorithm_1"]
"""Ways to tell which light is which beacon."""
ASSOCIATIONS: tuple[AssociationName, ...] = get_args(AssociationName)


@dataclass(frozen=True)
class PerceptionCfg(Checked):
    """How the vehicle sees."""

    detector: str = "threshold"
    """"threshold", "blob", a network ("paper_a_light", "mine.onnx") or one of your own as "package.module:Name"."""
    association: AssociationName = "spatiotemporal"
    """"spatiotemporal" (ours, built on paper A's), "algorithm_1" (paper A's as printed) or "hungarian_ransac" (its
    comparison)."""
    station_yaw_deg: float = 0.0
    """Heading of the station's approach axis in the world, as surveyed."""
    tracker: TrackerCfg = TrackerCfg()
    """Kalman tracking."""
    authentication: AuthenticationCfg = AuthenticationCfg()
    """Spatiotemporal authentication."""
    pnp: PnpCfg = PnpCfg()
    """Pose from beacons."""
    credibility: CredibilityCfg = CredibilityCfg()
    """When a pose is believed."""
    hungarian_ransac: HungarianRansacCfg = HungarianRansacCfg()
    """The comparison's settings."""
    algorithm_1: Algorithm1Cfg = Algorithm1Cfg()
    """What paper A's association as printed has of its own."""
    line_of_sight: LineOfSightCfg = LineOfSightCfg()
    """Bearings without a pose."""
    rotating: ForwardBeaconCfg = ForwardBeaconCfg()
    """The rotating beacon, where the station has one."""

    def __post_init__(self) -> None:
        """Refuse a light that no history is long enough to confirm."""
        if self.authentication.min_occurrences > self.tracker.window_frames:
            raise ConfigError(
                "authentication.min_occurrences",
                self.authentication.min_occurrences,
                f"at most tracker.window_frames ({self.tracker.window_frames})",
            )


class BeaconPerception:
    """Tracks, identities, pose and bearings of one station's lights in one camera.

    Detections of the rotating beacon, once it is known, are kept from the tracks: it is blue and bright and would be
    taken for a lamp of the array, or for the far one.
    """

    def __init__(
        self,
        cfg: PerceptionCfg,
        camera: Camera,
        layout: BeaconLayout,
        rotating: RotatingBeaconCfg | None = None,
        heading_surveyed: bool = True,
    ) -> None:
        """Build the parts for one camera and one station.

        Args:
            cfg: settings.
            camera: the camera.
            layout: the station's fixed lights.
            rotating: its rotating beacon, if it has one.
            heading_surveyed: the station's heading by the vehicle's compass is `cfg.station_yaw_deg`; else it comes
                from the rotating beacon, and before that from the lamps themselves, which shine to the front only.
        """
        self._forward = ForwardBeacon(cfg.rotating, camera, rotating) if rotating is not None else None
        self._surveyed = heading_surveyed
        self._facing = FacingHeading(camera)
        self._camera_body = np.ascontiguousarray(camera.T_body_camera[:3, :3].T)
        self._tracks = LightTracker(cfg.tracker, camera.rate_hz, camera.width_px, camera.height_px)
        self._prior = AttitudePrior(camera, math.radians(cfg.station_yaw_deg))
        sigma = cfg.tracker.pixel_sigma_px
        self._association: Association
        if cfg.association == "spatiotemporal":
            self._association = SpatiotemporalAssociation(
                cfg.authentication, cfg.pnp, cfg.credibility, sigma, camera, layout
            )
        elif cfg.association == "algorithm_1":
            self._association = Algorithm1Association(
                cfg.algorithm_1, cfg.authentication, cfg.pnp, sigma, camera, layout
            )
        else:
            self._association = HungarianRansacAssociation(
                cfg.hungarian_ransac, cfg.pnp, cfg.credibility, sigma, camera, layout
            )
        self._line_of_sight = LineOfSight(cfg.line_of_sight, camera, layout)

    @property
    def tracks(self) -> LightTracker:
        """The lights that are followed, with the identities that the association gave them."""
        return self._tracks

    def reset(self) -> None:
        """Forget everything; call at the start of an episode."""
        self._tracks.reset()
        self._association.reset()
        self._line_of_sight.reset()
        self._facing.reset()
        if self._forward is not None:
            self._forward.reset()

    def update(self, detections: Detections, proprioception: Proprioception) -> Percept:
        """Process one frame's detections with the vehicle's own sensors of the same instant."""
        tracks = self._tracks
        azimuth, fixed = None, detections
        if self._forward is not None:
            azimuth = self._forward.update(detections, proprioception)
            if self._forward.mask.any():
                fixed = detections.select(~self._forward.mask)
        tracks.update(fixed)
        velocity = self._camera_body.dot(proprioception.velocity_ground_m_s)
        heading, sigma = (None, None) if self._surveyed else self._heading(proprioception)
        attitude = Attitude(self._prior.rotation(proprioception, heading), sigma)
        associated = self._association.update(tracks, fixed, attitude, velocity)
        long_range, entrance = self._line_of_sight.update(tracks, associated.solution)
        self._facing.note(long_range)
        return Percept(
            time_s=proprioception.time_s,
            pose=associated.pose,
            long_range=long_range,
            entrance=entrance,
            array_count=associated.array_count,
            detections=detections,
            tracks=tracks.views(),
            azimuth=azimuth,
        )

    def _heading(self, proprioception: Proprioception) -> tuple[float, float]:
        """Heading of the station's approach axis by the vehicle's compass and its standard deviation, both in rad."""
        estimate = self._forward.estimate if self._forward is not None else None
        if estimate is None:
            return self._facing.heading(proprioception)
        return estimate.axis_yaw_rad, max(estimate.sigma_axis_rad, _LEAST_SIGMA_RAD)
