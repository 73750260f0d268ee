"""Optimised arrays against the paper's ring of six at equal power: paper A's model, the physical one, and docking."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.station import ConicalStationCfg, load_conical_station
from auvdock.episode.config import level_cfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.planning.array_design import ArrayBounds, ArrayDesign, paper_lamps, physical_layout
from auvdock.planning.optimise import Found, OptimiseCfg, optimise_paper, optimise_physical
from auvdock.planning.paper_a import PaperAGrid, PaperALightCfg, count_visible, hull_volume_m3, paper_a_ring
from auvdock.planning.pictures import save_figure, section_grid
from auvdock.planning.region import GuidanceSpace, PlanCfg, guidance_space, make_detectability
from auvdock.planning.station_file import with_lights

__all__ = [
    "Campaign",
    "PaperComparison",
    "PhysicalComparison",
    "compare_paper",
    "compare_physical",
    "default_search",
    "design_rows",
    "dock_campaign",
    "draw_comparison",
]

LEVEL = 1
START = {"min_range_m": 22.0, "max_range_m": 30.0, "lateral_m": 6.0, "vertical_m": 3.0, "heading_deg": 30.0}
"""Starts outside the region of either array in the pool, so that each array decides where precise guidance begins."""


@dataclass(frozen=True, eq=False)
class PaperComparison:
    """In paper A's model, both with the paper's six lamps of equal intensity.

    Attributes:
        found: the search's outcome.
        ring_m3: hull of the paper's ring, 45°, +6°, on the paper's grid.
        best_m3: hull of the optimised array there.
        ring_voxel_m3: points in the ring's region times the volume of a cell, on a grid twice as fine.
        best_voxel_m3: the same of the optimised array.
    """

    found: Found
    ring_m3: float
    best_m3: float
    ring_voxel_m3: float
    best_voxel_m3: float


@dataclass(frozen=True, eq=False)
class PhysicalComparison:
    """In the physical model, at equal electrical power.

    Attributes:
        water: the water.
        found: the search's outcome.
        station: the station with the optimised array.
        ring: guidance space of the paper's ring.
        best: guidance space of the optimised array.
        cone_deg: angle about the approach axis within which the search counted places.
    """

    water: str
    found: Found
    station: ConicalStationCfg
    ring: GuidanceSpace
    best: GuidanceSpace
    cone_deg: float


@dataclass(frozen=True)
class Campaign:
    """Docking episodes with one array.

    Attributes:
        name: which array.
        water: the water.
        episodes: number of episodes.
        docked: successes.
        entry_distance_m: median distance at the first measured pose.
        precise_range_m: median range of precise guidance.
        distortion_rate: invalid over precise frames, all episodes together.
        pose_error_m: median of the episodes' median pose errors.
        time_s: median time of the docked episodes.
    """

    name: str
    water: str
    episodes: int
    docked: int
    entry_distance_m: float | None
    precise_range_m: float | None
    distortion_rate: float | None
    pose_error_m: float | None
    time_s: float | None


def compare_paper(cfg: OptimiseCfg, seed: int, tick: Callable[[], object] | None = None) -> PaperComparison:
    """Optimise in paper A's model and compare on its grid and on one twice as fine."""
    model = PaperALightCfg()
    found = optimise_paper(cfg, model, np.random.default_rng(seed), tick)
    grid, fine = PaperAGrid(), PaperAGrid(counts=(119, 119, 99))
    hulls: list[float] = []
    voxels: list[float] = []
    for lamps in (paper_a_ring(6, 45.0, 6.0), paper_lamps(found.design)):
        hulls.append(hull_volume_m3(count_visible(lamps, model, grid) >= 4, grid))
        voxels.append(float(np.count_nonzero(count_visible(lamps, model, fine) >= 4)) * fine.cell_m3)
    return PaperComparison(found, hulls[0], hulls[1], voxels[0], voxels[1])


def compare_physical(
    water: str, cfg: OptimiseCfg, seed: int, tick: Callable[[], object] | None = None
) -> PhysicalComparison:
    """Optimise in the physical model and compare by voxels."""
    station = load_conical_station()
    plan = PlanCfg(water=water)
    found = optimise_physical(station.layout, cfg, plan, np.random.default_rng(seed), tick)
    best = physical_layout(found.design, station.layout, found.power_w / cfg.bounds.lights)
    return PhysicalComparison(
        water,
        found,
        with_lights(station, best),
        guidance_space(station.layout, plan),
        guidance_space(best, plan),
        cfg.cone_deg,
    )


def dock_campaign(
    name: str,
    station: ConicalStationCfg,
    water: str,
    episodes: int,
    tick: Callable[[], object] | None = None,
    workers: int | None = None,
) -> Campaign:
    """Episodes of level 1 in the `beacons` fidelity, seeds 0, 1, ..., the same for every array.

    Starts are `START`'s, not the level's.
    """
    results: list[EpisodeResult] = []
    workers = workers or os.cpu_count() or 1
    batches = [range(first, episodes, workers) for first in range(min(workers, episodes))]
    with ProcessPoolExecutor(workers) as pool:
        jobs = [pool.submit(_episodes, station, water, list(batch)) for batch in batches]
        for done in as_completed(jobs):
            results += done.result()
            if tick is not None:
                tick()
    precise = sum(result.precise_frames for result in results)
    invalid = sum(result.invalid_frames for result in results)
    return Campaign(
        name,
        water,
        episodes,
        sum(result.success for result in results),
        _median([result.entry_distance_m for result in results]),
        _median([result.precise_range_m for result in results]),
        invalid / precise if precise else None,
        _median([result.pose_error_median_m for result in results]),
        _median([result.time_s for result in results if result.success]),
    )


def draw_comparison(path: Path, comparison: PhysicalComparison, paper: PaperComparison) -> None:
    """A picture: the arrays seen from the vehicle, and level sections of both regions with the outline of the other.

    Raises:
        ConfigError: the file cannot be written.
    """
    figure = Figure(figsize=(16.0, 5.2), layout="constrained")
    ring, best = load_conical_station().layout, comparison.station.layout
    axes: Axes = figure.add_subplot(1, 3, 1)
    _draw_front(axes, ring, "o", "#555555", "paper's ring, 45°, +6°")
    _draw_front(axes, best, "s", "#d95f02", f"physical, {comparison.water}: {comparison.found.design.beam_deg:.0f}°")
    shown = physical_layout(paper.found.design, ring, 10.0)
    _draw_front(axes, shown, "^", "#1b9e77", f"paper A's model: {paper.found.design.beam_deg:.0f}°")
    axes.set_aspect("equal")
    axes.set_xlabel("y [m]")
    axes.set_ylabel("z [m]")
    axes.set_title("arrays from the front; lines: beams' inward tilt, ×3", fontsize=10)
    axes.legend(fontsize=7, loc="center")
    plan = PlanCfg(water=comparison.water)
    spaces = [space for space in (comparison.ring.region, comparison.best.region) if space is not None]
    far = max(float(space.low_m[0]) + space.inside.shape[0] * space.voxel_m for space in spaces)
    wide = max(-float(space.low_m[1]) for space in spaces)
    for index, (axes_pair, name) in enumerate((((0, 1), "level"), ((0, 2), "upright"))):
        axes = figure.add_subplot(1, 3, 2 + index)
        across, up = np.linspace(0.02, far, 90), np.linspace(-wide, wide, 90)
        for layout, colour, label in ((ring, "#555555", "paper's ring"), (best, "#d95f02", "optimised")):
            sees = make_detectability(layout, plan)
            count = section_grid(lambda points, s=sees: s.sighting(points).count, axes_pair, across, up, 0.0)
            inside = (count >= 4).T.astype(float)
            axes.contourf(across, up, inside, [0.5, 1.5], colors=[colour], alpha=0.3)
            axes.contour(across, up, inside, [0.5], colors=[colour])
            axes.plot([], [], color=colour, label=label)
        axes.set_aspect("equal")
        axes.set_xlabel("x [m]")
        axes.set_ylabel(f"{'xyz'[axes_pair[1]]} [m]")
        axes.set_title(f"four lights found, {name} section, {comparison.water}", fontsize=10)
        axes.legend(fontsize=8)
    found = comparison.found
    gain, gain_paper = found.score / found.start_score - 1.0, paper.best_m3 / paper.ring_m3 - 1.0
    title = (
        f"{found.start_score:.0f} → {found.score:.0f} m³ ({gain:+.0%}) within {comparison.cone_deg:.0f}° of the axis "
    )
    title += (
        f"in {comparison.water}; {paper.ring_m3:.1f} → {paper.best_m3:.1f} m³ ({gain_paper:+.1%}) in paper A's model; "
    )
    title += "equal power"
    figure.suptitle(title)
    save_figure(figure, path)


def _draw_front(axes: Axes, layout: BeaconLayout, marker: str, colour: str, label: str) -> None:
    index = list(layout.indices("array"))
    places, beams = layout.positions_m[index, 1:], layout.axes[index, 1:]
    axes.plot(places[:, 0], places[:, 1], marker, color=colour, label=label)
    for place, beam in zip(places, beams, strict=True):
        end: Array = place + 3.0 * beam
        axes.plot([place[0], end[0]], [place[1], end[1]], "-", color=colour, linewidth=1.0)


def _episodes(station: ConicalStationCfg, water: str, seeds: list[int]) -> list[EpisodeResult]:
    cfg = level_cfg(LEVEL).override({"world": {"fidelity": "beacons", "water": water, "start": START}})
    cfg = dataclasses.replace(cfg, world=dataclasses.replace(cfg.world, station=station))
    runner = EpisodeRunner(cfg)
    return [runner.run(seed) for seed in seeds]


def _median(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def default_search() -> OptimiseCfg:
    """The search that the documentation quotes."""
    return OptimiseCfg(bounds=ArrayBounds(), generations=14, population=18)


def design_rows(design: ArrayDesign) -> list[dict[str, float]]:
    """The array as plain rows."""
    rows = zip(design.azimuth_rad, design.radius_m, design.inward_tilt_deg, strict=True)
    return [
        {"azimuth_deg": float(np.degrees(azimuth)), "radius_m": float(radius), "inward_tilt_deg": float(tilt)}
        for azimuth, radius, tilt in rows
    ]
