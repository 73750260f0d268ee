"""The simulator: one vehicle, one station and the water, stepped by MuJoCo with exact added mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, cast

import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.core.checked import Checked
from auvdock.core.contracts import Proprioception
from auvdock.core.limits import between
from auvdock.core.marine import flip_vector
from auvdock.core.stations import StationCfg
from auvdock.core.transforms import make_transform, rotation_from_quat_wxyz
from auvdock.core.vehicle import VehicleCfg, load_vehicle
from auvdock.numeric.records import Records
from auvdock.sim.actuation import make_actuators
from auvdock.sim.contacts import Contacts
from auvdock.sim.dock import Weld
from auvdock.sim.docks import make_dock
from auvdock.sim.hydrodynamics import draw_hull, make_hull
from auvdock.sim.immersion import clearance_m, cut_hull, immerse
from auvdock.sim.kinematics import Kinematics, kinematics
from auvdock.sim.mj import MjData, addresses, mujoco
from auvdock.sim.ocean import CurrentCfg, Ocean
from auvdock.sim.scene import LATCH, VEHICLE, build_model
from auvdock.sim.sensors import SensorCfg, Sensors
from auvdock.sim.stepping import FreeJoint, Run, Snapshot, advance, is_absurd, record
from auvdock.sim.truth import Truth

__all__ = ["HistoryEntry", "SimCfg", "Simulator"]

_HISTORY_STEPS = 240


@dataclass(frozen=True)
class SimCfg(Checked):
    """Vehicle, current, sensors and physics rate."""

    vehicle: str = "remus_hybrid"
    """Vehicle preset."""
    battery_v: Annotated[float, between(10.0, 20.0)] | None = None
    """Voltage of thrusters with measured curves, in place of the vehicle's own."""
    coefficient_spread: Annotated[float, between(0.0, 0.5)] = 0.0
    """Standard deviation of the natural logarithm of each hydrodynamic coefficient of the flown hull over the published
    one, drawn each episode (`hydrodynamics.draw_hull`); the pilot knows the published ones."""
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
        self.vehicle = vehicle if vehicle is not None else load_vehicle(cfg.vehicle, cfg.battery_v)
        self._dt_s = 1.0 / cfg.physics_hz
        self._dock = make_dock(station, self.vehicle)
        self.model = build_model(self.vehicle, self._dock, self._dt_s)
        self._data = mujoco.MjData(self.model)
        self.T_world_station = make_transform(np.eye(3), np.array([0.0, 0.0, -station.depth_m]))
        self._actuators = make_actuators(self.vehicle, self._dt_s)
        self._is_metered = bool(self._actuators["has_curve"].any())
        self._pieces = cut_hull(self.vehicle)
        self._clearance_m = clearance_m(self._pieces, self._actuators)
        self._hull = make_hull(self.vehicle, self._clearance_m)
        self._ocean = Ocean(cfg.current, station.depth_m, self._dt_s)
        self._sensors = Sensors(cfg.sensors)
        self._log_body_m = flip_vector(np.array(self.vehicle.belly_camera.position_m))
        self._contacts = Contacts(self.model, self._data, self.vehicle.nose_x_m, self.vehicle.radius_m)
        self._weld = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, LATCH)
        self._body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, VEHICLE)
        self._history = Snapshot.zeros(_HISTORY_STEPS + 1)
        self._commands: Array = np.zeros((_HISTORY_STEPS + 1, len(self._actuators)))
        self._sensed = Kinematics.zeros()
        self._shallow = False
        self._truth: Truth | None = None
        self._bind()
        self.reset(np.array(self._dock.free_world_m), np.array([0.0, 0.0, 0.0, 1.0]), np.random.default_rng(0))

    def _bind(self) -> None:
        """Views into MuJoCo's memory, so that the step need not look them up."""
        data = self._data
        self._joint = FreeJoint(
            *addresses(self.model, data),
            qpos=data.qpos,
            qvel=data.qvel,
            rotation=data.xmat[self._body].reshape(3, 3),
            mass=data.M[:21],
            applied=data.qfrc_applied[:6],
            constraint=data.qfrc_constraint[:3],
        )
        self._contacts.bind(data)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the views."""
        return {key: value for key, value in self.__dict__.items() if key != "_joint"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the views too."""
        self.__dict__.update(state)
        self._bind()

    @property
    def data(self) -> MjData:
        """MuJoCo's data, with poses of bodies, geoms, cameras and lights brought up to the present state."""
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
            rng: spawns a generator for the water, one for the sensors and one for the hull's coefficients.
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
        run = Run(self._dt_s, self._dock.watch, qpos[:3], 0, 0.0, 0.0, 0.0).packed()
        if is_absurd(qpos, nu.astype(np.float64), run):
            raise ValueError(f"cannot start at {position_world_m} with {nu}")
        water_rng, sensor_rng, hull_rng = rng.spawn(3)
        draw_hull(self._hull, self.vehicle, self.cfg.coefficient_spread, hull_rng)
        mujoco.mj_resetData(self.model, self._data)
        self._ocean.reset(current if current is not None else self.cfg.current, water_rng)
        self._sensors.reset(sensor_rng, compass_datum_rad)
        self._actuators["state"] = 0.0
        self._dock.reset()
        self._joint.qpos[:] = qpos
        self._joint.qvel[:3] = self._ocean.velocity(float(qpos[2])) + rotation_from_quat_wxyz(qpos[3:]) @ nu[:3]
        self._joint.qvel[3:] = nu[3:]
        self._diverged = False
        self._contacts.reset()
        self._run = run
        self._broached_s = 0.0
        self._absurd: list[HistoryEntry] = []
        record(self._history, 0, self._joint.qpos, self._joint.qvel)
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
        values = np.asarray(command, dtype=np.float64)
        check_shape("command", values, (len(self._actuators),))
        self._actuators["command"] = values
        while steps > 0 and not self._diverged:
            noise = self._ocean.noise(steps)
            self._immerse()
            made = advance(
                self._joint,
                min(steps, len(noise)) or steps,
                self._hull,
                self._actuators,
                self._ocean.water,
                noise,
                self._run,
                self._history,
                self._commands,
            )
            if made < 0:
                raise ValueError(f"command {-1 - made} is not a number")
            if made == 0:
                self._freeze(values.tolist())
                return
            self._ocean.used(made)
            self._poses_stale = True
            if self._hull["immersed"][0] < 1.0:
                self._broached_s += made * self._dt_s
            steps -= made
            self._contacts.update()
            self._observe()

    def _immerse(self) -> None:
        """Work out how much of the vehicle is under water now."""
        was_shallow, self._shallow = self._shallow, self._joint.qpos[2] >= -self._clearance_m
        if self._shallow or was_shallow:
            immerse(self._joint.qpos, self._joint.qvel, self._pieces, self._hull, self._actuators)

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._steps * self._dt_s

    @property
    def _steps(self) -> int:
        """Made since reset."""
        return int(self._run["steps"][0])

    @property
    def truth(self) -> Truth:
        """A snapshot of the true state; its arrays are read-only, since callers between two steps share it."""
        if self._truth is not None:
            return self._truth
        moving = Kinematics.zeros()
        self._kinematics(moving)
        cast(Any, moving).setflags(write=False)
        self._immerse()
        dock = self._dock.report()
        entry = dock.entry
        nose = np.array(dock.nose_station_m)
        nose.setflags(write=False)
        self._truth = Truth(
            time_s=self.time_s,
            T_world_body=moving["T_world_body"][0],
            nu_body=moving["nu_body"][0],
            nu_relative_body=moving["nu_relative_body"][0],
            current_world_m_s=moving["water_world_m_s"][0],
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
            energy_j=float(self._run["work_j"][0]),
            electrical_j=float(self._run["electrical_j"][0]) if self._is_metered else None,
            path_length_m=float(self._run["path_m"][0]),
            immersed_share=float(self._hull["immersed"][0]),
            broached_s=self._broached_s,
            diverged=self._diverged,
            landing=dock.landing,
        )
        return self._truth

    def proprioception(self) -> Proprioception:
        """One noisy sample of the vehicle's own sensors; draws from the sensors' generator."""
        moving, force_n = self._sensed, 0.0
        self._kinematics(moving)
        pose: Array = moving["T_world_body"][0]
        if self._contacts.force_n > 0.0:
            force_n = self._dock.switch_force_n(self._contacts, pose[:3, 3], pose[:3, :3])
        return self._sensors.sample(
            self.time_s,
            -float(pose[2, 3]),
            moving["euler_zyx_rad"][0],
            moving["nu_body"][0],
            moving["nu_relative_body"][0],
            force_n,
            self._dock.latched,
            self._log_height_m(pose),
        )

    def _log_height_m(self, T_world_body: Array) -> float:
        """Height of the DVL, which sits beside the belly camera, above what lies below it."""
        x, y, z = (T_world_body[:3, 3] + T_world_body[:3, :3] @ self._log_body_m).tolist()
        return z - self._dock.ground_z_m(x, y)

    def _kinematics(self, out: Records[Kinematics]) -> None:
        """Write `kinematics` of the present state."""
        kinematics(self._joint.qpos, self._joint.qvel, self._ocean.water, out)

    @property
    def history(self) -> list[HistoryEntry]:
        """The last 240 steps; once diverged, the absurd state is the last entry."""
        kept = min(self._steps, _HISTORY_STEPS - len(self._absurd))
        entries: list[HistoryEntry] = []
        for index in range(self._steps - kept, self._steps):
            place = index % len(self._history)
            row, command = Snapshot.read(self._history, place), self._commands[place].tolist()
            entries.append(HistoryEntry(row.step * self._dt_s, row.qpos.tolist(), row.qvel.tolist(), command))
        return entries + self._absurd

    def _observe(self) -> None:
        """Dock, latch and divergence after steps or a reset."""
        qpos: list[float] = self._joint.qpos.tolist()
        qvel: list[float] = self._joint.qvel.tolist()
        if is_absurd(self._joint.qpos, self._joint.qvel, self._run):
            self._freeze([])
            return
        self._truth = None
        weld = self._dock.update(self.time_s, qpos, qvel, self._contacts)
        if weld is not None:
            self._close_latch(weld)

    def _freeze(self, command: list[float]) -> None:
        """Mark as diverged and go back to the last sane state, so that nobody downstream meets a NaN."""
        self._diverged = True
        self._absurd = [HistoryEntry(self.time_s, self._joint.qpos.tolist(), self._joint.qvel.tolist(), command)]
        self._truth = None
        # Either somebody wrote to the data since the last step, or that step went wrong, whose state was not kept.
        index = self._steps if command else self._steps - 1
        row = Snapshot.read(self._history, index % len(self._history))
        self._joint.qpos[:], self._joint.qvel[:] = row.qpos, row.qvel
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
