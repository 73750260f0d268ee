"""Thrust allocation of groups of actuators that act on at most two axes: in closed form, compiled."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.compiled import compiled

__all__ = ["add_planar", "beyond_dead_band", "least_planar", "planar_groups"]

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
) -> bool:
    """All groups of at most two axes whose wrench is within reach.

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
        within = len(mine) > 0 and least_planar(group, mine, wrench, fin_effect, commands)
        for command in commands:
            within = within and -1.0 <= command <= 1.0
        reached[index] = 1.0 if within else 0.0
        if not within:
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
