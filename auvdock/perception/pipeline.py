"""Perception as a whole: detections in, percept out."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.contracts import Detections, Percept, Proprioception
from auvdock.core.errors import ConfigError
from auvdock.perception.association import Association
from auvdock.perception.authentication import AuthenticationCfg
from auvdock.perception.hungarian_ransac import HungarianRansacAssociation, HungarianRansacCfg
from auvdock.perception.line_of_sight import LineOfSight, LineOfSightCfg
from auvdock.perception.pnp import PnpCfg
from auvdock.perception.prior import AttitudePrior
from auvdock.perception.spatiotemporal import SpatiotemporalAssociation
from auvdock.perception.tracker import LightTracker, TrackerCfg

__all__ = ["ASSOCIATIONS", "BeaconPerception", "PerceptionCfg"]

ASSOCIATIONS = ("spatiotemporal", "hungarian_ransac")
"""Ways to tell which light is which beacon."""


@dataclass(frozen=True)
class PerceptionCfg:
    """How the vehicle sees."""

    detector: str = "threshold"
    """"threshold", "blob" or a detector of your own as "package.module:Name"."""
    association: str = "spatiotemporal"
    """"spatiotemporal" (paper A's method) or "hungarian_ransac" (its comparison)."""
    station_yaw_deg: float = 0.0
    """Heading of the station's approach axis in the world, as surveyed."""
    tracker: TrackerCfg = TrackerCfg()
    """Kalman tracking."""
    authentication: AuthenticationCfg = AuthenticationCfg()
    """Spatiotemporal authentication."""
    pnp: PnpCfg = PnpCfg()
    """Pose from beacons."""
    hungarian_ransac: HungarianRansacCfg = HungarianRansacCfg()
    """The comparison's settings."""
    line_of_sight: LineOfSightCfg = LineOfSightCfg()
    """Bearings without a pose."""

    def __post_init__(self) -> None:
        """Check the association's name; the detector's is checked when it is made."""
        if self.association not in ASSOCIATIONS:
            raise ConfigError("perception.association", self.association, f"one of {', '.join(ASSOCIATIONS)}")
        if self.authentication.min_occurrences > self.tracker.window_frames:
            raise ConfigError(
                "perception.authentication.min_occurrences",
                self.authentication.min_occurrences,
                f"at most tracker.window_frames ({self.tracker.window_frames})",
            )


class BeaconPerception:
    """Tracks, identities, pose and bearings of one station's lights in one camera."""

    def __init__(self, cfg: PerceptionCfg, camera: Camera, layout: BeaconLayout) -> None:
        """Build the parts for one camera and one station."""
        self._tracks = LightTracker(cfg.tracker, camera.rate_hz, camera.width_px, camera.height_px)
        self._prior = AttitudePrior(camera, math.radians(cfg.station_yaw_deg))
        sigma = cfg.tracker.pixel_sigma_px
        self._association: Association
        if cfg.association == "spatiotemporal":
            self._association = SpatiotemporalAssociation(cfg.authentication, cfg.pnp, sigma, camera, layout)
        else:
            self._association = HungarianRansacAssociation(cfg.hungarian_ransac, cfg.pnp, sigma, camera, layout)
        self._line_of_sight = LineOfSight(cfg.line_of_sight, camera, layout)

    def reset(self) -> None:
        """Forget everything; call at the start of an episode."""
        self._tracks.reset()
        self._association.reset()
        self._line_of_sight.reset()

    def update(self, detections: Detections, proprioception: Proprioception) -> Percept:
        """Process one frame's detections with the vehicle's own sensors of the same instant."""
        tracks = self._tracks
        tracks.update(detections)
        associated = self._association.update(tracks, detections, self._prior.rotation(proprioception))
        long_range, entrance = self._line_of_sight.update(tracks, associated.solution)
        return Percept(
            time_s=proprioception.time_s,
            pose=associated.pose,
            long_range=long_range,
            entrance=entrance,
            array_count=associated.array_count,
            detections=detections,
            tracks=tracks.views(),
        )
