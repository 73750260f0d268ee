"""The autopilot's arithmetic, compiled: speed references, feed-forward and the loops of all axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.motion import Motion
from auvdock.numeric.records import Record, Records
from auvdock.numeric.rotations import back, headed
from auvdock.numeric.scalars import cross, limited, within_pi

__all__ = ["ControlLaw", "Drag", "Loop", "LoopMemory", "Wanted", "agree", "back_calculate", "body_wrench", "pid_step"]

_PITCH, _YAW = 4, 5
"""Rows of a wrench."""


@dataclass(frozen=True, eq=False)
class Drag(Record):
    """What a hull feels at a steady velocity through the water without rotation; SI units, body axes."""

    linear: Annotated[Array, 6, 3]
    """Linear damping, by the velocity's component."""
    quadratic: Annotated[Array, 6, 3]
    """Damping by a component times its magnitude."""
    lift: Annotated[Array, 6, 3]
    """Damping by a component times the magnitude of surge."""
    added_kg: Annotated[Array, 3, 3]
    """Added mass of the velocity."""
    inertia_kg: Annotated[Array, 3]
    """Mass with added mass of surge, sway and heave."""


@dataclass(frozen=True, eq=False)
class ControlLaw(Record):
    """What of the autopilot holds for all axes."""

    dt_s: float
    """Control period."""
    smoothing: float
    """Weight of the current measured now."""
    surge_acceleration_m_s2: float
    """Greatest change of the surge reference."""
    sway_acceleration_m_s2: float
    """Greatest change of the sway and heave references."""
    max_speed_error_m_s: float
    """Greatest distance of a reference from the measured speed."""
    integral_zone_rad: float
    """Errors of an angle beyond this are not integrated."""
    max_angle_error_rad: float
    """Greatest error of an angle that counts."""
    net_weight_n: float
    """Weight less buoyancy."""
    drag: Drag
    """Of the hull."""


@dataclass(frozen=True)
class Loop(Record):
    """One axis' loop; surge, sway, heave, pitch, heading, and roll where it is controlled."""

    row: int
    """Of the wrench."""
    kp: float
    ki: float
    kd: float
    limit: float
    """Greatest output, N or N m."""


@dataclass
class LoopMemory(Record):
    """What the loops remember from period to period."""

    references_m_s: Annotated[Array, 3]
    """Shaped speed references in the level heading frame."""
    current_m_s: Annotated[Array, 3]
    """Smoothed current in world axes."""
    integrals: Annotated[Array, 6]
    """Integral parts in the order of the loops, N or N m."""
    sampled: bool
    """Whether there was a sample yet; the current means nothing before."""


class Wanted(NamedTuple):
    """Set-points; the speeds are those of the level heading frame, ahead, to port, up."""

    surge_m_s: float
    sway_m_s: float
    heave_m_s: float
    through_water: bool
    """Whether these speeds are through the water, not over ground."""
    roll_rad: float
    pitch_rad: float
    heading_rad: float
    turn_rad_s: float
    """Rate at which the heading set-point turns."""


@compiled
def body_wrench(
    wrench: Array,
    after: Records[LoopMemory],
    before: Records[LoopMemory],
    motion: Records[Motion],
    yaw_rad: float,
    setpoints: tuple[float, float, float, bool, float, float, float, float],
    law: Records[ControlLaw],
    loops: Records[Loop],
) -> None:
    """One period of the autopilot: τ = PID(error) + feed-forward for each axis.

    Args:
        wrench: (6,) of zeros; takes the wrench in body axes in N and N m.
        after: (1,) takes the next memory.
        before: (1,) the last one.
        motion: (1,) `Senses.motion`.
        yaw_rad: compass heading.
        setpoints: the fields of `Wanted`; a named tuple would cost half a microsecond more to hand over.
        law: (1,) what holds for all axes.
        loops: (n,) of the axes.
    """
    wanted, now, cfg, last, memory = Wanted(*setpoints), motion[0], law[0], before[0], after[0]
    level, ground, water, dt_s = now.R_level_body, now.ground_m_s, now.water_m_s, cfg.dt_s
    world = headed(yaw_rad, level)
    measured = water if wanted.through_water else ground
    references, current = np.empty(3), np.empty(3)
    # Current: ground minus water velocity, smoothed; the first sample counts in full.
    smoothing = cfg.smoothing if last.sampled else 1.0
    ahead, port, up = ground[0] - water[0], ground[1] - water[1], ground[2] - water[2]
    for i in range(3):
        flow = world[i, 0] * ahead + world[i, 1] * port + world[i, 2] * up
        current[i] = last.current_m_s[i] + smoothing * (flow - last.current_m_s[i])
    # References move towards the set-point at a bounded rate, not far from the measured speed.
    speeds, inertia = (wanted.surge_m_s, wanted.sway_m_s, wanted.heave_m_s), np.empty(3)
    for i in range(3):
        bound = cfg.surge_acceleration_m_s2 if i == 0 else cfg.sway_acceleration_m_s2
        speed = level[i, 0] * measured[0] + level[i, 1] * measured[1] + level[i, 2] * measured[2]
        reference = last.references_m_s[i]
        moved = reference + limited(speeds[i] - reference, bound * dt_s)
        references[i] = speed + limited(moved - speed, cfg.max_speed_error_m_s)
        inertia[i] = cfg.drag.inertia_kg[i] * limited((references[i] - reference) / dt_s, bound)
    aim, drift, push, weight = back(level, references), back(world, current), back(level, inertia), np.zeros(3)
    weight[2] = cfg.net_weight_n
    lift = back(level, weight)
    if wanted.through_water:
        drift = np.zeros(3)
    through = np.empty(3)
    for i in range(3):
        through[i] = aim[i] - drift[i]
    balance = _balance(through, cfg.drag)
    for axis in range(len(loops)):
        loop = loops[axis]
        feed, rate = balance[loop.row], 0.0
        if loop.row < 3:
            error = aim[axis] - measured[axis]
            feed += lift[axis]
            feed += push[axis]
        elif loop.row == _PITCH:
            error, rate = within_pi(wanted.pitch_rad - now.pitch_rad), now.rate_rad_s[1]
        elif loop.row == _YAW:
            error, rate = within_pi(wanted.heading_rad - yaw_rad), now.rate_rad_s[2] - wanted.turn_rad_s
        else:
            error, rate = wanted.roll_rad - now.roll_rad, now.rate_rad_s[0]
        is_turn = loop.row >= 3
        if is_turn:
            error = limited(error, cfg.max_angle_error_rad)
        integral = last.integrals[axis]
        output, candidate = pid_step(loop.kp, loop.ki, loop.kd, integral, error, rate, feed, loop.limit, dt_s)
        wrench[loop.row] = output
        memory.integrals[axis] = integral if is_turn and abs(error) > cfg.integral_zone_rad else candidate
    for i in range(3):
        memory.references_m_s[i], memory.current_m_s[i] = references[i], current[i]
    memory.sampled = True


@compiled
def agree(wanted: Array, achieved: Array) -> bool:
    """True if two wrenches (6,) agree to 1e-6 N and N m."""
    for i in range(6):
        if not -1e-6 < achieved[i] - wanted[i] < 1e-6:
            return False
    return True


@compiled
def back_calculate(
    after: Records[LoopMemory],
    before: Records[LoopMemory],
    wanted: Array,
    achieved: Array,
    loops: Records[Loop],
    dt_s: float,
) -> None:
    """Anti-windup: İ = (τ_achieved − τ_wanted) k_i/k_p (Åström and Hägglund 2006, section 3.5).

    Args:
        after: (1,) takes the next memory.
        before: (1,) the last one.
        wanted: (6,) wrench that the loops asked for.
        achieved: (6,) wrench that they got.
        loops: (n,) of the axes.
        dt_s: control period.
    """
    last, memory = before[0], after[0]
    for i in range(3):
        memory.references_m_s[i], memory.current_m_s[i] = last.references_m_s[i], last.current_m_s[i]
    memory.sampled = last.sampled
    for axis in range(len(loops)):
        loop = loops[axis]
        missing = achieved[loop.row] - wanted[loop.row]
        memory.integrals[axis] = last.integrals[axis] + dt_s * missing * loop.ki / max(loop.kp, 1e-9)


@compiled
def pid_step(
    kp: float,
    ki: float,
    kd: float,
    integral: float,
    error: float,
    rate: float,
    feed_forward: float,
    limit: float,
    dt_s: float,
) -> tuple[float, float]:
    """One step: τ = clip(k_p e + I + feed-forward − k_d ẏ, ± limit), İ = k_i e.

    The derivative acts on the measured rate ẏ, so a step of the set-point gives no kick. Anti-windup is conditional
    integration (Åström and Hägglund 2006, section 3.5): the integral stands still while the output is at its limit and
    the error would drive it further, and it never exceeds the limit itself.

    Args:
        kp: k_p.
        ki: k_i.
        kd: k_d.
        integral: integral part I so far, in the unit of the output.
        error: set-point minus measurement.
        rate: measured time derivative of the controlled quantity.
        feed_forward: output known beforehand.
        limit: greatest magnitude of the output.
        dt_s: period.

    Returns:
        The output and the new integral.
    """
    candidate = limited(integral + ki * error * dt_s, limit)
    wanted = kp * error + candidate + feed_forward - kd * rate
    if wanted > limit:
        return limit, candidate if error < 0.0 else integral
    if wanted < -limit:
        return -limit, candidate if error > 0.0 else integral
    return wanted, candidate


@compiled
def _balance(velocity: Array, drag: Drag) -> Array:
    """Wrench (6,) that balances drag, lift and Munk moment at a steady velocity (3,) through the water."""
    wrench, momentum = np.zeros(6), np.zeros(3)
    x, y, z = velocity[0], velocity[1], velocity[2]
    for row in range(6):
        for column in range(3):
            part = velocity[column]
            damping = drag.linear[row, column] + drag.quadratic[row, column] * abs(part)
            damping += drag.lift[row, column] * abs(x)
            wrench[row] -= damping * part
    for row in range(3):
        momentum[row] = drag.added_kg[row, 0] * x + drag.added_kg[row, 1] * y + drag.added_kg[row, 2] * z
    munk = cross(x, y, z, momentum[0], momentum[1], momentum[2])
    for axis in range(3):
        wrench[3 + axis] += munk[axis]
    return wrench
