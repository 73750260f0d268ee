"""The inner loop of the simulator: MuJoCo's step with the water around it, compiled, for several steps at a time.

MuJoCo integrates M_RB, rigid-body Coriolis, weight and contacts. What is added here: added mass M_A into the mass
matrix itself (so that contacts feel it), the forces −C_A(ν_r) ν_r − D(ν_r) ν_r, buoyancy, and actuators with their lag
and power, each as far as it is in the water (`immersion`). Called from Python they would cost four times as much.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.rotations import rotation_of_quat_wxyz
from auvdock.numeric.scalars import cross
from auvdock.sim.mj import c_function

__all__ = [
    "MOTION",
    "ROW",
    "add_mass",
    "advance",
    "blow",
    "flow",
    "hydraulic_power_w",
    "is_absurd",
    "keep",
    "motion",
    "respond",
    "wrench",
]

ROW = 14
"""Numbers in a row of the history before the command: index of the step, qpos (7), qvel (6)."""
MOTION = 34
"""Numbers that `motion` gives."""
_MAX_SPEED_M_S = 10.0
_MAX_RATE_RAD_S = 50.0
_MAX_DISTANCE_M = 1000.0
_mj_step1, _mj_factor_mass, _mj_step2 = c_function("mj_step1"), c_function("mj_factorM"), c_function("mj_step2")


@compiled
def advance(
    model: int,
    data: int,
    steps: int,
    done: int,
    qpos: Array,
    qvel: Array,
    rotation: Array,
    mass: Array,
    applied: Array,
    constraint: Array,
    command: Array,
    state: Array,
    actuators: Array,
    weights: Array,
    added: Array,
    current: Array,
    gust: Array,
    noise: Array,
    constants: Array,
    immersion: Array,
    totals: Array,
    history: Array,
    moving: Array,
) -> int:
    """Make up to `steps` physics steps; fewer if something happens in one of them that has to be looked at.

    Each step: `mj_step1`, M_A into `mass`, `mj_factorM`, the water's forces into `applied`, `mj_step2`. It is the last
    if anything touches the vehicle, if the watched point has come to where the dock watches every step, if the vehicle
    is so high that it may leave the water, or if the state is absurd.

    Args:
        model: address of the `mjModel`.
        data: address of the `mjData`.
        steps: how many steps, 1 or more.
        done: steps made since the episode began.
        qpos: (7,) position and quaternion wxyz; of `data`, as are the next five.
        qvel: (6,) velocity in the world frame and angular velocity in the body frame.
        rotation: (3, 3) body to world.
        mass: (21,) lower triangle of the free joint's mass matrix, row by row.
        applied: (6,) generalised force.
        constraint: (3,) net force of contacts and latch.
        command: (n,) actuator commands.
        state: (n,) states of the actuators, advanced in place.
        actuators: (4, n) `Actuators.table`.
        weights: (12 + k, 21 + n) `Hydrodynamics.weights`.
        added: (6, 6) M_A.
        current: (6,) `Ocean.current`.
        gust: (2,) present gust in m/s, advanced in place.
        noise: (m, 2) normal numbers that drive it, a row a step, m at least `steps`; (0, 2) where there are no gusts.
        constants: (12,) displaced mass in kg, buoyancy in N, length of a step in s; the watched point's x in the body
            frame and the half space (3 for its normal, 1 for its offset) in which the dock watches nothing; the depth
            of the origin in m from which all of the vehicle is under water; where the episode began (3).
        immersion: (5 + n,) `immersion.immerse` of the present state.
        totals: (2,) hydraulic work in J and path length in m, summed up in place.
        history: (h, 14 + n) ring of the last steps: index of the step, state before it, command; and behind them the
            state after the last one that ended in a sane state.
        moving: (34,) takes `motion` after the last step.

    Returns:
        Steps made; 0 if the state was absurd to begin with, −1 − i if command i is not a number.
    """
    for i in range(len(command)):
        if np.isnan(command[i]):
            return -1 - i
    dt_s = constants[2]
    water, acceleration = np.zeros(3), np.zeros(2)
    speeds = np.empty(len(weights) - 12)
    origin = constants[9:12]
    if is_absurd(qpos, qvel, origin):  # somebody wrote to the data
        return 0
    made = 0
    while made < steps:
        keep(history, done + made, qpos, qvel)
        row = history[(done + made) % len(history)]
        for i in range(len(command)):
            row[ROW + i] = command[i]
        respond(state, command, actuators)
        _mj_step1(model, data)
        flow(qpos[2], current, gust, water)
        if len(noise) > 0:
            blow(current, noise[made], dt_s, gust, acceleration)
        wrench(rotation, qvel, water, acceleration, state, actuators, weights, constants, immersion, applied, speeds)
        add_mass(mass, rotation, added, immersion[0])
        _mj_factor_mass(model, data)
        path_m = math.sqrt(qvel[0] ** 2 + qvel[1] ** 2 + qvel[2] ** 2) * dt_s
        _mj_step2(model, data)
        totals[0] += hydraulic_power_w(state, speeds, actuators, immersion[5:]) * dt_s
        totals[1] += path_m
        made += 1
        if constraint[0] != 0.0 or constraint[1] != 0.0 or constraint[2] != 0.0 or qpos[2] > -constants[8]:
            break
        if is_absurd(qpos, qvel, origin):
            break
        reach = constants[3]
        ahead = rotation_of_quat_wxyz(qpos[3], qpos[4], qpos[5], qpos[6])
        height = constants[4] * (qpos[0] + reach * ahead[0][0])
        height += constants[5] * (qpos[1] + reach * ahead[1][0])
        height += constants[6] * (qpos[2] + reach * ahead[2][0])
        if height <= constants[7]:
            break
    motion(qpos, qvel, current, gust, moving)
    if not is_absurd(qpos, qvel, origin):
        keep(history, done + made, qpos, qvel)
    return made


@compiled
def keep(history: Array, index: int, qpos: Array, qvel: Array) -> None:
    """Put the state (7,), (6,) before step `index` into the ring (h, 14 + n)."""
    row = history[index % len(history)]
    row[0] = index
    for i in range(7):
        row[1 + i] = qpos[i]
    for i in range(6):
        row[8 + i] = qvel[i]


@compiled
def is_absurd(qpos: Array, qvel: Array, origin: Array) -> bool:
    """True unless the state is finite, slower than 10 m/s and 50 rad/s, and within 1 km of where the episode began.

    Args:
        qpos: (7,) position and quaternion wxyz.
        qvel: (6,) linear and angular velocity.
        origin: (3,) where the episode began.
    """
    length2, speed2, rate2 = 0.0, 0.0, 0.0
    for i in range(3):
        length2 += (qpos[i] - origin[i]) ** 2
        speed2 += qvel[i] * qvel[i]
        rate2 += qvel[3 + i] * qvel[3 + i]
    norm2 = qpos[3] * qpos[3] + qpos[4] * qpos[4] + qpos[5] * qpos[5] + qpos[6] * qpos[6]
    # Written as what must hold, so that a NaN anywhere answers True.
    return not (
        length2 < _MAX_DISTANCE_M**2 and speed2 < _MAX_SPEED_M_S**2 and rate2 < _MAX_RATE_RAD_S**2 and 0.5 < norm2 < 2.0
    )


@compiled
def flow(z_world_m: float, current: Array, gust: Array, water: Array) -> None:
    """Velocity of the water at a height, sheared with depth: (1 + shear × height above the mouth) × mean + gust.

    Args:
        z_world_m: height, 0 at the surface, negative below.
        current: (6,) `Ocean.current`.
        gust: (2,) horizontal, world frame, m/s.
        water: (3,) takes the velocity in the world frame in m/s.
    """
    factor = 1.0
    if current[2] != 0.0:
        factor = max(0.0, 1.0 + current[2] * (z_world_m + current[3]))
    water[0], water[1], water[2] = factor * current[0] + gust[0], factor * current[1] + gust[1], 0.0


@compiled
def blow(current: Array, noise: Array, dt_s: float, gust: Array, acceleration: Array) -> None:
    """Advance the gust by one step: g[k+1] = e^(−dt/T) g[k] + σ √(1 − e^(−2 dt/T)) n[k], per axis.

    Args:
        current: (6,) `Ocean.current`.
        noise: (2,) normal numbers n[k].
        dt_s: length of the step.
        gust: (2,) m/s, advanced in place.
        acceleration: (2,) takes its mean acceleration over the step in m/s².
    """
    for axis in range(2):
        blown = current[4] * gust[axis] + current[5] * noise[axis]
        acceleration[axis] = (blown - gust[axis]) / dt_s
        gust[axis] = blown


@compiled
def motion(qpos: Array, qvel: Array, current: Array, gust: Array, out: Array) -> None:
    """What follows from the state of a free body in moving water.

    Args:
        qpos: (7,) position and quaternion wxyz.
        qvel: (6,) velocity in the world frame, angular velocity in the body frame.
        current: (6,) `Ocean.current`.
        gust: (2,) horizontal, world frame, m/s.
        out: (34,) takes the pose of the body in the world (4 × 4), roll, pitch and yaw, velocity of the water in the
            world frame, ν over ground and ν relative to the water (6 each, body axes), m/s and rad/s.
    """
    for i in range(MOTION):
        out[i] = 0.0
    rows = rotation_of_quat_wxyz(qpos[3], qpos[4], qpos[5], qpos[6])
    for i in range(3):
        out[4 * i], out[4 * i + 1], out[4 * i + 2] = rows[i]
    out[3], out[7], out[11], out[15] = qpos[0], qpos[1], qpos[2], 1.0
    out[16], out[18] = math.atan2(out[9], out[10]), math.atan2(out[4], out[0])
    out[17] = -math.asin(max(-1.0, min(1.0, out[8])))
    water = np.empty(3)
    flow(qpos[2], current, gust, water)
    for i in range(3):
        out[19 + i] = water[i]
        for j in range(3):
            out[22 + i] += qvel[j] * out[4 * j + i]
            out[28 + i] += (qvel[j] - water[j]) * out[4 * j + i]
        out[25 + i] = out[31 + i] = qvel[3 + i]


@compiled
def respond(state: Array, command: Array, actuators: Array) -> None:
    """Advance the actuators' states (n,) by one step: clip to [-1, 1], 0 inside the dead band, then τ ẋ + x = c.

    Args:
        state: (n,) states, advanced in place.
        command: (n,) commands, no NaN among them.
        actuators: (4, n) `Actuators.table`.
    """
    for i in range(len(state)):
        value = min(max(command[i], -1.0), 1.0)
        if -actuators[1, i] < value < actuators[1, i]:
            value = 0.0
        state[i] += actuators[0, i] * (value - state[i])


@compiled
def hydraulic_power_w(state: Array, speeds: Array, actuators: Array, shares: Array) -> float:
    """Hydraulic power of the thrusters at their advance speeds (k,) in m/s, each along its thrust axis.

    Actuator-disc theory (Rankine and Froude): P = ½ |T| (V + √(V² + 2 |T| / (ρ A))) with V the advance speed in the
    direction of the thrust; so a hovering thruster costs power too.

    Args:
        state: (n,) states.
        speeds: (k,) advance speeds of the thrusters, in the order of the actuators.
        actuators: (4, n) `Actuators.table`.
        shares: (n,) share of each actuator that is under water.
    """
    power, k = 0.0, 0
    for i in range(len(state)):
        if actuators[2, i] < 0.0:
            continue
        thrust = abs(state[i]) * actuators[2, i] * shares[i]
        speed = speeds[k] if state[i] > 0.0 else -speeds[k]
        power += 0.5 * thrust * (speed + math.sqrt(speed * speed + actuators[3, i] * thrust))
        k += 1
    return power


@compiled
def add_mass(rows: Array, rotation: Array, added: Array, share: float) -> None:
    """Add s T M_A Tᵀ with T = diag(R, 1), M_A in a free joint's coordinates, to its mass matrix.

    A free joint's velocity is (linear in the world frame, angular in the body frame).

    Args:
        rows: (21,) lower triangle of the mass matrix, row by row.
        rotation: (3, 3) R, body to world.
        added: (6, 6) M_A.
        share: s, of the hull's volume that is under water.
    """
    half, whole = np.empty((6, 6)), np.empty((6, 6))
    for i in range(3):
        for j in range(6):
            half[i, j] = rotation[i, 0] * added[0, j] + rotation[i, 1] * added[1, j] + rotation[i, 2] * added[2, j]
    for i in range(3, 6):
        for j in range(6):
            half[i, j] = added[i, j]
    for i in range(6):
        a, b, c = half[i, 0], half[i, 1], half[i, 2]
        for j in range(3):
            whole[i, j] = a * rotation[j, 0] + b * rotation[j, 1] + c * rotation[j, 2]
        for j in range(3, 6):
            whole[i, j] = half[i, j]
    place = 0
    for i in range(6):
        for j in range(i + 1):
            rows[place] += share * whole[i, j]
            place += 1


@compiled
def wrench(
    rotation: Array,
    velocity: Array,
    water: Array,
    gust: Array,
    state: Array,
    actuators: Array,
    weights: Array,
    constants: Array,
    immersion: Array,
    force: Array,
    speeds: Array,
) -> None:
    """The water's generalised force on the free joint, by `Hydrodynamics`' one matrix product.

    Where a share s of the hull is under water, all of it is taken s times, but each actuator by its own share; buoyancy
    acts in the middle of what is immersed. Added mass that grows is met at rest and asks for its momentum, −ṡ M_A ν_r
    (von Kármán 1929); what falls off keeps its own and asks for none: both lose kinetic energy, ½ |ṡ| ν_rᵀ M_A ν_r.

    Args:
        rotation: (3, 3) R, body to world.
        velocity: (6,) of the body's origin over ground in the world frame in m/s, and p, q, r in rad/s.
        water: (3,) velocity of the water, world frame, m/s.
        gust: (2,) horizontal acceleration of the water, world frame, m/s².
        state: (n,) states of the actuators in [-1, 1].
        actuators: (4, n) `Actuators.table`; says which of them are fins.
        weights: (12 + k, 21 + n) `Hydrodynamics.weights`.
        constants: displaced mass in kg and buoyancy in N first.
        immersion: (5 + n,) `immersion.immerse`.
        force: (6,) takes the force in the world frame in N and the moment about the origin in the body frame in N m.
        speeds: (k,) takes the thrusters' advance speeds in m/s.
    """
    z = np.empty(weights.shape[1])
    for i in range(3):
        z[i] = 0.0
        for j in range(3):
            z[i] += rotation[j, i] * (velocity[j] - water[j])
        z[3 + i] = velocity[3 + i]
        z[18 + i] = rotation[0, i] * gust[0] + rotation[1, i] * gust[1]
    u, v, w, p, q, r = z[0], z[1], z[2], z[3], z[4], z[5]
    s = abs(u)
    for i in range(6):
        z[6 + i] = z[i] * abs(z[i])
        z[12 + i] = s * z[i]
    turn = cross(p, q, r, u, v, w)
    for i in range(3):
        z[18 + i] += turn[i]
    for i in range(len(state)):
        z[21 + i] = state[i] * immersion[5 + i]
        if actuators[2, i] < 0.0:
            z[21 + i] *= u * s  # a fin's force grows with the square of the speed
    out = np.zeros(len(weights))
    for i in range(len(out)):
        for j in range(21):
            out[i] += weights[i, j] * z[j]
        if i < 12:
            out[i] *= immersion[0]
        for j in range(21, len(z)):
            out[i] += weights[i, j] * z[j]
    px, py, pz, hx, hy, hz = out[6], out[7], out[8], out[9], out[10], out[11]
    # −C_A(ν_r) ν_r = (p × ω, p × v + h × ω) with the added momenta p, h, s times M_A ν_r (Fossen 2011, equation 6.43).
    fx, fy, fz = out[0] + py * r - pz * q, out[1] + pz * p - px * r, out[2] + px * q - py * p
    mx = out[3] + py * w - pz * v + hy * r - hz * q
    my = out[4] + pz * u - px * w + hz * p - hx * r
    mz = out[5] + px * v - py * u + hx * q - hy * p
    if immersion[0] < 1.0:
        lift, arm = constants[1], immersion[2:5]
        tilt = cross(arm[0], arm[1], arm[2], rotation[2, 0], rotation[2, 1], rotation[2, 2])
        mx, my, mz = mx + lift * tilt[0], my + lift * tilt[1], mz + lift * tilt[2]
        grown = immersion[1] / max(immersion[0], 1e-9)
        fx, fy, fz = fx - grown * px, fy - grown * py, fz - grown * pz
        mx, my, mz = mx - grown * hx, my - grown * hy, mz - grown * hz
    for i in range(3):
        force[i] = rotation[i, 0] * fx + rotation[i, 1] * fy + rotation[i, 2] * fz
    force[0] += immersion[0] * constants[0] * gust[0]
    force[1] += immersion[0] * constants[0] * gust[1]
    force[2] += immersion[0] * constants[1]
    force[3], force[4], force[5] = mx, my, mz
    for k in range(len(speeds)):
        speeds[k] = out[12 + k]
