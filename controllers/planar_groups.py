"""Thrust allocation of groups of actuators that act on at most two axes: in closed form, compiled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records

__all__ = [
    "Member",
    "PlanarGroup",
    "add_planar",
    "allocate_planar",
    "leave_dead_band",
    "reach_along",
    "solve_planar",
]

_TINY = 1e-9


@dataclass(frozen=True)
class Member(Record):
    """An actuator in its group."""

    actuator: int
    """Which of the vehicle's."""
    effect_x: float
    """Its wrench on the group's first axis at command 1; of a fin at u |u| = 1."""
    effect_y: float
    """On the second, 0 if there is none."""
    inverse_weight: float
    """1 over the cost of its squared command."""
    is_fin: bool


@dataclass(frozen=True, eq=False)
class PlanarGroup(Record):
    """A group of at most two axes, and without members one of more axes, which is solved elsewhere.

    With at most two axes the closed form needs B W⁻¹ Bᵀ = G_thrusters + (u |u|)² G_fins, symmetric 2 × 2.
    """

    first: int
    """First of its members."""
    end: int
    """Last but one."""
    row_x: int
    """First row of the wrench."""
    row_y: int
    """Second row; the first again if there is no second."""
    thrusters: Annotated[Array, 3]
    """Upper triangle of G_thrusters: xx, xy, yy; yy is 1 if there is no second row."""
    fins: Annotated[Array, 3]
    """Upper triangle of G_fins."""


@compiled
def allocate_planar(
    values: Array,
    achieved: Array,
    reached: BoolArray,
    groups: Records[PlanarGroup],
    members: Records[Member],
    dead_band: Array,
    wrench: Array,
    fin_effect: float,
    moments_first: bool,
) -> bool:
    """All groups of at most two axes with at most one redundant actuator.

    Each gives its part of the wrench, or the longest part of it within reach.

    Args:
        values: (n,) takes their commands, beyond the dead band; 0 for the other actuators.
        achieved: (6,) of zeros; takes the wrench that they give, dead band apart.
        reached: (g,) takes whether each group is such.
        groups: (g,) all of the vehicle.
        members: (m,) of the planar ones.
        dead_band: (n,) of the actuators.
        wrench: (6,) wanted.
        fin_effect: u |u|.
        moments_first: a group out of reach gives its moments in full and as much of its forces as is left.

    Returns:
        True if all groups are such.
    """
    for column in range(len(values)):
        values[column] = 0.0
    complete = True
    for index in range(len(groups)):
        group = groups[index]
        mine = members[group.first : group.end]
        commands = np.empty(len(mine))
        solved = len(mine) > 0 and solve_planar(group, mine, wrench, fin_effect, commands)
        if solved and not _can_give(commands):
            solved = _shorten(group, mine, wrench, fin_effect, moments_first, commands)
        reached[index] = solved
        if not solved:
            complete = False
            continue
        add_planar(group, mine, commands, fin_effect, achieved)
        for member in range(len(mine)):
            column = mine[member].actuator
            values[column] = leave_dead_band(commands[member], dead_band[column])
    return complete


@compiled
def solve_planar(
    group: PlanarGroup, members: Records[Member], wrench: Array, fin_effect: float, commands: Array
) -> bool:
    """Commands W⁻¹ Bᵀ (B W⁻¹ Bᵀ)⁻¹ τ of a planar group, into `commands`; False where the inverse is ill-conditioned."""
    square, thrusters, fins = fin_effect * fin_effect, group.thrusters, group.fins
    a, b, d = thrusters[0] + square * fins[0], thrusters[1] + square * fins[1], thrusters[2] + square * fins[2]
    determinant = a * d - b * b
    if not determinant > _TINY * a * d:
        return False
    x, y = wrench[group.row_x], wrench[group.row_y]
    m, n = (d * x - b * y) / determinant, (a * y - b * x) / determinant
    for i in range(len(members)):
        member = members[i]
        scale = fin_effect if member.is_fin else 1.0
        commands[i] = member.inverse_weight * (member.effect_x * m + member.effect_y * n) * scale
    return True


@compiled
def _can_give(commands: Array) -> bool:
    """True if all commands lie in [-1, 1]."""
    for command in commands:
        if not -1.0 <= command <= 1.0:
            return False
    return True


@compiled
def _shorten(
    group: PlanarGroup,
    members: Records[Member],
    wrench: Array,
    fin_effect: float,
    moments_first: bool,
    commands: Array,
) -> bool:
    """Put the commands of the longest part of the wrench within reach into `commands`.

    Returns:
        False if more than one actuator is redundant, which the closed form does not cover.
    """
    count, single = len(members), group.row_x == group.row_y
    null, has_null = np.zeros(count), count == (2 if single else 3)
    if count > (2 if single else 3):
        return False
    if has_null:
        # At right angles to the rows of B, so that it gives no wrench.
        effect = np.zeros((2, 3))
        for i in range(count):
            scale = fin_effect if members[i].is_fin else 1.0
            effect[0, i], effect[1, i] = members[i].effect_x * scale, members[i].effect_y * scale
        if single:
            effect[1, 2] = 1.0
        null[0] = effect[0, 1] * effect[1, 2] - effect[0, 2] * effect[1, 1]
        null[1] = effect[0, 2] * effect[1, 0] - effect[0, 0] * effect[1, 2]
        if not single:
            null[2] = effect[0, 0] * effect[1, 1] - effect[0, 1] * effect[1, 0]
        size2 = 0.0
        for part in null:
            size2 += part * part
        size = math.sqrt(size2)
        if not size > _TINY:
            return False
        for i in range(count):
            null[i] /= size
    base, part = np.zeros(count), np.zeros(6)
    if moments_first and group.row_x < 3 <= group.row_y:
        turning, push = np.empty(count), np.empty(count)
        for axis in range(3, 6):
            part[axis] = wrench[axis]
        solve_planar(group, members, part, fin_effect, push)
        reach = reach_along(base, push, null, turning)
        if reach == 1.0:
            for axis in range(3):
                part[axis], part[3 + axis] = wrench[axis], 0.0
            solve_planar(group, members, part, fin_effect, push)
            reach_along(turning, push, null, commands)
            return True
    push = commands.copy()
    reach_along(base, push, null, commands)
    return True


@compiled
def reach_along(base: Array, push: Array, null: Array, out: Array) -> float:
    """Go as far as the limits allow: commands c with |c| ≤ 1 and B c = B (base + λ push), the greatest λ ≤ 1.

    With one redundant actuator all solutions are base + λ push + t n, n spanning the null space: a linear programme in
    (λ, t), solved pair by pair of limits. Where n is 0, so is t.

    Args:
        base: (n,) within reach.
        push: (n,).
        null: (n,) unit commands that give no wrench; 0 without such.
        out: (n,) takes the commands.

    Returns:
        λ.
    """
    reach, count = 1.0, len(base)
    for i in range(count):
        if not abs(null[i]) > _TINY and abs(base[i] + reach * push[i]) > 1.0 and push[i] != 0.0:
            reach = max(0.0, (math.copysign(1.0, push[i]) - base[i]) / push[i])
    # Each other command bounds t: -w <= b + λ s + t <= w with w = 1/|n|, b = base/n, s = push/n.
    for i in range(count):
        if not abs(null[i]) > _TINY:
            continue
        for j in range(count):
            if abs(null[j]) > _TINY:
                room = 1.0 / abs(null[i]) + 1.0 / abs(null[j]) + base[i] / null[i] - base[j] / null[j]
                slope = push[j] / null[j] - push[i] / null[i]
                if slope * reach > room:
                    reach = max(0.0, room / slope)
    low, high = -math.inf, math.inf
    for i in range(count):
        if abs(null[i]) > _TINY:
            width, start, slope = 1.0 / abs(null[i]), base[i] / null[i], push[i] / null[i]
            low, high = max(low, -width - start - reach * slope), min(high, width - start - reach * slope)
    shift = min(max(0.0, low), high)
    for i in range(count):
        out[i] = min(1.0, max(-1.0, base[i] + reach * push[i] + shift * null[i]))
    return reach


@compiled
def add_planar(group: PlanarGroup, members: Records[Member], commands: Array, fin_effect: float, wrench: Array) -> None:
    """Add the wrench of a planar group's commands."""
    x = y = 0.0
    for i in range(len(members)):
        share = commands[i] * fin_effect if members[i].is_fin else commands[i]
        x += members[i].effect_x * share
        y += members[i].effect_y * share
    wrench[group.row_x] += x
    wrench[group.row_y] += y  # with one axis y is 0


@compiled
def leave_dead_band(command: float, band: float) -> float:
    """A command within the dead band would give nothing: 0 or the band's edge, whichever is nearer."""
    if not -band < command < band:
        return command
    return 0.0 if abs(command) <= 0.5 * band else math.copysign(band, command)
