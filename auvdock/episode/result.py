"""What an episode leaves behind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from auvdock.core.strict import to_plain

__all__ = ["FAILURE_REASONS", "LOST_REASONS", "EpisodeResult", "stage_of"]

FAILURE_REASONS = (
    "search",
    "approach",
    "circle",
    "lineup",
    "far",
    "mid",
    "near",
    "terminal",
    "collision",
    "surfaced",
    "carried_off",
    "timeout",
    "diverged",
    "interrupted",
    "hung",
    "crashed",
)
"""Why an episode failed: the guidance stage in which the pilot gave up or time ran out, or what ended it.

`search` to `terminal`: the pilot gave up, or time ran out, in that stage. `collision`: a contact harder than the
vehicle's structure bears. `surfaced`: some of the hull was out of the water for some seconds in all
(`LimitsCfg.surfaced_s`). `carried_off`: it got much further from the station than it had started
(`LimitsCfg.carried_off_m`). `timeout`: time ran out while backing off for another attempt. `diverged`: the simulation's
state became absurd. `interrupted`: the user stopped it. In campaigns only, and without a result, so that they count in
no rate (`LOST_REASONS`), `hung`: it took longer than its wall-clock limit; `crashed`: it raised an exception or took
its worker down.
"""


LOST_REASONS = ("hung", "crashed")
"""Those that say nothing of the method: the episode left no result."""


def stage_of(mode: str, names: Mapping[str, str]) -> str:
    """The failure reason of an episode that ends in a pilot's mode; modes that only the pilot knows are a `timeout`.

    Args:
        mode: the pilot's mode.
        names: failure reasons of modes that have another name.
    """
    reason = names.get(mode, mode)
    return reason if reason in FAILURE_REASONS else "timeout"


@dataclass(frozen=True, kw_only=True)
class EpisodeResult:
    """Outcome and metrics of one episode; NaN never appears, None stands for "did not happen"."""

    success: bool
    """The latch has closed and held, within the entry limits (`auvdock.core.station.LatchCfg`); in landing, after a
    touchdown within those of `auvdock.core.landing_station.LandingLatchCfg`."""
    failure_reason: str | None
    """One of `FAILURE_REASONS`, None on success."""
    distortion_rate: float | None
    """invalid_frames / precise_frames (paper A, table 10): how often no pose was measured. None if precise guidance was
    never entered."""
    distortion_available: float | None
    """unavailable_frames / precise_frames: how often there was neither a measured nor a predicted pose to steer by."""
    precise_frames: int
    """Frames in precise guidance: from the entry until the array leaves the camera's view near by; in landing, until
    the latch closes. The entry is the first measured pose that is right and that others follow (docs/metrics.md)."""
    invalid_frames: int
    """Those of them without a pose measured in that frame."""
    unavailable_frames: int
    """Those of them without any pose, measured or predicted."""
    entry_distance_m: float | None
    """Distance of the nose from the mouth along the approach axis at the entry (paper A, table 9); in landing, of the
    seat from its place."""
    precise_range_m: float | None
    """From there to the last right pose before the first go-around: total range of precise guidance (paper A, table
    9)."""
    time_s: float
    path_length_m: float
    energy_j: float
    """Hydraulic work of the thrusters by actuator-disc theory (`auvdock.sim.stepping.hydraulic_power_w`)."""
    peak_contact_force_n: float
    electrical_j: float | None = None
    """Electrical work of the thrusters by their maker's measurements; None where there are none."""
    lateral_error_m: float | None = None
    """Sideways distance of the nose from the tube's axis as it crosses the throat; positive is +y of the station."""
    vertical_error_m: float | None = None
    heading_error_rad: float | None = None
    """Angle between hull and tube axis at the same moment."""
    entry_speed_m_s: float | None = None
    """Speed along the axis as the nose crosses the throat."""
    pose_error_median_m: float | None
    """Median distance between measured and true camera position in precise guidance."""
    measured_poses: int
    """Poses measured in this very frame, until the latch closes."""
    false_poses: int
    """Those of them whose camera position is off by more than 0.3 m and by more than 10 % of the range
    (`auvdock.metrics.false_poses`)."""
    false_pose_rate: float | None
    """false_poses / measured_poses; None if no pose was measured."""
    poses_by_solver: Mapping[str, int]
    """Measured poses by the name of what solved them; "tracked" is refined from the frame before."""
    attempts: int
    """Approaches begun; 1 means no go-around."""
    seed: int
    wall_s: float
    """Wall-clock time; `WALL_CLOCK_FIELDS` are the only ones that differ between two runs of one seed."""
    real_time_factor: float
    frame_ms_median: float | None
    """Wall-clock time that detector and perception took for a frame; None without frames."""
    frame_ms_p95: float | None
    """95th percentile of it."""
    versions: Mapping[str, str]
    """auvdock, mujoco, numpy, opencv and Python versions."""
    config: Mapping[str, Any]
    """The resolved configuration."""
    start_azimuth_rad: float | None = None
    """Rotating beacon: azimuth of the start about the beacon; beyond ±π/2 it lies behind the station."""
    start_range_m: float | None = None
    """Rotating beacon: distance of the start."""
    acquire_s: float | None = None
    """Rotating beacon: when the first azimuth or the first true pose came."""
    first_pose_s: float | None = None
    """Rotating beacon: when the first measured pose came that is not far off the truth."""
    azimuth_fixes: int | None = None
    """Rotating beacon: azimuths measured."""
    azimuth_rms_rad: float | None = None
    """Rotating beacon: their root mean square error."""
    handover_azimuth_error_rad: float | None = None
    """Rotating beacon: error of the believed azimuth when the array's or the far lamp's light took over."""
    touchdown_speed_m_s: float | None = None
    """Landing, with all down to `blind_share`: downward speed at the first contact with the station."""
    touchdown_force_n: float | None = None
    """Greatest force of the station on the vehicle from that contact until the latch closed."""
    final_position_error_m: float | None = None
    """Horizontal distance of the seat from its place as the latch closed, or at the end of the last descent."""
    max_position_error_m: float | None = None
    """The greatest such distance after alignment (`auvdock.metrics.landing`)."""
    final_heading_error_rad: float | None = None
    """Magnitude of the heading error ψ at the same moment as the final position error."""
    max_heading_error_rad: float | None = None
    """The greatest after alignment."""
    aligned_frames: int | None = None
    """Frames with a pose after alignment; the following figures are over them."""
    estimate_position_p95_m: float | None = None
    """95th percentile of the estimated less the true position, the greatest of its three components."""
    estimate_heading_p95_rad: float | None = None
    """95th percentile of the magnitude of the estimated less the true heading."""
    estimate_within_20mm_3deg: float | None = None
    """Share within ±20 mm in each component and 3° of heading (paper C's bounds)."""
    estimate_within_10mm_1deg: float | None = None
    """Share within ±10 mm and 1°."""
    lights_share: float | None = None
    """Share of the frames since the first measured pose that rested on the lights alone."""
    tag_share: float | None = None
    """On the tag alone."""
    fused_share: float | None = None
    """On both."""
    blind_share: float | None = None
    """On neither."""

    WALL_CLOCK_FIELDS = ("wall_s", "real_time_factor", "frame_ms_median", "frame_ms_p95")

    def to_json(self) -> dict[str, Any]:
        """Plain data for `json.dumps`."""
        return {field.name: to_plain(getattr(self, field.name)) for field in fields(self)}
