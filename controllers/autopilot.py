"""Set-point autopilot: speeds, depth, attitude and heading in, body wrench out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.controllers.gains import AutopilotGains, DesignCfg, design_gains
from auvdock.controllers.pid import pid_step
from auvdock.controllers.senses import Rows, Senses, Vector, cross, read_senses, rotate, rotate_back, turn
from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import VehicleCfg

__all__ = ["Autopilot", "AutopilotCfg", "AutopilotSetpoint", "AutopilotState"]


@dataclass(frozen=True)
class AutopilotCfg:
    """Limits of the autopilot; its gains follow from `design`."""

    design: DesignCfg = DesignCfg()
    """What the loops shall achieve."""
    surge_acceleration_m_s2: float = 0.25
    """Fastest change of the surge reference."""
    sway_acceleration_m_s2: float = 0.15
    """Fastest change of the sway and heave references."""
    max_heave_m_s: float = 0.3
    """Greatest vertical speed that the depth loop asks for."""
    max_heading_error_rad: float = 0.6
    """Heading and pitch errors beyond this count as this much: large turns run at a bounded rate."""
    integral_zone_rad: float = 0.15
    """Heading and pitch errors beyond this are not integrated (integral separation): a turn leaves no overshoot."""
    max_speed_error_m_s: float = 0.4
    """The shaped speed references stay this close to the measured speed: they do not run away from a saturated hull."""
    force_share: float = 0.85
    """Part of an axis' thrust that its force loop may use; the rest of shared thrusters is left to the moments."""
    moment_share: float = 0.95
    """Part of an axis' greatest moment that its loop may use."""
    current_time_constant_s: float = 2.0
    """Smoothing of the measured water velocity for feed-forward."""

    def __post_init__(self) -> None:
        """All are positive, shares at most 1."""
        for name in (
            "surge_acceleration_m_s2",
            "sway_acceleration_m_s2",
            "max_heave_m_s",
            "max_heading_error_rad",
            "integral_zone_rad",
            "max_speed_error_m_s",
            "force_share",
            "moment_share",
            "current_time_constant_s",
        ):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"control.autopilot.{name}", getattr(self, name), "a value above 0")
        for name in ("force_share", "moment_share"):
            if getattr(self, name) > 1.0:
                raise ConfigError(f"control.autopilot.{name}", getattr(self, name), "a share of at most 1")


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
    """Integrals (wrench units), shaped speed references (m/s) and smoothed current (m/s, world axes).

    Integrals come in the order surge, sway, heave, pitch, heading, and roll where it is controlled. `current_m_s` is
    None before the first sample.
    """

    integrals: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    references_m_s: Vector = (0.0, 0.0, 0.0)
    current_m_s: Vector | None = None


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
        self.gains: AutopilotGains = design_gains(vehicle, cfg.design, dt_s)
        self._cfg = cfg
        self._dt_s = dt_s
        self._smoothing = 1.0 - math.exp(-dt_s / cfg.current_time_constant_s)
        names, rows = ("surge", "sway", "heave", "pitch", "heading", "roll"), (0, 1, 2, 4, 5, 3)
        count = 5 if self.gains.roll is None else 6
        self._rows = rows[:count]
        self._loops = tuple(self.gains.loops[name].gains for name in names[:count])
        self._depth_gain = self.gains.depth.gains.kp
        thrusters = [index for index, actuator in enumerate(vehicle.actuators) if actuator.kind == "thruster"]
        wrenches = vehicle.thruster_wrenches_body[:, thrusters]
        reach = np.abs(wrenches).sum(axis=1).tolist()
        # A propeller that gives surge alone may be used up; thrusters that also serve the moments may not.
        alone = np.abs(wrenches[1:, np.abs(wrenches[0]) > 1e-9]).max(initial=0.0) < 1e-9
        shares = [1.0 if alone else cfg.force_share, cfg.force_share, cfg.force_share, *[cfg.moment_share] * 3]
        self.limits = tuple(share * reach[row] for share, row in zip(shares, self._rows, strict=False))
        self._net_weight_n = vehicle.mass_kg * 9.81 - vehicle.buoyancy_n
        self._drag = [
            (
                row,
                column,
                float(vehicle.linear_damping_body[row, column]),
                float(vehicle.quadratic_damping_body[row, column]),
                float(vehicle.lift_damping_body[row, column]),
            )
            for row in range(6)
            for column in range(3)
            if vehicle.linear_damping_body[row, column] != 0.0
            or vehicle.quadratic_damping_body[row, column] != 0.0
            or vehicle.lift_damping_body[row, column] != 0.0
        ]
        self._mass = tuple(np.diag(vehicle.rigid_body_mass_body + vehicle.added_mass_body)[:3].tolist())
        added = vehicle.added_mass_body
        self._added_mass = tuple(float(added[row, column]) for row in range(3) for column in range(3))

    def initial_state(self) -> AutopilotState:
        """At rest, integrals empty."""
        return AutopilotState(integrals=(0.0,) * len(self._loops))

    def step(
        self, state: AutopilotState, setpoint: AutopilotSetpoint, proprioception: Proprioception
    ) -> tuple[Array, AutopilotState]:
        """Wrench (6,) in body axes, N and N m, and the next state."""
        return self.advance(state, setpoint, read_senses(proprioception))

    def advance(
        self, state: AutopilotState, setpoint: AutopilotSetpoint, senses: Senses
    ) -> tuple[Array, AutopilotState]:
        """As `step`, from unpacked senses."""
        cfg, dt_s = self._cfg, self._dt_s
        world = turn(senses.level, senses.yaw_rad)
        current = self._current(state.current_m_s, senses, world)
        measured = senses.water_m_s if setpoint.through_water else senses.ground_m_s

        heave = setpoint.heave_m_s
        if setpoint.depth_m is not None:
            heave = _clip(self._depth_gain * (senses.depth_m - setpoint.depth_m), cfg.max_heave_m_s)
        before = state.references_m_s
        now = rotate(senses.level, measured)
        references = (
            self._shape(before[0], setpoint.surge_m_s, now[0], cfg.surge_acceleration_m_s2),
            self._shape(before[1], setpoint.sway_m_s, now[1], cfg.sway_acceleration_m_s2),
            self._shape(before[2], heave, now[2], cfg.sway_acceleration_m_s2),
        )
        # Level heading frame to body: the same rotation without its yaw.
        level = senses.level
        wanted = rotate_back(level, references)
        through_water = wanted
        if not setpoint.through_water:
            drift = rotate_back(world, current)
            through_water = (wanted[0] - drift[0], wanted[1] - drift[1], wanted[2] - drift[2])
        feed = self._balance(through_water)
        surge_bound, sway_bound = cfg.surge_acceleration_m_s2, cfg.sway_acceleration_m_s2
        push = rotate_back(
            level,
            (
                self._mass[0] * _clip((references[0] - before[0]) / dt_s, surge_bound),
                self._mass[1] * _clip((references[1] - before[1]) / dt_s, sway_bound),
                self._mass[2] * _clip((references[2] - before[2]) / dt_s, sway_bound),
            ),
        )
        lift = rotate_back(level, (0.0, 0.0, self._net_weight_n))

        bound = cfg.max_heading_error_rad
        pitch_error = _clip(math.remainder(setpoint.pitch_rad - senses.pitch_rad, math.tau), bound)
        heading_error = _clip(math.remainder(setpoint.heading_rad - senses.yaw_rad, math.tau), bound)
        p, q, r = senses.rate_rad_s
        errors = (
            wanted[0] - measured[0],
            wanted[1] - measured[1],
            wanted[2] - measured[2],
            pitch_error,
            heading_error,
            _clip(setpoint.roll_rad - senses.roll_rad, bound),
        )
        rates = (0.0, 0.0, 0.0, q, r - setpoint.turn_rad_s, p)
        feeds = (
            feed[0] + lift[0] + push[0],
            feed[1] + lift[1] + push[1],
            feed[2] + lift[2] + push[2],
            feed[4],
            feed[5],
            feed[3],
        )
        wrench = np.zeros(6)
        integrals: list[float] = []
        for axis, row in enumerate(self._rows):
            output, integral = pid_step(
                self._loops[axis],
                state.integrals[axis],
                errors[axis],
                rates[axis],
                feeds[axis],
                self.limits[axis],
                dt_s,
            )
            wrench[row] = output
            turning = axis >= 3 and abs(errors[axis]) > cfg.integral_zone_rad
            integrals.append(state.integrals[axis] if turning else integral)
        return wrench, AutopilotState(tuple(integrals), references, current)

    def settle(self, state: AutopilotState, wanted: Array, achieved: Array) -> AutopilotState:
        """Anti-windup for what allocation could not give: İ = (τ_achieved − τ_wanted) k_i/k_p (back-calculation)."""
        missing: list[float] = (achieved - wanted).tolist()
        if max(missing) < 1e-6 and min(missing) > -1e-6:
            return state
        corrected = [
            integral + self._dt_s * missing[row] * gains.ki / max(gains.kp, 1e-9)
            for integral, row, gains in zip(state.integrals, self._rows, self._loops, strict=True)
        ]
        return AutopilotState(tuple(corrected), state.references_m_s, state.current_m_s)

    def _shape(self, reference: float, target: float, measured: float, acceleration_m_s2: float) -> float:
        """Next speed reference: towards the target at a bounded rate, not far from the measured speed."""
        moved = reference + _clip(target - reference, acceleration_m_s2 * self._dt_s)
        return measured + _clip(moved - measured, self._cfg.max_speed_error_m_s)

    def _current(self, smoothed: Vector | None, senses: Senses, world: Rows) -> Vector:
        """Current in world axes: ground minus water velocity, smoothed."""
        ground, water = senses.ground_m_s, senses.water_m_s
        now = rotate(world, (ground[0] - water[0], ground[1] - water[1], ground[2] - water[2]))
        if smoothed is None:
            return now
        k = self._smoothing
        return (
            smoothed[0] + k * (now[0] - smoothed[0]),
            smoothed[1] + k * (now[1] - smoothed[1]),
            smoothed[2] + k * (now[2] - smoothed[2]),
        )

    def _balance(self, velocity: Vector) -> list[float]:
        """Wrench that balances drag, lift and Munk moment at a steady velocity through the water without rotation."""
        wrench = [0.0] * 6
        speed = abs(velocity[0])
        for row, column, linear, quadratic, lift in self._drag:
            part = velocity[column]
            wrench[row] -= (linear + quadratic * abs(part) + lift * speed) * part
        m = self._added_mass
        x, y, z = velocity
        momentum = (
            m[0] * x + m[1] * y + m[2] * z,
            m[3] * x + m[4] * y + m[5] * z,
            m[6] * x + m[7] * y + m[8] * z,
        )
        munk = cross(velocity, momentum)
        wrench[3] += munk[0]
        wrench[4] += munk[1]
        wrench[5] += munk[2]
        return wrench


def _clip(value: float, bound: float) -> float:
    return bound if value > bound else -bound if value < -bound else value
