"""What every association of lights with beacons has in common."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from auvdock.core.arrays import Array
from auvdock.core.contracts import Detections, PoseEstimate
from auvdock.perception.pnp import Attitude, PnpSolution
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
        attitude: Attitude,
        velocity_m_s: Array,
    ) -> Associated:
        """Process one frame; writes `tracks.beacon_id`.

        Args:
            tracks: the lights, updated with this frame.
            detections: the frame's.
            attitude: the vehicle's own.
            velocity_m_s: (3,) velocity over ground in the camera frame, as the vehicle's DVL measures it.
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
