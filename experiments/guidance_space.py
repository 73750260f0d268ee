"""Paper A's tables 4 and 5, the size of the precise-guidance space, beside ours.

One parameter set reproduces both tables on the paper's grid. Beside each cell stand the volumes on a fine grid, and a
table tells what other readings of the paper would have given.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import BoolArray, IntArray
from auvdock.planning.paper_a import (
    PaperAGrid,
    PaperALamp,
    PaperALightCfg,
    count_visible,
    hull_volume_m3,
    lamp_visible,
    paper_a_ring,
)

__all__ = [
    "CELLS",
    "COUNTS",
    "TABLE_4",
    "TABLE_5",
    "TOLERANCE_M3",
    "Cell",
    "CellResult",
    "Reading",
    "ReadingResult",
    "Reproduction",
    "fine_volumes_m3",
    "readings",
    "reproduce",
    "task_count",
]

COUNTS = (4, 5, 6, 8, 10)
TABLE_4: dict[float, tuple[float, ...]] = {
    5.0: (24.1, 39.3, 63.2, 118.2, 172.4),
    10.0: (49.8, 69.7, 101.6, 168.6, 232.9),
    20.0: (100.3, 131.8, 178.3, 254.3, 330.3),
    30.0: (139.5, 174.9, 226.0, 313.3, 388.5),
    40.0: (163.8, 204.8, 252.7, 345.3, 413.5),
    50.0: (177.4, 214.9, 263.1, 345.0, 415.9),
    60.0: (178.7, 216.6, 264.8, 348.9, 414.5),
    70.0: (171.1, 209.5, 253.2, 334.4, 392.3),
}
"""Paper A, table 4: volume in m³ over beam angle in degrees, for 4, 5, 6, 8 and 10 lights."""
TABLE_5: dict[float, float] = {
    10.0: 290.5,
    8.0: 310.7,
    6.0: 324.8,
    4.0: 313.4,
    2.0: 286.8,
    0.0: 260.9,
    -2.0: 226.5,
    -4.0: 195.9,
}
"""Paper A, table 5: volume in m³ over the inward tilt in degrees, for six lights of 45°."""

TOLERANCE_M3 = 0.1
"""Greatest difference at which a cell counts as reproduced."""
FINE_POINTS = 800_000
"""Points of the fine grid."""


@dataclass(frozen=True)
class Cell:
    """One cell of the paper's tables."""

    table: int
    count: int
    angle_deg: float
    inward_tilt_deg: float
    paper_m3: float

    def lamps(self) -> list[PaperALamp]:
        """The ring of this cell."""
        return paper_a_ring(self.count, self.angle_deg, self.inward_tilt_deg)


CELLS = tuple(
    [
        Cell(4, count, angle, 0.0, paper)
        for angle, row in TABLE_4.items()
        for count, paper in zip(COUNTS, row, strict=True)
    ]
    + [Cell(5, 6, 45.0, tilt, paper) for tilt, paper in TABLE_5.items()]
)


@dataclass(frozen=True)
class Reading:
    """A way to read the paper."""

    name: str
    cfg: PaperALightCfg
    grid: PaperAGrid = PaperAGrid()
    needed: int = 4


@dataclass(frozen=True)
class CellResult:
    """A cell of the paper beside ours.

    Attributes:
        cell: the cell.
        ours_m3: convex hull on the paper's grid.
        difference_m3: ours less the paper's.
        fine_hull_m3: convex hull on a fine grid.
        fine_voxel_m3: points in the region on the fine grid times the volume of its cell.
        converged_hull_m3: the hull extrapolated to step 0 from the fine grid and one of twice its step: a hull of grid
            points misses a layer whose thickness goes with the step.
        step_m: step of the fine grid.
    """

    cell: Cell
    ours_m3: float
    difference_m3: float
    fine_hull_m3: float
    fine_voxel_m3: float
    converged_hull_m3: float
    step_m: float


@dataclass(frozen=True)
class ReadingResult:
    """What a reading gives over all cells.

    Attributes:
        name: the reading.
        table_4_rms: root mean square of the relative deviation over table 4.
        table_5_rms: likewise over table 5.
        max_difference_m3: greatest deviation of any cell.
        cells_within: cells that deviate by at most `TOLERANCE_M3`.
        best_tilt_deg: inward tilt with the greatest volume in table 5; the paper's is +6.
        gain: volume there over the volume without tilt; the paper's is 1.245.
    """

    name: str
    table_4_rms: float
    table_5_rms: float
    max_difference_m3: float
    cells_within: int
    best_tilt_deg: float
    gain: float


def readings() -> tuple[Reading, ...]:
    """The parameter set that reproduces the tables, first, and single departures from it."""
    exact = PaperALightCfg()

    def but(name: str, needed: int = 4, grid: PaperAGrid | None = None, **changes: float | bool) -> Reading:
        return Reading(name, dataclasses.replace(exact, **changes), grid or PaperAGrid(), needed)

    return (
        but("as computed (cut, half angle, θ from the lamp, 4 lights, turbulence)"),
        but("no cut at the cone's edge", cut=False),
        but("Angle is the half angle α", half_angle=False),
        but("θ measured from the station's origin", angle_from_station=True),
        but("3 lights needed", needed=3),
        but("5 lights needed", needed=5),
        but("no turbulence", turbulence=False),
        but("z from -2 to 60 m, as the published file has it", grid=PaperAGrid(z_m=(-2.0, 60.0))),
        but("green light (a = 0.20, b = 0.08)", absorption_per_m=0.20, scattering_per_m=0.08),
        but("f_d = (d₀/d)^n", power_law_diffusion=True),
        but("c of the pool, 0.40 1/m (a and b scaled)", absorption_per_m=0.24, scattering_per_m=0.1333),
    )


@dataclass(frozen=True)
class Reproduction:
    """Both tables and the readings.

    Attributes:
        cells: every cell of the paper's tables beside ours.
        readings: what each reading gives; the first is the one used in `cells`.
        within: number of cells within `TOLERANCE_M3`.
    """

    cells: tuple[CellResult, ...]
    readings: tuple[ReadingResult, ...]
    within: int


def reproduce(tick: Callable[[], object] | None = None, workers: int | None = None) -> Reproduction:
    """Both tables, fine volumes and readings.

    Args:
        tick: called once for each of `task_count()` finished tasks.
        workers: processes; by default one per core.
    """
    every = readings()
    cells: dict[int, CellResult] = {}
    others: dict[int, ReadingResult] = {}
    with ProcessPoolExecutor(workers or os.cpu_count() or 1) as pool:
        for_cells = {pool.submit(cell_result, cell): index for index, cell in enumerate(CELLS)}
        for_readings = {pool.submit(reading_result, reading): index for index, reading in enumerate(every)}
        for done in as_completed(for_cells):
            cells[for_cells[done]] = done.result()
            if tick is not None:
                tick()
        for done in as_completed(for_readings):
            others[for_readings[done]] = done.result()
            if tick is not None:
                tick()
    ordered = tuple(cells[index] for index in range(len(CELLS)))
    within = sum(abs(result.difference_m3) <= TOLERANCE_M3 for result in ordered)
    return Reproduction(ordered, tuple(others[index] for index in range(len(every))), within)


def task_count() -> int:
    """Tasks of `reproduce`."""
    return len(CELLS) + len(readings())


def cell_result(cell: Cell) -> CellResult:
    """One cell on the paper's grid and on a fine one."""
    cfg, grid = PaperALightCfg(), PaperAGrid()
    mask = count_visible(cell.lamps(), cfg, grid) >= 4
    ours = hull_volume_m3(mask, grid)
    spans = _bounds(mask, grid)
    step_m = (math.prod(high - low for low, high in spans) / FINE_POINTS) ** (1.0 / 3.0)
    hull, voxel = fine_volumes_m3(cell.lamps(), cfg, spans, step_m)
    coarse, _ = fine_volumes_m3(cell.lamps(), cfg, spans, 2.0 * step_m)
    return CellResult(cell, ours, ours - cell.paper_m3, hull, voxel, 2.0 * hull - coarse, step_m)


def fine_volumes_m3(
    lamps: list[PaperALamp], cfg: PaperALightCfg, spans: list[tuple[float, float]], step_m: float
) -> tuple[float, float]:
    """Convex hull of a region and sum of its cells on a grid over `spans` (x, y, z)."""
    counts = [math.ceil((high - low) / step_m) + 1 for low, high in spans]
    fine = PaperAGrid(spans[0], spans[1], spans[2], (counts[0], counts[1], counts[2]))
    inside = count_visible(lamps, cfg, fine) >= 4
    return hull_volume_m3(inside, fine), float(np.count_nonzero(inside)) * fine.cell_m3


def _bounds(mask: BoolArray, grid: PaperAGrid) -> list[tuple[float, float]]:
    """Bounding box of a region with a margin of one and a half cells of the grid that found it."""
    spans: list[tuple[float, float]] = []
    for axis, values in enumerate(grid.axes()):
        other = tuple(k for k in range(3) if k != axis)
        found: IntArray = np.flatnonzero(mask.any(axis=other))
        margin = 1.5 * float(values[1] - values[0])
        spans.append((float(values[found[0]]) - margin, float(values[found[-1]]) + margin))
    return spans


def reading_result(reading: Reading) -> ReadingResult:
    """All cells under one reading, on its grid."""
    known: dict[PaperALamp, BoolArray] = {}
    volumes: list[float] = []
    for cell in CELLS:
        total = np.zeros(reading.grid.counts, dtype=np.int64)
        for lamp in cell.lamps():
            if lamp not in known:
                known[lamp] = lamp_visible(lamp, reading.cfg, reading.grid)
            total += known[lamp]
        volumes.append(hull_volume_m3(total >= reading.needed, reading.grid))
    ours, paper = np.array(volumes), np.array([cell.paper_m3 for cell in CELLS])
    relative = (ours - paper) / paper
    table = np.array([cell.table for cell in CELLS])
    tilts = {cell.inward_tilt_deg: volume for cell, volume in zip(CELLS, volumes, strict=True) if cell.table == 5}
    best = max(tilts, key=lambda tilt: tilts[tilt])
    return ReadingResult(
        name=reading.name,
        table_4_rms=float(np.sqrt(np.mean(relative[table == 4] ** 2))),
        table_5_rms=float(np.sqrt(np.mean(relative[table == 5] ** 2))),
        max_difference_m3=float(np.max(np.abs(ours - paper))),
        cells_within=int(np.count_nonzero(np.abs(ours - paper) <= TOLERANCE_M3)),
        best_tilt_deg=best,
        gain=tilts[best] / tilts[0.0] if tilts[0.0] > 0.0 else 0.0,
    )
