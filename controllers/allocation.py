"""From a body wrench to actuator commands: weighted pseudo-inverse, saturation along the wrench's direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import VehicleCfg

__all__ = ["AllocationCfg", "ThrustAllocator"]

_TINY = 1e-9


@dataclass(frozen=True)
class AllocationCfg:
    """How thrusters and fins share the work."""

    fin_weight: float = 0.1
    """Cost of a fin's squared command against a thruster's 1: a fin costs next to no energy."""

    def __post_init__(self) -> None:
        """The weight divides."""
        if not self.fin_weight > 0.0:
            raise ConfigError("control.allocation.fin_weight", self.fin_weight, "a weight above 0")


class ThrustAllocator:
    """Solves min cᵀ W c subject to B(u) c = τ with |c| ≤ 1 (Fossen 2011, section 12.3.2; Durham 1993 for the limits).

    B(u) has a thruster's wrench at command 1 in its column, or a fin's times u |u|. Roll, or any other axis on which
    no thruster acts, is left alone. Actuators that share an axis form a group (lateral, vertical, axial); a group
    whose wrench is out of reach gives the longest reachable wrench in the same direction, and the other groups are
    not touched.
    """

    def __init__(self, vehicle: VehicleCfg, cfg: AllocationCfg | None = None) -> None:
        """Precompute what does not depend on speed.

        Args:
            vehicle: whose actuators.
            cfg: sharing between thrusters and fins.
        """
        cfg = cfg or AllocationCfg()
        fins = np.array([actuator.kind == "fin" for actuator in vehicle.actuators])
        self._full = vehicle.thruster_wrenches_body.copy()
        reach = np.abs(self._full[:, ~fins]).sum(axis=1)
        self._rows = [row for row in range(6) if reach[row] > _TINY]
        self._columns = self._full[self._rows]
        self._fins = np.flatnonzero(fins)
        self._fin_mask = fins.astype(np.float64)
        self._thruster_mask = 1.0 - self._fin_mask
        self._inverse_weight = np.where(fins, 1.0 / cfg.fin_weight, 1.0)
        self._dead_band = [actuator.dead_band for actuator in vehicle.actuators]
        self._groups = _groups(self._columns)
        thrusters = self._columns[:, ~fins]
        self._full_rank = bool(np.linalg.matrix_rank(thrusters) == len(self._rows))

    def effectiveness(self, surge_m_s: float) -> Array:
        """(6, n) B(u): wrench per command at forward speed `surge_m_s` through the water, body axes."""
        return self._full * (self._thruster_mask + self._fin_mask * (surge_m_s * abs(surge_m_s)))

    def allocate(self, wrench_body: Array, surge_m_s: float) -> Array:
        """Commands (n,) in [-1, 1] for a wrench (6,) in N and N m, body axes.

        Args:
            wrench_body: wanted wrench; its uncontrollable axes are ignored.
            surge_m_s: forward speed through the water, for the fins.

        Returns:
            Commands with the thrusters' dead band compensated: a command inside the dead band would give nothing, so
            it becomes 0 or the band's edge, whichever is nearer.
        """
        check_shape("wrench_body", wrench_body, (6,))
        return self.solve(wrench_body, surge_m_s)[0]

    def solve(self, wrench_body: Array, surge_m_s: float) -> tuple[Array, Array]:
        """As `allocate`, with the wrench (6,) that the commands give, dead band apart: what anti-windup needs."""
        scale = self._thruster_mask + self._fin_mask * (surge_m_s * abs(surge_m_s))
        effect = self._columns * scale
        weighted = effect * self._inverse_weight
        wanted = wrench_body[self._rows]
        gram = weighted @ effect.T
        multiplier = np.linalg.solve(gram, wanted) if self._full_rank else np.linalg.pinv(gram) @ wanted
        command = multiplier @ weighted
        values: list[float] = command.tolist()
        if max(values) > 1.0 or min(values) < -1.0:
            for rows, columns in self._groups:
                if any(abs(values[column]) > 1.0 for column in columns):
                    part = _longest(effect[np.ix_(rows, columns)], command[columns])
                    for column, value in zip(columns, part, strict=True):
                        values[column] = value
        achieved = np.zeros(6)
        achieved[self._rows] = effect @ np.array(values)
        for index, band in enumerate(self._dead_band):
            value = values[index]
            if 0.0 < abs(value) < band:
                edge = band if value > 0.0 else -band
                values[index] = edge if abs(value) > 0.5 * band else 0.0
        return np.array(values), achieved


def _groups(columns: Array) -> list[tuple[list[int], list[int]]]:
    """Connected components of the bipartite graph of wrench rows and actuators."""
    touches = np.abs(columns) > _TINY
    groups: list[tuple[list[int], list[int]]] = []
    remaining = set(range(columns.shape[0]))
    while remaining:
        rows = {min(remaining)}
        while True:
            members = {int(column) for column in np.flatnonzero(touches[sorted(rows)].any(axis=0))}
            grown = {int(row) for row in np.flatnonzero(touches[:, sorted(members)].any(axis=1))}
            if grown <= rows:
                break
            rows |= grown
        groups.append((sorted(rows), sorted(members)))
        remaining -= rows
    return groups


def _longest(effect: Array, command: Array) -> list[float]:
    """Commands c with |c| ≤ 1 and B c = λ B command, λ ≤ 1 as great as it goes.

    With one redundant actuator all solutions are λ a + t n, n spanning the null space: a linear programme in (λ, t),
    solved pair by pair of limits. With more redundancy the commands are scaled down, which may fall short of the
    greatest λ.
    """
    _, singular, rows = np.linalg.svd(effect)
    rank = int(np.sum(singular > _TINY * singular[0]))
    a: list[float] = command.tolist()
    if effect.shape[1] - rank != 1:
        biggest = max(abs(value) for value in a)
        return [value / biggest for value in a]
    null: list[float] = rows[-1].tolist()
    fixed = [abs(value) for value, part in zip(a, null, strict=True) if abs(part) <= _TINY]
    reach = 1.0 / max(1.0, *fixed) if fixed else 1.0
    lines = [(1.0 / abs(part), value / part) for value, part in zip(a, null, strict=True) if abs(part) > _TINY]
    # Each moving command bounds t: -w - λ s <= t <= w - λ s with w = 1/|n|, s = a/n.
    for width_i, slope_i in lines:
        for width_j, slope_j in lines:
            if slope_j > slope_i:
                reach = min(reach, (width_i + width_j) / (slope_j - slope_i))
    low = max(-width - reach * slope for width, slope in lines)
    high = min(width - reach * slope for width, slope in lines)
    shift = min(max(0.0, low), high)
    return [min(1.0, max(-1.0, reach * value + shift * part)) for value, part in zip(a, null, strict=True)]
