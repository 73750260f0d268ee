"""What every association of lights with beacons has in common."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from auvdock.core.arrays import Array
from auvdock.core.contracts import Detections, PoseEstimate
from auvdock.perception.pnp import PnpSolution
from auvdock.perception.tracker import LightTracker

__all__ = ["Associated", "Association", "pose_estimate"]


class Associated(NamedTuple):
    """Outcome of one frame.

    Attributes:
        pose: the pose, None while there is none.
        array_count: beacons identified among this frame's detections.
        solution: the solution behind a pose, None for a held one.
    """

    pose: PoseEstimate | None = None
    array_count: int = 0
    solution: PnpSolution | None = None


class Association(Protocol):
    """Names the beacons among the lights and solves the pose."""

    def reset(self) -> None:
        """Forget everything."""
        ...

    def update(
        self,
        tracks: LightTracker,
        detections: Detections,
        rotation_prior: Array,
        velocity_m_s: Array,
        heading_sigma_rad: float | None = None,
    ) -> Associated:
        """Process one frame; writes `tracks.beacon_id`.

        Args:
            tracks: the lights, updated with this frame.
            detections: the frame's.
            rotation_prior: (3, 3) R_camera_station of the vehicle's own attitude.
            velocity_m_s: (3,) velocity over ground in the camera frame, as the vehicle's DVL measures it.
            heading_sigma_rad: standard deviation of the station's heading in it, None where it was surveyed.
        """
        ...


def pose_estimate(solution: PnpSolution, beacon_ids: tuple[int, ...], measured: bool) -> PoseEstimate:
    """The contract's form of a solution; it shares no memory with it, for others keep it."""
    return PoseEstimate(
        T_station_camera=solution.T_station_camera().copy(),
        covariance=solution.covariance().copy(),
        beacon_ids=beacon_ids,
        solver=solution.solver,
        reprojection_error_px=solution.error_px,
        measured=measured,
    )
