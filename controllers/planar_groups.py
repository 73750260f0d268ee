"""Thrust allocation of groups of actuators that act on at most two axes: in closed form, compiled."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["add_planar", "beyond_dead_band", "least_planar", "longest", "planar_groups"]

_TINY = 1e-9


@compiled
def planar_groups(
    values: Array,
    achieved: Array,
    reached: Array,
    table: Array,
    members: Array,
    dead_band: Array,
    wrench: Array,
    fin_effect: float,
    moments_first: bool,
) -> bool:
    """All groups of at most two axes with at most one redundant actuator.

    Each gives its part of the wrench, or the longest part of it within reach.

    Args:
        values: (n,) here go their commands, beyond the dead band; 0 for the other actuators.
        achieved: (6,) of zeros; here goes the wrench that they give, dead band apart.
        reached: (g,) here goes 1 for each such group and 0 for the others.
        table: (g, 10) of each group: first and last but one of its members, its two rows, the upper triangles of its
            Gram matrices of thrusters and of fins; 0 for a group of more axes.
        members: (m, 5) actuator, its effect on the two rows, inverse weight, whether it is a fin.
        dead_band: (n,) of the actuators.
        wrench: (6,) wanted.
        fin_effect: u |u|.
        moments_first: a group out of reach gives its moments in full and as much of its forces as is left.

    Returns:
        Whether all groups are such.
    """
    for column in range(len(values)):
        values[column] = 0.0
    complete = True
    for index in range(len(table)):
        group = table[index]
        mine = members[int(group[0]) : int(group[1])]
        commands = np.empty(len(mine))
        solved = len(mine) > 0 and least_planar(group, mine, wrench, fin_effect, commands)
        if solved and not _within(commands):
            solved = _shorten(group, mine, wrench, fin_effect, moments_first, commands)
        reached[index] = 1.0 if solved else 0.0
        if not solved:
            complete = False
            continue
        add_planar(group, mine, commands, fin_effect, achieved)
        for member in range(len(mine)):
            column = int(mine[member, 0])
            values[column] = beyond_dead_band(commands[member], dead_band[column])
    return complete


@compiled
def least_planar(group: Array, members: Array, wrench: Array, fin_effect: float, commands: Array) -> bool:
    """Commands W⁻¹ Bᵀ (B W⁻¹ Bᵀ)⁻¹ τ of a planar group, into `commands`; False where the inverse is ill-conditioned."""
    square = fin_effect * fin_effect
    a, b, d = group[4] + square * group[7], group[5] + square * group[8], group[6] + square * group[9]
    determinant = a * d - b * b
    if not determinant > _TINY * a * d:
        return False
    x, y = wrench[int(group[2])], wrench[int(group[3])]
    m, n = (d * x - b * y) / determinant, (a * y - b * x) / determinant
    for i in range(len(members)):
        scale = fin_effect if members[i, 4] != 0.0 else 1.0
        commands[i] = members[i, 3] * (members[i, 1] * m + members[i, 2] * n) * scale
    return True


@compiled
def _within(commands: Array) -> bool:
    """Whether all commands are."""
    for command in commands:
        if not -1.0 <= command <= 1.0:
            return False
    return True


@compiled
def _shorten(
    group: Array, members: Array, wrench: Array, fin_effect: float, moments_first: bool, commands: Array
) -> bool:
    """Put the longest part within reach in the place of commands that are not; False with more redundancy."""
    count, single = len(members), group[2] == group[3]
    null, has_null = np.zeros(count), count == (2 if single else 3)
    if count > (2 if single else 3):
        return False
    if has_null:
        # At right angles to the rows of B, so that it gives no wrench.
        effect = np.zeros((2, 3))
        for i in range(count):
            scale = fin_effect if members[i, 4] != 0.0 else 1.0
            effect[0, i], effect[1, i] = members[i, 1] * scale, members[i, 2] * scale
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
    if moments_first and group[2] < 3 <= group[3]:
        turning, push = np.empty(count), np.empty(count)
        for axis in range(3, 6):
            part[axis] = wrench[axis]
        least_planar(group, members, part, fin_effect, push)
        reach = longest(base, push, null, turning)
        if reach == 1.0:
            for axis in range(3):
                part[axis], part[3 + axis] = wrench[axis], 0.0
            least_planar(group, members, part, fin_effect, push)
            longest(turning, push, null, commands)
            return True
    push = commands.copy()
    longest(base, push, null, commands)
    return True


@compiled
def longest(base: Array, push: Array, null: Array, out: Array) -> float:
    """Commands c with |c| ≤ 1 and B c = B (base + λ push), λ ≤ 1 as great as it goes, into `out`; λ.

    With one redundant actuator all solutions are base + λ push + t n, n spanning the null space: a linear programme in
    (λ, t), solved pair by pair of limits. Where n is 0, so is t.

    Args:
        base: (n,) within reach.
        push: (n,).
        null: (n,) unit commands that give no wrench; 0 without such.
        out: (n,) takes the commands.
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
def add_planar(group: Array, members: Array, commands: Array, fin_effect: float, wrench: Array) -> None:
    """Add the wrench of a planar group's commands."""
    x = y = 0.0
    for i in range(len(members)):
        share = commands[i] * fin_effect if members[i, 4] != 0.0 else commands[i]
        x += members[i, 1] * share
        y += members[i, 2] * share
    wrench[int(group[2])] += x
    wrench[int(group[3])] += y  # with one axis y is 0


@compiled
def beyond_dead_band(command: float, band: float) -> float:
    """A command within the dead band would give nothing: 0 or the band's edge, whichever is nearer."""
    if not -band < command < band:
        return command
    return 0.0 if abs(command) <= 0.5 * band else math.copysign(band, command)
