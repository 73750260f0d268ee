"""Set-point autopilot: speeds, depth, attitude and heading in, body wrench out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.controllers.control_law import (
    ControlLaw,
    Drag,
    Loop,
    LoopMemory,
    agree,
    back_calculate,
    body_wrench,
)
from auvdock.controllers.gains import AutopilotGains, DesignCfg, design_gains
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import Proprioception
from auvdock.core.errors import located
from auvdock.core.limits import Positive, PositiveShare
from auvdock.core.vehicle import VehicleCfg
from auvdock.estimation.senses import Senses, Vector, read_senses
from auvdock.numeric.records import Records, new_rows

__all__ = ["Autopilot", "AutopilotCfg", "AutopilotSetpoint", "AutopilotState"]

_MEMORY = LoopMemory.dtype()


@dataclass(frozen=True)
class AutopilotCfg(Checked):
    """Limits of the autopilot; its gains follow from `design`."""

    design: DesignCfg = DesignCfg()
    """What the loops shall achieve."""
    surge_acceleration_m_s2: Positive = 0.25
    """Fastest change of the surge reference."""
    sway_acceleration_m_s2: Positive = 0.15
    """Fastest change of the sway and heave references."""
    max_heave_m_s: Positive = 0.3
    """Greatest vertical speed that the depth loop asks for."""
    max_heading_error_rad: Positive = 0.6
    """Heading and pitch errors beyond this count as this much: large turns run at a bounded rate."""
    integral_zone_rad: Positive = 0.15
    """Heading and pitch errors beyond this are not integrated (integral separation): a turn leaves no overshoot."""
    max_speed_error_m_s: Positive = 0.4
    """The shaped speed references stay this close to the measured speed: they do not run away from a saturated hull."""
    force_share: PositiveShare = 0.85
    """Part of an axis' thrust that its force loop may use; the rest of shared thrusters is left to the moments."""
    moment_share: PositiveShare = 0.95
    """Part of an axis' greatest moment that its loop may use."""
    current_time_constant_s: Positive = 2.0
    """Smoothing of the measured water velocity for feed-forward."""


class AutopilotSetpoint(NamedTuple):
    """What the autopilot shall hold. Speeds are in the level heading frame: ahead, to port, up.

    Attributes:
        surge_m_s: speed ahead.
        sway_m_s: speed to port.
        heave_m_s: speed upwards; ignored while `depth_m` is given.
        pitch_rad: positive nose down.
        heading_rad: world yaw, positive to port.
        depth_m: depth to hold, positive down, or None.
        through_water: True if the speeds are through the water, False if over ground.
        turn_rad_s: rate at which the heading set-point itself turns, positive to port.
        roll_rad: positive to starboard; for vehicles whose thrusters act on roll.
    """

    surge_m_s: float
    sway_m_s: float
    heave_m_s: float
    pitch_rad: float
    heading_rad: float
    depth_m: float | None = None
    through_water: bool = False
    turn_rad_s: float = 0.0
    roll_rad: float = 0.0


class AutopilotState(NamedTuple):
    """What the loops remember.

    Attributes:
        memory: (1,) never written to.
    """

    memory: Records[LoopMemory]

    @property
    def references_m_s(self) -> Vector:
        """Shaped speed references in the level heading frame."""
        ahead, port, up = self.memory["references_m_s"][0].tolist()
        return ahead, port, up

    @property
    def current_m_s(self) -> Array:
        """(3,) smoothed current in world axes, 0 before the first sample; never written to."""
        return self.memory["current_m_s"][0]

    @property
    def integrals(self) -> tuple[float, ...]:
        """Integral parts in the order surge, sway, heave, pitch, heading, roll; 0 for a roll that is not controlled."""
        return tuple(self.memory["integrals"][0].tolist())


class Autopilot:
    """PI on body velocities, PID on heading, pitch and (where thrusters act on it) roll, P on depth, drag fed forward.

    τ = PID(error) + ff, where ff balances drag, lift and Munk moment at the reference velocity through the water
    (reference over ground minus measured current), the net buoyancy, and the inertia along the shaped reference.
    Derivatives are the measured rates.
    """

    def __init__(self, vehicle: VehicleCfg, cfg: AutopilotCfg, dt_s: float) -> None:
        """Derive the gains and unpack the coefficients.

        Args:
            vehicle: whose coefficients and actuators.
            cfg: limits and loop design.
            dt_s: control period.
        """
        with located("autopilot.design."):
            self.gains: AutopilotGains = design_gains(vehicle, cfg.design, dt_s)
        self._max_heave_m_s = cfg.max_heave_m_s
        self._dt_s = dt_s
        names, rows = ("surge", "sway", "heave", "pitch", "heading", "roll"), (0, 1, 2, 4, 5, 3)
        rows = rows[: 5 if self.gains.roll is None else 6]
        pids = [self.gains.loops[name].gains for name in names[: len(rows)]]
        self._depth_gain = self.gains.depth.gains.kp
        thrusters = [index for index, actuator in enumerate(vehicle.actuators) if actuator.kind == "thruster"]
        wrenches = vehicle.thruster_wrenches_body[:, thrusters]
        reach = np.abs(wrenches).sum(axis=1).tolist()
        # A propeller that gives surge alone may be used up; thrusters that also serve the moments may not.
        alone = np.abs(wrenches[1:, np.abs(wrenches[0]) > 1e-9]).max(initial=0.0) < 1e-9
        shares = [1.0 if alone else cfg.force_share, cfg.force_share, cfg.force_share, *[cfg.moment_share] * 3]
        self.limits = tuple(share * reach[row] for share, row in zip(shares, rows, strict=False))
        self._loops = Loop.table(
            Loop(row, pid.kp, pid.ki, pid.kd, limit) for row, pid, limit in zip(rows, pids, self.limits, strict=True)
        )
        mass = np.diag(vehicle.rigid_body_mass_body + vehicle.added_mass_body)
        self._law = ControlLaw(
            dt_s=dt_s,
            smoothing=1.0 - math.exp(-dt_s / cfg.current_time_constant_s),
            surge_acceleration_m_s2=cfg.surge_acceleration_m_s2,
            sway_acceleration_m_s2=cfg.sway_acceleration_m_s2,
            max_speed_error_m_s=cfg.max_speed_error_m_s,
            integral_zone_rad=cfg.integral_zone_rad,
            max_angle_error_rad=cfg.max_heading_error_rad,
            net_weight_n=vehicle.mass_kg * 9.81 - vehicle.buoyancy_n,
            drag=Drag(
                linear=vehicle.linear_damping_body[:, :3],
                quadratic=vehicle.quadratic_damping_body[:, :3],
                lift=vehicle.lift_damping_body[:, :3],
                added_kg=vehicle.added_mass_body[:3, :3],
                inertia_kg=mass[:3],
            ),
        ).packed()

    def initial_state(self) -> AutopilotState:
        """At rest, integrals empty."""
        return AutopilotState(LoopMemory.zeros())

    def step(
        self, state: AutopilotState, setpoint: AutopilotSetpoint, proprioception: Proprioception
    ) -> tuple[Array, AutopilotState]:
        """Wrench (6,) in body axes, N and N m, and the next state."""
        return self.advance(state, setpoint, read_senses(proprioception))

    def advance(
        self, state: AutopilotState, setpoint: AutopilotSetpoint, senses: Senses
    ) -> tuple[Array, AutopilotState]:
        """As `step`, from unpacked senses."""
        heave = setpoint.heave_m_s
        if setpoint.depth_m is not None:
            bound = self._max_heave_m_s
            heave = min(bound, max(-bound, self._depth_gain * (senses.depth_m - setpoint.depth_m)))
        wrench = np.zeros(6)
        memory: Records[LoopMemory] = new_rows(1, _MEMORY)
        wanted = (
            setpoint.surge_m_s,
            setpoint.sway_m_s,
            heave,
            setpoint.through_water,
            setpoint.roll_rad,
            setpoint.pitch_rad,
            setpoint.heading_rad,
            setpoint.turn_rad_s,
        )
        body_wrench(wrench, memory, state.memory, senses.motion, senses.yaw_rad, wanted, self._law, self._loops)
        return wrench, AutopilotState(memory)

    def settle(self, state: AutopilotState, wanted: Array, achieved: Array) -> AutopilotState:
        """Anti-windup for what allocation could not give, see `control_law.back_calculate`."""
        if agree(wanted, achieved):
            return state
        memory: Records[LoopMemory] = new_rows(1, _MEMORY)
        back_calculate(memory, state.memory, wanted, achieved, self._loops, self._dt_s)
        return AutopilotState(memory)
