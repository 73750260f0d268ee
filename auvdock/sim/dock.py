"""What differs between stations, as the simulator sees it: geometry, latch and what the truth tells of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

from auvdock.core.arrays import Array
from auvdock.numeric.records import Record
from auvdock.sim.contacts import Contacts
from auvdock.sim.latch import Entry
from auvdock.sim.truth import LandingTruth

__all__ = ["Dock", "DockReport", "Watch", "Weld"]


class Weld(NamedTuple):
    """How the latch holds the vehicle: `anchor_body_m` is pulled to `anchor_world_m`, the attitude to `quat_wxyz`."""

    anchor_world_m: tuple[float, float, float]
    anchor_body_m: tuple[float, float, float]
    quat_wxyz: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Watch(Record):
    """Where the dock has to see every physics step: while n · p ≤ offset, p on the body's x axis, world frame."""

    reach_m: float
    """x of the point p in the body frame."""
    normal_world: Annotated[Array, 3]
    """n."""
    offset_m: float


class DockReport(NamedTuple):
    """What the truth tells of vehicle and station; the names are `Truth`'s."""

    nose_station_m: tuple[float, float, float]
    axis_angle_rad: float
    latched: bool
    docked: bool
    entry: Entry | None = None
    landing: LandingTruth | None = None


class Dock(Protocol):
    """A docking station in the simulator.

    Attributes:
        depth_m: depth of the station frame's origin; the frame is not turned against the world.
        free_world_m: a free place in the water, where a new simulator puts its vehicle.
        latch_time_s: time constant with which the latch pulls and holds.
        watch: where `update` has to see every step; elsewhere it may miss steps in which nothing touches the vehicle.
    """

    depth_m: float
    free_world_m: tuple[float, float, float]
    latch_time_s: float
    watch: Watch

    def assets(self) -> list[str]:
        """MJCF elements of the `asset` section that the station's geoms need beyond the common materials."""
        ...

    def geoms(self) -> list[str]:
        """MJCF geom elements in world coordinates; one plane is named "floor", all others are the station's."""
        ...

    def reset(self) -> None:
        """Start an episode: latch open, nothing seen."""
        ...

    def update(self, time_s: float, qpos: list[float], qvel: list[float], contacts: Contacts) -> Weld | None:
        """Take in the state after a step, or after a reset; a weld exactly when the latch closes in it.

        Args:
            time_s: simulated time.
            qpos: position (3) and quaternion wxyz (4) of the body.
            qvel: velocity in the world frame (3), angular velocity in the body frame (3).
            contacts: what the step's contacts were.
        """
        ...

    def ground_z_m(self, x_m: float, y_m: float) -> float:
        """Height in the world of what lies under the water at a place: floor or station."""
        ...

    @property
    def latched(self) -> bool:
        """True once the latch has closed."""
        ...

    def switch_force_n(self, contacts: Contacts, position_world_m: Array, rotation: Array) -> float:
        """Force on the vehicle's touch switch that this kind of docking uses."""
        ...

    def report(self) -> DockReport:
        """Where the vehicle stands to the station, as of the last update."""
        ...
