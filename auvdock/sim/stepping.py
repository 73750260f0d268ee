"""The inner loop of the simulator: MuJoCo's step with the water around it, compiled, for several steps at a time.

MuJoCo integrates M_RB, rigid-body Coriolis, weight and contacts. What is added here: added mass M_A into the mass
matrix itself (so that contacts feel it), the forces −C_A(ν_r) ν_r − D(ν_r) ν_r, buoyancy, and actuators with their lag
and power, each as far as it is in the water (`immersion`). Called from Python they would cost four times as much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.numeric.rotations import rotation_of_quat_wxyz, turn_matrix
from auvdock.numeric.scalars import Vector, cross, halves
from auvdock.numeric.water import Water, advance_gust, water_velocity
from auvdock.sim.actuation import Actuator
from auvdock.sim.dock import Watch
from auvdock.sim.hydrodynamics import Hull
from auvdock.sim.mj import c_function

__all__ = [
    "FreeJoint",
    "Run",
    "Snapshot",
    "add_mass",
    "advance",
    "electrical_power_w",
    "hydraulic_power_w",
    "is_absurd",
    "record",
    "respond",
    "wrench",
]

_MAX_SPEED_M_S = 10.0
_MAX_RATE_RAD_S = 50.0
_MAX_DISTANCE_M = 1000.0
_mj_step1, _mj_factor_mass, _mj_step2 = c_function("mj_step1"), c_function("mj_factorM"), c_function("mj_step2")


class FreeJoint(NamedTuple):
    """The vehicle in MuJoCo's memory: its joint has six degrees of freedom.

    Attributes:
        model: address of the `mjModel`.
        data: address of the `mjData`, whose memory the arrays are.
        qpos: (7,) position and quaternion wxyz in the world.
        qvel: (6,) velocity in the world frame and angular velocity in the body frame.
        rotation: (3, 3) body to world.
        mass: (21,) lower triangle of the mass matrix, row by row.
        applied: (6,) generalised force: in the world frame in N, about the origin in the body frame in N m.
        constraint: (3,) net force of contacts and latch.
    """

    model: int
    data: int
    qpos: Array
    qvel: Array
    rotation: Array
    mass: Array
    applied: Array
    constraint: Array


@dataclass
class Run(Record):
    """An episode as the loop advances it."""

    dt_s: float
    """Length of a step."""
    watch: Watch
    """Where the dock has to see every step."""
    origin_m: Annotated[Array, 3]
    """Where the episode began, world frame."""
    steps: int
    """Made since then."""
    work_j: float
    """Hydraulic work of the thrusters since then."""
    electrical_j: float
    """Electrical work of those whose power was measured."""
    path_m: float
    """Length of the path since then."""


@dataclass
class Snapshot(Record):
    """The state before a step."""

    step: int
    """Index of the step."""
    qpos: Annotated[Array, 7]
    qvel: Annotated[Array, 6]


@compiled
def advance(
    joint: FreeJoint,
    steps: int,
    hull: Records[Hull],
    actuators: Records[Actuator],
    water: Records[Water],
    noise: Array,
    run: Records[Run],
    history: Records[Snapshot],
    commands: Array,
) -> int:
    """Make up to `steps` physics steps; fewer if something happens in one of them that has to be looked at.

    Each step: `mj_step1`, M_A into the mass, `mj_factorM`, the water's forces, `mj_step2`. It is the last if anything
    touches the vehicle, if the watched point has come to where the dock watches every step, if the vehicle is so high
    that it may leave the water, or if the state is absurd.

    Args:
        joint: the vehicle.
        steps: how many steps, 1 or more.
        hull: (1,) immersed as the present state has it.
        actuators: (n,) likewise, with their commands; their states are advanced in place.
        water: (1,) whose gust is advanced in place.
        noise: (m, 2) normal numbers that drive it, a row a step, m at least `steps`; (0, 2) where there are no gusts.
        run: (1,) advanced in place.
        history: (h,) ring of the states before the last steps, and after the last one that ended in a sane state.
        commands: (h, n) the actuators' commands in those steps.

    Returns:
        Steps made; 0 if the state was absurd to begin with, −1 − i if command i is not a number.
    """
    for i in range(len(actuators)):
        if np.isnan(actuators[i].command):
            return -1 - i
    qpos, qvel, constraint, now = joint.qpos, joint.qvel, joint.constraint, run[0]
    if is_absurd(qpos, qvel, run):  # somebody wrote to the data
        return 0
    made = 0
    while made < steps:
        record(history, now.steps, qpos, qvel)
        row = commands[now.steps % len(commands)]
        for i in range(len(actuators)):
            row[i] = actuators[i].command
        respond(actuators)
        _mj_step1(joint.model, joint.data)
        flow = water_velocity(water[0], qpos[2])
        if len(noise) > 0:
            advance_gust(water[0], noise[made], now.dt_s)
        wrench(joint.rotation, qvel, flow, water[0].gust_m_s2, hull[0], actuators, joint.applied)
        add_mass(joint.mass, joint.rotation, hull[0].added_mass, hull[0].immersed)
        _mj_factor_mass(joint.model, joint.data)
        path_m = math.sqrt(qvel[0] ** 2 + qvel[1] ** 2 + qvel[2] ** 2) * now.dt_s
        _mj_step2(joint.model, joint.data)
        now.work_j += hydraulic_power_w(actuators) * now.dt_s
        now.electrical_j += electrical_power_w(actuators) * now.dt_s
        now.path_m += path_m
        now.steps += 1
        made += 1
        touched = constraint[0] != 0.0 or constraint[1] != 0.0 or constraint[2] != 0.0
        if touched or qpos[2] > -hull[0].clearance_m or is_absurd(qpos, qvel, run):
            break
        if _is_watched(qpos, now.watch):
            break
    if not is_absurd(qpos, qvel, run):
        record(history, now.steps, qpos, qvel)
    return made


@compiled
def record(history: Records[Snapshot], step: int, qpos: Array, qvel: Array) -> None:
    """Put the state (7,), (6,) before a step into the ring (h,)."""
    row = history[step % len(history)]
    row.step = step
    for i in range(7):
        row.qpos[i] = qpos[i]
    for i in range(6):
        row.qvel[i] = qvel[i]


@compiled
def is_absurd(qpos: Array, qvel: Array, run: Records[Run]) -> bool:
    """True unless the state is finite, slower than 10 m/s and 50 rad/s, and within 1 km of where the episode began.

    Args:
        qpos: (7,) position and quaternion wxyz.
        qvel: (6,) linear and angular velocity.
        run: (1,) the episode.
    """
    length2, speed2, rate2, norm2, origin = 0.0, 0.0, 0.0, 0.0, run[0].origin_m
    for i in range(3):
        length2 += (qpos[i] - origin[i]) ** 2
        speed2 += qvel[i] * qvel[i]
        rate2 += qvel[3 + i] * qvel[3 + i]
    for i in range(4):
        norm2 += qpos[3 + i] * qpos[3 + i]
    # Written as what must hold, so that a NaN anywhere answers True.
    return not (
        length2 < _MAX_DISTANCE_M**2 and speed2 < _MAX_SPEED_M_S**2 and rate2 < _MAX_RATE_RAD_S**2 and 0.5 < norm2 < 2.0
    )


@compiled
def _is_watched(qpos: Array, watch: Watch) -> bool:
    """True where the dock has to see every step."""
    ahead = rotation_of_quat_wxyz(qpos[3:])
    height = watch.normal_world[0] * (qpos[0] + watch.reach_m * ahead[0][0])
    height += watch.normal_world[1] * (qpos[1] + watch.reach_m * ahead[1][0])
    height += watch.normal_world[2] * (qpos[2] + watch.reach_m * ahead[2][0])
    return height <= watch.offset_m


@compiled
def respond(actuators: Records[Actuator]) -> None:
    """Advance the actuators' states by one step: clip to [-1, 1], 0 inside the dead band, then τ ẋ + x = c.

    By a measured curve x follows the effort at c in place of c.

    Args:
        actuators: (n,) whose commands c are numbers; their states x are advanced in place.
    """
    for i in range(len(actuators)):
        actuator = actuators[i]
        value = min(max(actuator.command, -1.0), 1.0)
        if actuator.has_curve:
            value = _between(actuator.curve_command, actuator.curve_effort, value)
        elif -actuator.dead_band < value < actuator.dead_band:
            value = 0.0
        actuator.state += actuator.lag * (value - actuator.state)


@compiled
def _between(nodes: Array, values: Array, at: float) -> float:
    """A function (n,) that is straight between its growing nodes (n,), at a number within them."""
    low, high = 0, len(nodes) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= at:
            low = middle
        else:
            high = middle
    width = nodes[high] - nodes[low]
    return values[low] + (values[high] - values[low]) * ((at - nodes[low]) / width if width > 0.0 else 0.0)


@compiled
def electrical_power_w(actuators: Records[Actuator]) -> float:
    """Electrical power of those thrusters (n,) that have a curve, at their commands: as measured in still water."""
    power = 0.0
    for i in range(len(actuators)):
        actuator = actuators[i]
        if actuator.has_curve:
            power += _between(actuator.curve_command, actuator.curve_power_w, min(max(actuator.command, -1.0), 1.0))
    return power


@compiled
def hydraulic_power_w(actuators: Records[Actuator]) -> float:
    """Hydraulic power of the thrusters (n,) at their states and advance speeds, as far as they are under water.

    Actuator-disc theory (Rankine and Froude): P = ½ |T| (V + √(V² + 2 |T| / (ρ A))) with V the advance speed in the
    direction of the thrust; so a hovering thruster costs power too.
    """
    power = 0.0
    for i in range(len(actuators)):
        actuator = actuators[i]
        if actuator.is_fin:
            continue
        thrust = abs(actuator.state) * actuator.max_force_n * actuator.immersed
        speed = actuator.advance_m_s if actuator.state > 0.0 else -actuator.advance_m_s
        power += 0.5 * thrust * (speed + math.sqrt(speed * speed + actuator.disc_m_kg * thrust))
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
    turned = turn_matrix(added, rotation)
    place = 0
    for i in range(6):
        for j in range(i + 1):
            rows[place] += share * turned[i, j]
            place += 1


@compiled
def wrench(
    rotation: Array,
    velocity: Array,
    flow: Vector,
    gust_m_s2: Array,
    hull: Hull,
    actuators: Records[Actuator],
    force: Array,
) -> None:
    """The water's generalised force on the free joint; the equation is `Hull`'s.

    Where a share s of the hull is under water, all of it is taken s times, but each actuator by its own share; buoyancy
    acts in the middle of what is immersed. Added mass that grows is met at rest and asks for its momentum, −ṡ M_A ν_r
    (von Kármán 1929); what falls off keeps its own and asks for none: both lose kinetic energy, ½ |ṡ| ν_rᵀ M_A ν_r.

    Args:
        rotation: (3, 3) R, body to world.
        velocity: (6,) of the body's origin over ground in the world frame in m/s, and p, q, r in rad/s.
        flow: velocity of the water, world frame, m/s.
        gust_m_s2: (2,) horizontal acceleration of the water, world frame.
        hull: of the vehicle.
        actuators: (n,) with their states; take their advance speeds.
        force: (6,) takes the force in the world frame in N and the moment about the origin in the body frame in N m.
    """
    nu, moved, body, momentum = np.zeros(6), np.empty(3), np.zeros(6), np.zeros(6)
    for i in range(3):
        for j in range(3):
            nu[i] += rotation[j, i] * (velocity[j] - flow[j])
        nu[3 + i] = velocity[3 + i]
        moved[i] = rotation[0, i] * gust_m_s2[0] + rotation[1, i] * gust_m_s2[1]
    (u, v, w), (p, q, r) = halves(nu)
    turn = cross(p, q, r, u, v, w)
    for i in range(3):
        moved[i] += turn[i]
    for i in range(6):
        for j in range(6):
            body[i] += hull.linear_damping[i, j] * nu[j]
        for j in range(6):
            body[i] += hull.quadratic_damping[i, j] * (nu[j] * abs(nu[j]))
        for j in range(6):
            body[i] += hull.lift_damping[i, j] * (abs(u) * nu[j])
        for j in range(3):
            body[i] += hull.added_mass[i, j] * moved[j]
        for j in range(6):
            momentum[i] += hull.added_mass[i, j] * nu[j]
        body[i] *= hull.immersed
        momentum[i] *= hull.immersed
    for index in range(len(actuators)):
        actuator, speed = actuators[index], 0.0
        effect = actuator.state * actuator.immersed
        if actuator.is_fin:
            effect *= u * abs(u)  # a fin's force grows with the square of the speed
        for i in range(6):
            body[i] += actuator.wrench[i] * effect
            speed += actuator.advance[i] * nu[i]
        actuator.advance_m_s = speed
    # −C_A(ν_r) ν_r = (p × ω, p × v + h × ω) with the added momenta p, h, s times M_A ν_r (Fossen 2011, equation 6.43).
    (x, y, z), (k, m, n) = halves(body)
    (px, py, pz), (hx, hy, hz) = halves(momentum)
    x, y, z = x + py * r - pz * q, y + pz * p - px * r, z + px * q - py * p
    k = k + py * w - pz * v + hy * r - hz * q
    m = m + pz * u - px * w + hz * p - hx * r
    n = n + px * v - py * u + hx * q - hy * p
    if hull.immersed < 1.0:
        lift, arm = hull.buoyancy_n, hull.moment_m
        tilt = cross(arm[0], arm[1], arm[2], rotation[2, 0], rotation[2, 1], rotation[2, 2])
        k, m, n = k + lift * tilt[0], m + lift * tilt[1], n + lift * tilt[2]
        grown = hull.growth_1_s / max(hull.immersed, 1e-9)
        x, y, z = x - grown * px, y - grown * py, z - grown * pz
        k, m, n = k - grown * hx, m - grown * hy, n - grown * hz
    for i in range(3):
        force[i] = rotation[i, 0] * x + rotation[i, 1] * y + rotation[i, 2] * z
        force[3 + i] = (k, m, n)[i]
    force[0] += hull.immersed * hull.displaced_kg * gust_m_s2[0]
    force[1] += hull.immersed * hull.displaced_kg * gust_m_s2[1]
    force[2] += hull.immersed * hull.buoyancy_n
