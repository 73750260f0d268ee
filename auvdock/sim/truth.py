"""The simulator's state as metrics may see it. Nothing here may reach perception or a controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["LandingTruth", "Truth"]


@dataclass(frozen=True, eq=False)
class LandingTruth:
    """How the vehicle stands to a landing station. "Seat" is `VehicleCfg.seat_m`, which comes to rest in the guides.

    Attributes:
        seat_error_m: (3,) seat less its place in the guides, station frame: along (to the head), across (to port), up.
        heading_error_rad: heading of the vehicle less that of the station's centre line, positive to port.
        tilt_rad: angle between the vehicle's z and the world's.
        touchdown_speed_m_s: downward speed of the seat at the first contact with the station; None before. Negative if
            it was rising.
        touchdown_time_s: when that was; None before.
        touchdown_force_n: greatest force of the station on the vehicle from the first contact until the latch closed,
            or so far; None before.
    """

    seat_error_m: Array
    heading_error_rad: float
    tilt_rad: float
    touchdown_speed_m_s: float | None
    touchdown_time_s: float | None
    touchdown_force_n: float | None


class Truth(NamedTuple):
    """A snapshot of the true state.

    Attributes:
        time_s: simulated time since reset.
        T_world_body: (4, 4) pose of the body frame (x forward, y port, z up, origin in the centre of buoyancy).
        nu_body: (6,) velocity over ground, linear then angular, body axes, m/s and rad/s.
        nu_relative_body: (6,) the same relative to the water.
        current_world_m_s: (3,) velocity of the water at the vehicle.
        nose_station_m: (3,) tip of the nose in the station frame.
        axis_angle_rad: angle between the hull's axis and the tube's, 0 when pointing straight in; in landing, between
            the hull's axis and the station's centre line.
        contact_force_n: magnitude of the net force of contacts and latch on the hull, mean over the last step.
        peak_contact_force_n: the greatest so far.
        touching_station: True while any part of the hull touches the station.
        latched: True once the latch has closed.
        docked: True once the latch has held for `hold_s` and the entry kept `LatchCfg`'s limits (in landing: the
            touchdown those of `LandingLatchCfg`).
        entry_speed_m_s: speed along the tube as the nose last passed the throat inwards; None before, and in landing.
        entry_angle_rad: `axis_angle_rad` at that moment; None before.
        entry_lateral_m: sideways offset of the nose from the tube's axis at that moment, + to the right as the
            entering vehicle sees it; None before.
        entry_vertical_m: upward offset at that moment; None before.
        energy_j: hydraulic work of the thrusters so far (`stepping.hydraulic_power_w`).
        electrical_j: their electrical work so far; None where no thruster has a measured curve.
        path_length_m: distance over ground so far.
        immersed_share: share of the hull's displaced volume that is under water.
        broached_s: time so far in which some of it was not.
        diverged: True once the state was not finite or absurd; the state then stays frozen.
        landing: how the vehicle stands to a landing station; None at a conical one.
    """

    time_s: float
    T_world_body: Array
    nu_body: Array
    nu_relative_body: Array
    current_world_m_s: Array
    nose_station_m: Array
    axis_angle_rad: float
    contact_force_n: float
    peak_contact_force_n: float
    touching_station: bool
    latched: bool
    docked: bool
    entry_speed_m_s: float | None
    entry_angle_rad: float | None
    entry_lateral_m: float | None
    entry_vertical_m: float | None
    energy_j: float
    path_length_m: float
    immersed_share: float
    broached_s: float
    diverged: bool
    landing: LandingTruth | None = None
    electrical_j: float | None = None

    @property
    def to_go_m(self) -> float:
        """Distance yet to go: of the nose to the mouth's plane, negative inside; landing: of the seat to its place."""
        return float(self.nose_station_m[0]) if self.landing is None else self.range_m

    @property
    def range_m(self) -> float:
        """Distance of the nose from the mouth's centre; in landing of the seat from its place."""
        return float(np.linalg.norm(self.nose_station_m if self.landing is None else self.landing.seat_error_m))
