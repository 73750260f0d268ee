"""From a body wrench to actuator commands: weighted pseudo-inverse, saturation along the wrench's direction."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from auvdock.controllers.planar_groups import (
    Member,
    PlanarGroup,
    add_planar,
    allocate_planar,
    leave_dead_band,
    reach_along,
    solve_planar,
)
from auvdock.core.arrays import Array, IntArray, check_shape
from auvdock.core.checked import Checked
from auvdock.core.limits import Positive, between
from auvdock.core.thruster import ThrusterCurve, load_curve
from auvdock.core.vehicle import VehicleCfg

__all__ = ["AllocationCfg", "ThrustAllocator"]

_TINY = 1e-9
_NOT_PLANAR = PlanarGroup(0, 0, 0, 0, np.zeros(3), np.zeros(3))

Preload = Annotated[float, between(0.0, 0.5)]
"""Part of a thruster's range that it may push against another one."""


@dataclass(frozen=True)
class AllocationCfg(Checked):
    """How thrusters and fins share the work."""

    fin_weight: Positive = 0.1
    """Cost of a fin's squared command against a thruster's 1: a fin costs next to no energy."""
    preload: Preload = 0.0
    """Command with which opposed vectored thrusters push against each other, so that a weak wrench does not fall into
    their dead bands; 0 for none. Groups with fins, or without redundant thrusters, have none."""


class ThrustAllocator:
    """Solves min cᵀ W c subject to B(u) c = τ with |c| ≤ 1 (Fossen 2011, section 12.3.2; Durham 1993 for the limits).

    c are efforts, which are the commands themselves unless a thruster's curve was measured: the curve's inverse then
    makes the command, and c = 1 is the greatest thrust of its weaker way. B(u) has a thruster's wrench at c = 1 in its
    column, or a fin's times u |u|. Roll, or any other axis on which no thruster acts, is left alone. Actuators that
    share an axis form a group (axial, lateral, vertical for a torpedo with tunnel thrusters; one of all six axes for
    vectored thrusters above or below the origin); a group whose wrench is out of reach gives the longest reachable
    wrench in the same direction, and the other groups are not touched.
    """

    def __init__(self, vehicle: VehicleCfg, cfg: AllocationCfg | None = None) -> None:
        """Sort the actuators into groups.

        Args:
            vehicle: whose actuators.
            cfg: sharing between thrusters and fins.
        """
        cfg = cfg or AllocationCfg()
        fins = [actuator.kind == "fin" for actuator in vehicle.actuators]
        self._full = vehicle.thruster_wrenches_body.copy()
        self._is_fin = np.array(fins)
        reach = np.abs(self._full[:, ~self._is_fin]).sum(axis=1)
        rows = [row for row in range(6) if reach[row] > _TINY]
        inverse_weight = [1.0 / cfg.fin_weight if fin else 1.0 for fin in fins]
        self._groups = [
            _Group(self._full, group_rows, columns, fins, inverse_weight, cfg.preload)
            for group_rows, columns in _components(self._full, rows)
        ]
        self._dead_band = np.array([actuator.dead_band for actuator in vehicle.actuators], dtype=np.float64)
        self._count = len(self._dead_band)
        self._curves = _curves(vehicle)
        members: list[Member] = []
        rows_of_groups: list[PlanarGroup] = []
        for group in self._groups:
            if group.planar is None:
                rows_of_groups.append(_NOT_PLANAR)
            else:
                end = len(members) + len(group.members)
                rows_of_groups.append(dataclasses.replace(group.planar, first=len(members), end=end))
                members += group.members
        self._planar, self._members = PlanarGroup.table(rows_of_groups), Member.table(members)

    def effectiveness(self, surge_m_s: float) -> Array:
        """(6, n) B(u): wrench per command at forward speed `surge_m_s` through the water, body axes."""
        return self._full * np.where(self._is_fin, surge_m_s * abs(surge_m_s), 1.0)

    def allocate(self, wrench_body: Array, surge_m_s: float) -> Array:
        """Commands (n,) in [-1, 1] for a wrench (6,) in N and N m, body axes.

        Args:
            wrench_body: wanted wrench; its uncontrollable axes are ignored.
            surge_m_s: forward speed through the water, for the fins.

        Returns:
            Commands with the thrusters' dead band compensated: a command inside the dead band would give nothing, so
            it becomes 0 or the band's edge, whichever is nearer. Where a thruster's curve was measured, the command is
            the curve's inverse, which never lies in its dead band.
        """
        return self.solve(wrench_body, surge_m_s)[0]

    def solve(self, wrench_body: Array, surge_m_s: float, moments_first: bool = False) -> tuple[Array, Array]:
        """As `allocate`, with the wrench (6,) that the commands give, dead band apart: what anti-windup needs.

        Args:
            wrench_body: wanted wrench.
            surge_m_s: forward speed through the water.
            moments_first: a group out of reach gives its moments in full and as much of its forces as is left, instead
                of a share of both: a hull that cannot be held against a cross-current must still turn into it.
        """
        if wrench_body.shape != (6,):
            check_shape("wrench_body", wrench_body, (6,))
        effect = surge_m_s * abs(surge_m_s)
        values, achieved, reached = np.empty(self._count), np.zeros(6), np.empty(len(self._groups), np.bool_)
        if not allocate_planar(
            values, achieved, reached, self._planar, self._members, self._dead_band, wrench_body, effect, moments_first
        ):
            wanted: list[float] = wrench_body.tolist()
            for group, is_done in zip(self._groups, reached.tolist(), strict=True):
                if not is_done:
                    commands = group.solve(wanted, effect, moments_first)
                    group.add_wrench(achieved, commands, effect)
                    for column, value in zip(group.columns, commands, strict=True):
                        values[column] = leave_dead_band(value, float(self._dead_band[column]))
        for curve, columns in self._curves:
            values[columns] = curve.command_for(values[columns])
        return values, achieved


class _Group:
    """Actuators that share axes with each other and with no others."""

    def __init__(
        self,
        full: Array,
        rows: list[int],
        columns: list[int],
        fins: list[bool],
        inverse_weight: list[float],
        preload: float,
    ) -> None:
        self.rows, self.columns = rows, columns
        self._fins = [fins[column] for column in columns]
        self._inverse_weight = [inverse_weight[column] for column in columns]
        self._effect: list[list[float]] = full[np.ix_(rows, columns)].tolist()
        second = self._effect[1] if len(rows) > 1 else [0.0] * len(columns)
        self.members = [
            Member(*member)
            for member in zip(columns, self._effect[0], second, self._inverse_weight, self._fins, strict=True)
        ]
        self.planar: PlanarGroup | None = None
        if len(rows) <= 2:
            thrusters, moving = _gram(self.members, fins=False), _gram(self.members, fins=True)
            if len(rows) == 1:  # a second axis that nothing acts on and that nothing is asked of
                thrusters = np.array([thrusters[0], 0.0, 1.0])
            self.planar = PlanarGroup(0, len(columns), rows[0], rows[-1], thrusters, moving)
        # Without fins B does not depend on speed, and neither does its inverse, nor what gives no wrench.
        self._inverse: Array | None = None
        self._redundant: Array | None = None
        if self.planar is None and not any(self._fins):
            matrix = np.array(self._effect)
            weighted = matrix * np.array(self._inverse_weight)
            self._inverse = weighted.T @ np.linalg.pinv(weighted @ matrix.T)
            self._redundant = _null_space(matrix)
        self._bias = _opposed(self._redundant, preload)

    def solve(self, wrench: Sequence[float], fin_effect: float, moments_first: bool = False) -> list[float]:
        """Commands for the group's part of the wrench, or for the longest part of it within reach."""
        commands = self._least(wrench, fin_effect)
        if max(commands) <= 1.0 and min(commands) >= -1.0:
            if self._bias is None:
                return commands
            loaded = [command + bias for command, bias in zip(commands, self._bias, strict=True)]
            return loaded if max(loaded) <= 1.0 and min(loaded) >= -1.0 else commands
        if self._redundant is not None:
            longest = partial(_reach_along_space, null=self._redundant)
        else:
            longest = partial(_reach_along, null=_null_vector(self._scaled(fin_effect)))
        idle = [0.0] * len(commands)
        if moments_first and self.rows[0] < 3 <= self.rows[-1]:
            turning, reach = longest(idle, self._least([0.0, 0.0, 0.0, *wrench[3:]], fin_effect))
            if reach == 1.0:
                return longest(turning, self._least([*wrench[:3], 0.0, 0.0, 0.0], fin_effect))[0]
        return longest(idle, commands)[0]

    def add_wrench(self, wrench: Array, commands: list[float], fin_effect: float) -> None:
        """Add the wrench of the commands."""
        if self.planar is not None:
            add_planar(self.planar.packed()[0], Member.table(self.members), np.array(commands), fin_effect, wrench)
            return
        for row, line in zip(self.rows, self._scaled(fin_effect), strict=True):
            wrench[row] += sum(value * command for value, command in zip(line, commands, strict=True))

    def _scaled(self, fin_effect: float) -> list[list[float]]:
        """Rows of B at this speed."""
        return [
            [value * fin_effect if fin else value for value, fin in zip(line, self._fins, strict=True)]
            for line in self._effect
        ]

    def _least(self, wrench: Sequence[float], fin_effect: float) -> list[float]:
        """Commands W⁻¹ Bᵀ (B W⁻¹ Bᵀ)⁻¹ τ, in closed form for one and two axes."""
        if self.planar is not None:
            closed = np.empty(len(self.columns))
            members = Member.table(self.members)
            if solve_planar(self.planar.packed()[0], members, np.array(wrench), fin_effect, closed):
                return closed.tolist()
        if self._inverse is not None:
            direct: list[float] = (self._inverse @ np.array([wrench[row] for row in self.rows])).tolist()
            return direct
        matrix = np.array(self._scaled(fin_effect))
        weighted = matrix * np.array(self._inverse_weight)
        wanted = np.array([wrench[row] for row in self.rows])
        commands: list[float] = (weighted.T @ (np.linalg.pinv(weighted @ matrix.T) @ wanted)).tolist()
        return commands


def _curves(vehicle: VehicleCfg) -> list[tuple[ThrusterCurve, IntArray]]:
    """The measured curves, each with the actuators (k,) that have it."""
    columns: dict[str, list[int]] = {}
    for index, actuator in enumerate(vehicle.actuators):
        if actuator.curve:
            columns.setdefault(actuator.curve, []).append(index)
    return [(load_curve(name, vehicle.voltage_v), np.array(found)) for name, found in columns.items()]


def _gram(members: Sequence[Member], fins: bool) -> Array:
    """(3,) upper triangle of B W⁻¹ Bᵀ over the fins, or over the thrusters, of a planar group."""
    total = np.zeros(3)
    for member in members:
        if member.is_fin is fins:
            x, y, weight = member.effect_x, member.effect_y, member.inverse_weight
            total += (weight * x * x, weight * x * y, weight * y * y)
    return total


def _components(full: Array, rows: list[int]) -> list[tuple[list[int], list[int]]]:
    """Connected components of the bipartite graph of wrench rows and actuators."""
    touches = np.abs(full) > _TINY
    groups: list[tuple[list[int], list[int]]] = []
    remaining = set(rows)
    while remaining:
        part = {min(remaining)}
        while True:
            members = [int(column) for column in np.flatnonzero(touches[sorted(part)].any(axis=0))]
            grown = {int(row) for row in np.flatnonzero(touches[:, members].any(axis=1))} & remaining
            if grown <= part:
                break
            part |= grown
        groups.append((sorted(part), members))
        remaining -= part
    return groups


def _null_vector(effect: list[list[float]]) -> list[float] | None:
    """The commands that give no wrench, if there is one redundant actuator, else None."""
    count = len(effect[0])
    _, singular, rows = np.linalg.svd(np.array(effect))
    rank = int(np.sum(singular > _TINY * singular[0]))
    return rows[-1].tolist() if count - rank == 1 else None


def _null_space(effect: Array) -> Array:
    """(n, k) orthonormal columns that span the commands which give no wrench."""
    _, singular, rows = np.linalg.svd(effect)
    rank = int(np.sum(singular > _TINY * singular[0]))
    return np.ascontiguousarray(rows[rank:].T)


def _opposed(null: Array | None, preload: float) -> list[float] | None:
    """Commands without a wrench, of greatest size `preload`: what all thrusters ahead would be, less what it gives.

    For four vectored thrusters that is (1, 1, 1, 1), each pushing against its opposite. None if there is no such.
    """
    if null is None or preload == 0.0:
        return None
    ahead: Array = null @ null.sum(axis=0)
    size = float(np.abs(ahead).max(initial=0.0))
    return (ahead * (preload / size)).tolist() if size > 0.1 else None


def _reach_along_space(base: list[float], push: list[float], null: Array) -> tuple[list[float], float]:
    """As `_reach_along` for any number of redundant actuators: all solutions are base + λ push + N t.

    A linear programme in (λ, t, s): max λ − ε s with |base + λ push + N t| ≤ s ≤ 1 and 0 ≤ λ ≤ 1; the small ε picks, of
    the many solutions, one with the smallest greatest command. Some milliseconds, but only out of reach.
    """
    from scipy.optimize import linprog

    count = len(base)
    columns = np.column_stack([push, null])
    bounded = np.ones((count, 1))
    limits = np.vstack([np.hstack([columns, -bounded]), np.hstack([-columns, -bounded])])
    start = np.array(base)
    free = null.shape[1]
    best = linprog(
        [-1.0] + [0.0] * free + [1e-3],
        A_ub=limits,
        b_ub=np.concatenate([-start, start]),
        bounds=[(0.0, 1.0)] + [(None, None)] * free + [(0.0, 1.0)],
    )
    reach = float(best.x[0]) if best.x is not None else 0.0
    if reach > 1.0 - 1e-9:
        reach = 1.0
    shift = null @ np.array(best.x[1:-1]) if best.x is not None else np.zeros(count)
    return np.clip(start + reach * np.array(push) + shift, -1.0, 1.0).tolist(), reach


def _reach_along(base: list[float], push: list[float], null: list[float] | None) -> tuple[list[float], float]:
    """As `reach_along`, of lists; without a null vector t is 0, which may fall short of the greatest λ."""
    commands, no_wrench = np.empty(len(base)), np.zeros(len(base)) if null is None else np.array(null)
    reach = reach_along(np.array(base), np.array(push), no_wrench, commands)
    return commands.tolist(), reach
