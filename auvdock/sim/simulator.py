"""The simulator: one vehicle, one station and the water, stepped by MuJoCo with exact added mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.core.checked import Checked
from auvdock.core.contracts import Proprioception
from auvdock.core.limits import between
from auvdock.core.stations import StationCfg
from auvdock.core.transforms import make_transform, rotation_from_quat_wxyz
from auvdock.core.vehicle import VehicleCfg, load_vehicle
from auvdock.sim.actuation import Actuators
from auvdock.sim.contacts import Contacts
from auvdock.sim.dock import Weld
from auvdock.sim.docks import make_dock
from auvdock.sim.hydrodynamics import Hydrodynamics
from auvdock.sim.immersion import Immersion
from auvdock.sim.mj import MjData, addresses, mujoco
from auvdock.sim.ocean import CurrentCfg, Ocean
from auvdock.sim.scene import LATCH, VEHICLE, build_model
from auvdock.sim.sensors import SensorCfg, Sensors
from auvdock.sim.stepping import MOTION, ROW, advance, is_absurd, keep, motion
from auvdock.sim.truth import Truth

__all__ = ["HistoryEntry", "SimCfg", "Simulator"]

_HISTORY_STEPS = 240


@dataclass(frozen=True)
class SimCfg(Checked):
    """Vehicle, current, sensors and physics rate."""

    vehicle: str = "remus_hybrid"
    """Vehicle preset."""
    current: CurrentCfg = CurrentCfg()
    sensors: SensorCfg = SensorCfg()
    physics_hz: Annotated[float, between(100.0, 2000.0, "contacts need some 100 Hz")] = 120.0
    """Physics steps a second."""


class HistoryEntry(NamedTuple):
    """State before one step and the command given in it; the command is empty for a state in which a step ended."""

    time_s: float
    qpos: list[float]
    """Position (3) and quaternion wxyz (4) of the body in the world."""
    qvel: list[float]
    """Velocity over ground in the world frame (3), angular velocity in the body frame (3)."""
    command: list[float]


class Simulator:
    """Steps the world; `truth` is for metrics, `proprioception` for the vehicle.

    Each step adds M_A to MuJoCo's mass matrix and the water's forces to its others (`stepping.advance`). A state that
    is not finite or absurd (faster than 10 m/s or 50 rad/s, further than 1 km from the start) freezes the simulator at
    the last sane state: `truth.diverged` is True.

    Attributes:
        cfg: configuration.
        station: the station.
        vehicle: the vehicle.
        model: the MuJoCo model; its own to each simulator.
        T_world_station: (4, 4) pose of the station frame.
    """

    def __init__(self, cfg: SimCfg, station: StationCfg, vehicle: VehicleCfg | None = None) -> None:
        """Build the world.

        Args:
            cfg: configuration.
            station: the station.
            vehicle: in place of the preset that `cfg.vehicle` names.

        Raises:
            ConfigError: no such vehicle, or data that does not fit.
        """
        self.cfg = cfg
        self.station = station
        self.vehicle = vehicle if vehicle is not None else load_vehicle(cfg.vehicle)
        self._dt_s = 1.0 / cfg.physics_hz
        self._dock = make_dock(station, self.vehicle)
        self.model = build_model(self.vehicle, self._dock, self._dt_s)
        self._data = mujoco.MjData(self.model)
        self.T_world_station = make_transform(np.eye(3), np.array([0.0, 0.0, -station.depth_m]))
        self._actuators = Actuators(self.vehicle, self._dt_s)
        self._hydrodynamics = Hydrodynamics(self.vehicle, self._actuators.thrusters)
        self._ocean = Ocean(cfg.current, station.depth_m, self._dt_s)
        self._sensors = Sensors(cfg.sensors)
        self._contacts = Contacts(self.model, self._data, self.vehicle.nose_x_m, self.vehicle.radius_m)
        self._weld = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, LATCH)
        self._body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, VEHICLE)
        hydrodynamics, watch = self._hydrodynamics, self._dock.watch
        water = hydrodynamics.displaced_kg, hydrodynamics.buoyancy_n, self._dt_s
        self._immersion = Immersion(self.vehicle)
        above = self._immersion.clearance_m
        self._constants = np.array([*water, watch.reach_m, *watch.normal_world, watch.offset_m, above, 0.0, 0.0, 0.0])
        self._totals: Array = np.zeros(2)
        self._ring: Array = np.zeros((_HISTORY_STEPS + 1, ROW + len(self.vehicle.actuators)))
        self._truth: Truth | None = None
        self._moving: Array | None = None
        self._bind()
        self.reset(np.array(self._dock.free_world_m), np.array([0.0, 0.0, 0.0, 1.0]), np.random.default_rng(0))

    def _bind(self) -> None:
        """Views into MuJoCo's memory, so that the step need not look them up."""
        data = self._data
        self._qpos, self._qvel = data.qpos, data.qvel
        self._mass = data.M[:21]
        self._xmat = data.xmat[self._body].reshape(3, 3)
        self._applied = data.qfrc_applied[:6]
        self._constraint = data.qfrc_constraint[:3]
        self._addresses = addresses(self.model, data)
        self._contacts.bind(data)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the views."""
        views = ("_qpos", "_qvel", "_mass", "_xmat", "_applied", "_constraint", "_addresses")
        return {key: value for key, value in self.__dict__.items() if key not in views}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the views too."""
        self.__dict__.update(state)
        self._bind()

    @property
    def data(self) -> MjData:
        """MuJoCo's data, with poses of bodies, geoms, cameras and lights brought up to the present state."""
        self._moving = None  # whoever holds the data may change it
        if self._poses_stale:
            mujoco.mj_kinematics(self.model, self._data)
            mujoco.mj_comPos(self.model, self._data)
            mujoco.mj_camlight(self.model, self._data)
            self._poses_stale = False
        return self._data

    def reset(
        self,
        position_world_m: Array,
        quat_wxyz: Array,
        rng: np.random.Generator,
        current: CurrentCfg | None = None,
        nu_relative_body: Array | None = None,
        compass_datum_rad: float = 0.0,
    ) -> None:
        """Start an episode: at rest relative to the water unless told otherwise, actuators at rest, latch open.

        Args:
            position_world_m: (3,) of the body frame's origin.
            quat_wxyz: (4,) of the body frame; normalised here.
            rng: spawns one generator for the water and one for the sensors.
            current: in place of the configured one, for this episode.
            nu_relative_body: (6,) velocity through the water, body axes, m/s and rad/s; None is at rest.
            compass_datum_rad: added to every compass reading of the episode.

        Raises:
            ValueError: wrong shapes, a quaternion of no length, or a state that is not finite or absurd.
        """
        check_shape("position_world_m", position_world_m, (3,))
        check_shape("quat_wxyz", quat_wxyz, (4,))
        length = float(np.linalg.norm(quat_wxyz))
        if not length > 1e-6:
            raise ValueError("quat_wxyz has no length")
        nu = np.zeros(6) if nu_relative_body is None else nu_relative_body
        check_shape("nu_relative_body", nu, (6,))
        qpos = np.concatenate([position_world_m, quat_wxyz / length]).astype(np.float64)
        if is_absurd(qpos, nu.astype(np.float64), qpos[:3]):
            raise ValueError(f"cannot start at {position_world_m} with {nu}")
        water_rng, sensor_rng = rng.spawn(2)
        mujoco.mj_resetData(self.model, self._data)
        self._ocean.reset(current if current is not None else self.cfg.current, water_rng)
        self._sensors.reset(sensor_rng, compass_datum_rad)
        self._actuators.reset()
        self._dock.reset()
        self._qpos[:] = qpos
        self._constants[9:12] = qpos[:3]
        self._qvel[:3] = self._ocean.velocity(float(qpos[2])) + rotation_from_quat_wxyz(qpos[3:]) @ nu[:3]
        self._qvel[3:] = nu[3:]
        self._steps = 0
        self._diverged = False
        self._contacts.reset()
        self._totals[:] = 0.0
        self._broached_s = 0.0
        self._absurd: list[HistoryEntry] = []
        keep(self._ring, 0, self._qpos, self._qvel)
        mujoco.mj_forward(self.model, self._data)
        self._poses_stale = False
        self._observe()

    def step(self, command: Array | Sequence[float], steps: int = 1) -> None:
        """Advance by physics steps under the actuator commands (n,) in [-1, 1].

        Does nothing once diverged.

        Args:
            command: held over all of the steps.
            steps: how many.

        Raises:
            ValueError: a command of the wrong length or with values that are not numbers.
        """
        if self._diverged:
            return
        values = self._actuators.checked(command)
        while steps > 0 and not self._diverged:
            moving = np.empty(MOTION)
            immersion = self._immersion.of(self._qpos, self._qvel)
            noise = self._ocean.noise(steps)
            made = advance(
                *self._addresses,
                min(steps, len(noise)) or steps,
                self._steps,
                self._qpos,
                self._qvel,
                self._xmat,
                self._mass,
                self._applied,
                self._constraint,
                values,
                self._actuators.state,
                self._actuators.table,
                self._hydrodynamics.weights,
                self._hydrodynamics.added,
                self._ocean.current,
                self._ocean.gust,
                noise,
                self._constants,
                immersion,
                self._totals,
                self._ring,
                moving,
            )
            if made < 0:
                raise ValueError(f"command {-1 - made} is not a number")
            if made == 0:
                self._freeze(values.tolist())
                return
            self._ocean.used(made)
            self._poses_stale = True
            self._steps += made
            if immersion is not self._immersion.under and immersion[0] < 1.0:
                self._broached_s += made * self._dt_s
            steps -= made
            self._contacts.update()
            self._observe(moving)

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._steps * self._dt_s

    @property
    def truth(self) -> Truth:
        """A snapshot of the true state; its arrays are read-only, since callers between two steps share it."""
        if self._truth is not None:
            return self._truth
        moving = self._motion()
        dock = self._dock.report()
        entry = dock.entry
        nose = np.array(dock.nose_station_m)
        nose.setflags(write=False)
        self._truth = Truth(
            time_s=self.time_s,
            T_world_body=moving[:16].reshape(4, 4),
            nu_body=moving[22:28],
            nu_relative_body=moving[28:34],
            current_world_m_s=moving[19:22],
            nose_station_m=nose,
            axis_angle_rad=dock.axis_angle_rad,
            contact_force_n=self._contacts.force_n,
            peak_contact_force_n=self._contacts.peak_force_n,
            touching_station=self._contacts.touching_station,
            latched=dock.latched,
            docked=dock.docked,
            entry_speed_m_s=entry.speed_m_s if entry else None,
            entry_angle_rad=entry.angle_rad if entry else None,
            entry_lateral_m=entry.lateral_m if entry else None,
            entry_vertical_m=entry.vertical_m if entry else None,
            energy_j=float(self._totals[0]),
            path_length_m=float(self._totals[1]),
            immersed_share=float(self._immersion.of(self._qpos, self._qvel)[0]),
            broached_s=self._broached_s,
            diverged=self._diverged,
            landing=dock.landing,
        )
        return self._truth

    def proprioception(self) -> Proprioception:
        """One noisy sample of the vehicle's own sensors; draws from the sensors' generator."""
        moving, force_n = self._motion(), 0.0
        if self._contacts.force_n > 0.0:
            pose = moving[:16].reshape(4, 4)
            force_n = self._dock.switch_force_n(self._contacts, pose[:3, 3], pose[:3, :3])
        return self._sensors.sample(
            self.time_s, -float(moving[11]), moving[16:19], moving[22:28], moving[28:34], force_n, self._dock.latched
        )

    def _motion(self) -> Array:
        """`stepping.motion` of the present state, read-only."""
        if self._moving is None:
            self._moving = np.empty(MOTION)
            motion(self._qpos, self._qvel, self._ocean.current, self._ocean.gust, self._moving)
            self._moving.setflags(write=False)
        return self._moving

    @property
    def history(self) -> list[HistoryEntry]:
        """The last 240 steps; once diverged, the absurd state is the last entry."""
        kept = min(self._steps, _HISTORY_STEPS - len(self._absurd))
        rows = [self._ring[index % len(self._ring)].tolist() for index in range(self._steps - kept, self._steps)]
        return [HistoryEntry(row[0] * self._dt_s, row[1:8], row[8:ROW], row[ROW:]) for row in rows] + self._absurd

    def _observe(self, moving: Array | None = None) -> None:
        """Dock, latch and divergence after steps or a reset; `moving` is what `motion` says of the state."""
        qpos: list[float] = self._qpos.tolist()
        qvel: list[float] = self._qvel.tolist()
        if is_absurd(self._qpos, self._qvel, self._constants[9:12]):
            self._freeze([])
            return
        if moving is not None:
            moving.setflags(write=False)
        self._truth, self._moving = None, moving
        weld = self._dock.update(self.time_s, qpos, qvel, self._contacts)
        if weld is not None:
            self._close_latch(weld)

    def _freeze(self, command: list[float]) -> None:
        """Mark as diverged and go back to the last sane state, so that nobody downstream meets a NaN."""
        self._diverged = True
        self._absurd = [HistoryEntry(self.time_s, self._qpos.tolist(), self._qvel.tolist(), command)]
        self._truth = self._moving = None
        # Either somebody wrote to the data since the last step, or that step went wrong, whose state was not kept.
        index = self._steps if command else self._steps - 1
        row = self._ring[index % len(self._ring)]
        self._qpos[:], self._qvel[:] = row[1:8], row[8:ROW]
        self._contacts.force_n = 0.0

    def _close_latch(self, weld: Weld) -> None:
        """Switch MuJoCo's weld on; it takes the pose of the world in the body's frame."""
        data = self.model.eq_data[self._weld]
        data[0:3] = weld.anchor_world_m
        data[3:6] = weld.anchor_body_m
        w, x, y, z = weld.quat_wxyz
        data[6:10] = w, -x, -y, -z
        data[10] = 1.0
        self._data.eq_active[self._weld] = 1
