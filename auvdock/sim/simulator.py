"""The simulator: one vehicle, one station and the water, stepped by MuJoCo with exact added mass."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.core.contracts import Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.stations import StationCfg
from auvdock.core.transforms import euler_zyx_from_rotation, make_transform
from auvdock.core.vehicle import VehicleCfg, load_vehicle
from auvdock.sim.actuation import Actuators
from auvdock.sim.contacts import Contacts
from auvdock.sim.dock import Weld
from auvdock.sim.docks import make_dock
from auvdock.sim.hydrodynamics import Hydrodynamics
from auvdock.sim.mj import MjData, mujoco
from auvdock.sim.ocean import CurrentCfg, Ocean
from auvdock.sim.scene import LATCH, VEHICLE, build_model
from auvdock.sim.sensors import SensorCfg, Sensors
from auvdock.sim.state import is_absurd, rotation_rows
from auvdock.sim.truth import Truth

__all__ = ["HistoryEntry", "SimCfg", "Simulator"]

_HISTORY_STEPS = 240


@dataclass(frozen=True)
class SimCfg:
    """Vehicle, current, sensors and physics rate."""

    vehicle: str = "remus_hybrid"
    """Vehicle preset."""
    current: CurrentCfg = CurrentCfg()
    sensors: SensorCfg = SensorCfg()
    physics_hz: float = 120.0
    """Physics steps a second."""

    def __post_init__(self) -> None:
        """Contacts need some 100 Hz; beyond 2000 Hz nothing is gained."""
        if not 100.0 <= self.physics_hz <= 2000.0:
            raise ConfigError("sim.physics_hz", self.physics_hz, "a rate of 100 to 2000 Hz")


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

    Each step: `mj_step1`, M_A into the free joint's 6×6 block of `data.M`, `mj_factorM`, the water's forces into
    `qfrc_applied`, `mj_step2`. A state that is not finite or absurd (faster than 10 m/s or 50 rad/s, further than
    200 m from the origin) freezes the simulator at the last sane state: `truth.diverged` is True, and `history` keeps
    the last 240 steps with the absurd state as its last entry.

    Attributes:
        cfg: configuration.
        station: the station.
        vehicle: the vehicle.
        model: the MuJoCo model; its own to each simulator.
        T_world_station: (4, 4) pose of the station frame.
        history: ring buffer of the last steps.
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
        self.history: deque[HistoryEntry] = deque(maxlen=_HISTORY_STEPS)
        self._actuators = Actuators(self.vehicle, self._dt_s)
        self._hydrodynamics = Hydrodynamics(self.vehicle, self._actuators.thrusters)
        self._ocean = Ocean(cfg.current, station.depth_m, self._dt_s)
        self._sensors = Sensors(cfg.sensors)
        self._contacts = Contacts(self.model, self._data, self.vehicle.nose_x_m, self.vehicle.radius_m)
        self._weld = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, LATCH)
        self._body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, VEHICLE)
        self._truth: Truth | None = None
        self._motion_now: tuple[Array, Array, Array, Array] | None = None
        self._bind()
        self.reset(np.array(self._dock.free_world_m), np.array([0.0, 0.0, 0.0, 1.0]), np.random.default_rng(0))

    def _bind(self) -> None:
        """Views into MuJoCo's memory, so that the step need not look them up."""
        data = self._data
        self._qpos, self._qvel = data.qpos, data.qvel
        self._mass = data.M[:21]
        self._xmat = data.xmat[self._body].reshape(3, 3)
        self._applied = data.qfrc_applied
        self._contacts.bind(data)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the views."""
        views = ("_qpos", "_qvel", "_mass", "_xmat", "_applied")
        return {key: value for key, value in self.__dict__.items() if key not in views}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the views too."""
        self.__dict__.update(state)
        self._bind()

    @property
    def data(self) -> MjData:
        """MuJoCo's data, with poses of bodies, geoms, cameras and lights brought up to the present state."""
        self._motion_now = None  # whoever holds the data may change it
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
        qpos = [*position_world_m.tolist(), *(quat_wxyz / length).tolist()]
        if is_absurd(qpos, nu.tolist()):
            raise ValueError(f"cannot start at {position_world_m} with {nu}")
        water_rng, sensor_rng = rng.spawn(2)
        mujoco.mj_resetData(self.model, self._data)
        self._ocean.reset(current if current is not None else self.cfg.current, water_rng)
        self._sensors.reset(sensor_rng, compass_datum_rad)
        self._actuators.reset()
        self._dock.reset()
        self._qpos[:] = qpos
        rotation = np.array(rotation_rows(*qpos[3:])).reshape(3, 3)
        self._qvel[:3] = np.array(self._ocean.velocity(qpos[2])) + rotation @ nu[:3]
        self._qvel[3:] = nu[3:]
        self._steps = 0
        self._diverged = False
        self._contacts.reset()
        self._energy_j = self._path_length_m = 0.0
        self.history.clear()
        mujoco.mj_forward(self.model, self._data)
        self._poses_stale = False
        self._observe()

    def step(self, command: Array | Sequence[float]) -> None:
        """Advance by one physics step under the actuator commands (n,) in [-1, 1].

        Does nothing once diverged.

        Raises:
            ValueError: a command of the wrong length or with values that are not numbers.
        """
        if self._diverged:
            return
        model, data = self.model, self._data
        state = self._actuators.step(command)
        values: list[float] = command.tolist() if isinstance(command, np.ndarray) else list(command)
        qpos: list[float] = self._qpos.tolist()
        qvel: list[float] = self._qvel.tolist()
        self.history.append(HistoryEntry(self.time_s, qpos, qvel, values))
        if (qpos, qvel) != self._sane and is_absurd(qpos, qvel):  # somebody wrote to the data
            self._freeze()
            return
        mujoco.mj_step1(model, data)
        rotation = self._xmat
        water = self._ocean.velocity(qpos[2])
        wrench, advance = self._hydrodynamics.wrench(rotation, self._qvel, water, self._ocean.step(), state)
        self._hydrodynamics.add_mass(self._mass, rotation)
        mujoco.mj_factorM(model, data)
        self._applied[...] = wrench
        mujoco.mj_step2(model, data)
        self._poses_stale = True
        self._steps += 1
        self._energy_j += self._actuators.power_w(advance) * self._dt_s
        self._path_length_m += math.sqrt(qvel[0] ** 2 + qvel[1] ** 2 + qvel[2] ** 2) * self._dt_s
        self._contacts.update()
        self._observe()

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._steps * self._dt_s

    @property
    def truth(self) -> Truth:
        """A snapshot of the true state; its arrays are read-only, since callers between two steps share it."""
        if self._truth is not None:
            return self._truth
        rotation, nu, nu_relative, water = self._motion()
        dock = self._dock.report()
        entry = dock.entry
        pose, nose = np.zeros((4, 4)), np.array(dock.nose_station_m)
        pose[:3, :3], pose[:3, 3], pose[3, 3] = rotation, self._qpos[:3], 1.0
        pose.setflags(write=False)
        nose.setflags(write=False)
        self._truth = Truth(
            time_s=self.time_s,
            T_world_body=pose,
            nu_body=nu,
            nu_relative_body=nu_relative,
            current_world_m_s=water,
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
            energy_j=self._energy_j,
            path_length_m=self._path_length_m,
            diverged=self._diverged,
            landing=dock.landing,
        )
        return self._truth

    def proprioception(self) -> Proprioception:
        """One noisy sample of the vehicle's own sensors; draws from the sensors' generator."""
        rotation, nu, nu_relative, _ = self._motion()
        return self._sensors.sample(
            time_s=self.time_s,
            depth_m=-float(self._qpos[2]),
            euler_zyx_rad=euler_zyx_from_rotation(rotation),
            nu_body=nu,
            nu_relative_body=nu_relative,
            switch_force_n=self._dock.switch_force_n(self._contacts, self._qpos[:3], rotation),
            latched=self._dock.latched,
        )

    def _motion(self) -> tuple[Array, Array, Array, Array]:
        """Rotation body to world, ν over ground, ν relative to the water, water's velocity; kept for a step."""
        if self._motion_now is not None:
            return self._motion_now
        qpos: list[float] = self._qpos.tolist()
        rotation = np.array(rotation_rows(*qpos[3:7])).reshape(3, 3)
        water = np.array(self._ocean.velocity(qpos[2]))
        velocity, spin = self._qvel[:3], self._qvel[3:6]
        nu, nu_relative = np.empty(6), np.empty(6)
        nu[:3] = velocity.dot(rotation)
        nu_relative[:3] = (velocity - water).dot(rotation)
        nu[3:] = nu_relative[3:] = spin
        motion = rotation, nu, nu_relative, water
        for array in motion:
            array.setflags(write=False)
        self._motion_now = motion
        return motion

    def _observe(self) -> None:
        """Dock, latch and divergence after a step or a reset."""
        self._truth = self._motion_now = None
        qpos: list[float] = self._qpos.tolist()
        qvel: list[float] = self._qvel.tolist()
        if is_absurd(qpos, qvel):
            self.history.append(HistoryEntry(self.time_s, qpos, qvel, []))
            self._freeze()
            return
        self._sane = qpos, qvel
        weld = self._dock.update(self.time_s, qpos, qvel, self._contacts)
        if weld is not None:
            self._close_latch(weld)

    def _freeze(self) -> None:
        """Mark as diverged and go back to the last sane state, so that nobody downstream meets a NaN."""
        self._diverged = True
        self._truth = self._motion_now = None
        self._qpos[:], self._qvel[:] = self._sane
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
