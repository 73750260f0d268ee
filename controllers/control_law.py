"""The autopilot's arithmetic, compiled: speed references, feed-forward and the loops of all axes."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.motion import GROUND, LEVEL, PITCH, RATE, ROLL, WATER
from auvdock.numeric.rotations import back, headed
from auvdock.numeric.scalars import cross, limited, within_pi

__all__ = ["body_wrench", "near", "pid_step"]

# Places in the array of limits.
_SURGE_ACCELERATION, _SWAY_ACCELERATION, _MAX_SPEED_ERROR, _INTEGRAL_ZONE, _NET_WEIGHT, _DT, _MAX_ERROR = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
)


@compiled
def body_wrench(
    wrench: Array,
    memory: Array,
    state: tuple[float, ...],
    motion: Array,
    yaw_rad: float,
    surge_m_s: float,
    sway_m_s: float,
    heave_m_s: float,
    through_water: bool,
    pitch_rad: float,
    heading_rad: float,
    roll_rad: float,
    turn_rad_s: float,
    smoothing: float,
    limits: Array,
    loops: Array,
    hull: Array,
) -> None:
    """One period of the autopilot: τ = PID(error) + feed-forward for each axis.

    Args:
        wrench: (6,) of zeros; here goes the wrench in body axes in N and N m.
        memory: (6 + n,) here goes the next state.
        state: (6 + n,) speed references in the level heading frame in m/s, smoothed current in world axes in m/s,
            integrals of the n loops.
        motion: (20,) `Senses.motion`.
        yaw_rad: compass heading.
        surge_m_s: wanted speed ahead, level heading frame.
        sway_m_s: wanted speed to port.
        heave_m_s: wanted speed upwards.
        through_water: whether these speeds are through the water, not over ground.
        pitch_rad: set-point of the pitch.
        heading_rad: set-point of the heading.
        roll_rad: set-point of the roll.
        turn_rad_s: rate at which the heading set-point turns.
        smoothing: weight of the current measured now.
        limits: (7,) greatest change of the surge and of the sway and heave references in m/s², greatest distance of a
            reference from the measured speed in m/s, errors beyond which an angle is not integrated in rad, weight less
            buoyancy in N, period in s, greatest error of an angle that counts in rad.
        loops: (n, 5) row of the wrench, k_p, k_i, k_d, greatest output; surge, sway, heave, pitch, heading, and roll
            where it is controlled.
        hull: (22, 3) linear, quadratic and lift damping, six rows each, by the velocity's column; added mass of the
            velocity, three rows; mass with added mass of surge, sway and heave.
    """
    level = motion[LEVEL:].reshape(3, 3)
    world = headed(yaw_rad, level)
    ground, water = motion[GROUND:WATER], motion[WATER:LEVEL]
    measured = water if through_water else ground
    references, current = memory[:3], memory[3:6]
    # Current: ground minus water velocity, smoothed.
    ahead, port, up = ground[0] - water[0], ground[1] - water[1], ground[2] - water[2]
    for i in range(3):
        now = world[i, 0] * ahead + world[i, 1] * port + world[i, 2] * up
        current[i] = state[3 + i] + smoothing * (now - state[3 + i])
    # References move towards the set-point at a bounded rate, not far from the measured speed.
    dt_s = limits[_DT]
    inertia = np.empty(3)
    for i in range(3):
        target = surge_m_s if i == 0 else sway_m_s if i == 1 else heave_m_s
        bound = limits[_SURGE_ACCELERATION] if i == 0 else limits[_SWAY_ACCELERATION]
        now = level[i, 0] * measured[0] + level[i, 1] * measured[1] + level[i, 2] * measured[2]
        moved = state[i] + limited(target - state[i], bound * dt_s)
        references[i] = now + limited(moved - now, limits[_MAX_SPEED_ERROR])
        inertia[i] = hull[21, i] * limited((references[i] - state[i]) / dt_s, bound)
    wanted, drift, push, weight = back(level, references), back(world, current), back(level, inertia), np.zeros(3)
    weight[2] = limits[_NET_WEIGHT]
    lift = back(level, weight)
    if through_water:
        drift = np.zeros(3)
    balance = _balance(wanted[0] - drift[0], wanted[1] - drift[1], wanted[2] - drift[2], hull)
    for axis in range(len(loops)):
        row = int(loops[axis, 0])
        feed, rate = balance[row], 0.0
        if axis < 3:
            error = wanted[axis] - measured[axis]
            feed += lift[axis]
            feed += push[axis]
        elif axis == 3:
            error, rate = limited(within_pi(pitch_rad - motion[PITCH]), limits[_MAX_ERROR]), motion[RATE + 1]
        elif axis == 4:
            error = limited(within_pi(heading_rad - yaw_rad), limits[_MAX_ERROR])
            rate = motion[RATE + 2] - turn_rad_s
        else:
            error, rate = limited(roll_rad - motion[ROLL], limits[_MAX_ERROR]), motion[RATE]
        kp, ki, kd, limit = loops[axis, 1], loops[axis, 2], loops[axis, 3], loops[axis, 4]
        integral = state[6 + axis]
        output, after = pid_step(kp, ki, kd, integral, error, rate, feed, limit, dt_s)
        wrench[row] = output
        turning = axis >= 3 and abs(error) > limits[_INTEGRAL_ZONE]
        memory[6 + axis] = integral if turning else after


@compiled
def near(wanted: Array, achieved: Array) -> bool:
    """Whether two wrenches (6,) are the same to 1e-6 N and N m."""
    for i in range(6):
        if not -1e-6 < achieved[i] - wanted[i] < 1e-6:
            return False
    return True


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
def _balance(x: float, y: float, z: float, hull: Array) -> Array:
    """Wrench (6,) that balances drag, lift and Munk moment at a steady velocity through the water without rotation."""
    wrench, momentum = np.zeros(6), np.zeros(3)
    for row in range(6):
        for column in range(3):
            part = x if column == 0 else y if column == 1 else z
            drag = hull[row, column] + hull[6 + row, column] * abs(part) + hull[12 + row, column] * abs(x)
            wrench[row] -= drag * part
    for row in range(3):
        momentum[row] = hull[18 + row, 0] * x + hull[18 + row, 1] * y + hull[18 + row, 2] * z
    munk = cross(x, y, z, momentum[0], momentum[1], momentum[2])
    for axis in range(3):
        wrench[3 + axis] += munk[axis]
    return wrench
