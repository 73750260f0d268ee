"""`auvdock plan STATION.toml`: where a station's lights can be seen."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import command_line, counting_progress, output, shown
from auvdock.cli.parsing import at_least, named_by_flag, parse
from auvdock.cli.saving import Saving
from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import CameraCfg
from auvdock.core.station import ConicalStationCfg
from auvdock.core.strict import load_toml
from auvdock.planning.array_design import ArrayBounds, physical_layout
from auvdock.planning.detectability import Detectability
from auvdock.planning.optimise import Found, OptimiseCfg, optimise_physical
from auvdock.planning.pictures import Panel, draw_curves, draw_sections, make_folder, section_grid
from auvdock.planning.region import GuidanceSpace, PlanCfg, guidance_space, make_detectability
from auvdock.planning.region_rerun import record_region
from auvdock.planning.station_file import with_lights, write_station
from auvdock.planning.sweeps import SweepPoint, sweep, variants

__all__ = ["Plan", "run", "section_panels"]

_LEAST_WIDTH_PX = 32
"""So that the height, 9/16 of it, is a camera's too."""


@dataclass(frozen=True)
class Plan:
    """Where can a station's beacons be seen? Volume, range and half angle of its precise-guidance space.

    The region is where at least `min-lights` array lights are found by the threshold detector in a camera that looks at
    the station, in the light model that the renderer uses.
    """

    station: Annotated[Path, tyro.conf.Positional]
    """TOML file of a conical station, as assets/stations/conical.toml."""
    water: str = "pool"
    """Water preset (I, IA, IB, II, III, 1C to 9C, petzold_clear, petzold_coastal, petzold_harbour, clear, pool, lake),
    or a TOML file written as assets/waters are."""
    attenuation: float | None = None
    """Beam attenuation at 450 nm in 1/m, in place of the preset's."""
    min_lights: int = 4
    """Array lights that must be found."""
    resolution: int = 56
    """Voxels along the longest side of the region."""
    width: int = 640
    """Image width in pixels, 16:9."""
    optimise: Literal["volume", "volume_per_watt", "pose_error"] | None = None
    """Place the array's lights anew for the greatest volume, the greatest volume per watt (power free up to the
    station's) or the least pose error over the region, within --bounds; takes a minute or two."""
    bounds: ArrayBounds = ArrayBounds(max_beam_deg=120.0)
    """What the optimiser may choose from."""
    cone: float = 90.0
    """The optimiser counts only places within this angle of the approach axis, in degrees."""
    generations: int = 14
    """Generations of the optimiser's search."""
    seed: int = 0
    """Of the optimiser's draws."""
    sweep: bool = False
    """Sweep over beam angle, number of lights and tilt as well."""
    out: Path | None = None
    """Folder for sections.png, region.rrd, sweeps.png and optimised.toml."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Plan, argv, prog)
    station = load_toml(ConicalStationCfg, args.station)
    layout = station.layout
    with named_by_flag(attenuation_per_m="attenuation", cone_deg="cone", min_lights="min-lights", width_px="width"):
        at_least(_LEAST_WIDTH_PX, width=args.width)
        camera = CameraCfg(width_px=args.width, height_px=round(args.width * 9 / 16))
        cfg = PlanCfg(args.water, args.attenuation, camera, min_lights=args.min_lights, resolution=args.resolution)
        sees = make_detectability(layout, cfg)
        search = _search(args, station)
    cases, where = variants(station) if args.sweep else [], f"{shown(args.station.stem)} in {args.water}"
    if args.out is not None:
        make_folder(args.out)
    layouts = search.population * (search.generations + 1) if search is not None else 0
    started = time.perf_counter()
    with counting_progress() as progress:
        task = progress.add_task("region", total=1 + len(cases) + layouts + (3 if args.out else 0))
        space = guidance_space(layout, cfg, sees)
        region_s = time.perf_counter() - started
        progress.advance(task)
        saving = Saving()
        spaces = {"station": space}
        optimised: dict[str, Any] | None = None
        flown = args.station
        if search is not None:
            rng = np.random.default_rng(args.seed)
            found = optimise_physical(layout, search, cfg, rng, lambda: progress.advance(task))
            best = physical_layout(found.design, layout, found.power_w / search.bounds.lights)
            spaces["optimised"] = guidance_space(best, cfg)
            optimised = _optimised(search, found, spaces["optimised"])
            if args.out is not None:
                designed = with_lights(station, best)
                flown = args.out / "optimised.toml"
                saving.attempt(flown, lambda path: write_station(path, designed))
        if args.out is not None:
            title = f"{where}: {space.volume_m3:.0f} m³"
            panels = section_panels(sees, layout, space, lambda: progress.advance(task), min(64, args.resolution + 8))
            saving.attempt(args.out / "sections.png", lambda path: draw_sections(path, title, panels, cfg.min_lights))
            saving.attempt(args.out / "region.rrd", lambda path: record_region(path, layout, spaces))
        points = sweep(cases, cfg, lambda: progress.advance(task)) if cases else []
        if args.out is not None and points:
            saving.attempt(args.out / "sweeps.png", lambda path: draw_curves(path, where, _curves(points)))
    report = _report(args, space, region_s, points, saving.written)
    report["optimised"] = optimised
    report["fly_it"] = _flying(args, station, flown)
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        _print(report, points)
    return saving.finish(exit_codes.DONE)


def _flying(args: Plan, station: ConicalStationCfg, file: Path) -> str:
    """The command that docks into the planned station."""
    kind = "conical" if station.rotating is None else "rotating"
    words: list[str | Path] = ["auvdock", "dock", kind, "--station", file, "--water", args.water]
    if args.attenuation is not None:
        words += ["--attenuation", f"{args.attenuation:g}"]
    return command_line(*words)


def section_panels(
    sees: Detectability,
    layout: BeaconLayout,
    space: GuidanceSpace,
    tick: Callable[[], object],
    places: int = 64,
) -> list[Panel]:
    """Sections: level through the axis, upright through it, and across it at half of the range.

    Args:
        sees: camera, water and lights.
        layout: the lights.
        space: the region, for the sections' extent.
        tick: called after each section.
        places: places along each side of a section.
    """
    lights = layout.array_positions_m

    def count(points_m: Array) -> IntArray:
        return sees.sighting(points_m).count

    if space.region is None:
        low, high = np.array([0.0, -5.0, -5.0]), np.array([10.0, 5.0, 5.0])
    else:
        low = space.region.low_m
        high = low + np.array(space.region.inside.shape) * space.region.voxel_m
    centre = sees.sight.target_m
    half = float(centre[0]) + 0.5 * space.range_m
    cuts = (
        ("level section through the axis", (0, 1), float(centre[2])),
        ("upright section through the axis", (0, 2), float(centre[1])),
        (f"section across the axis at {half:.1f} m", (1, 2), half),
    )
    panels: list[Panel] = []
    for title, axes, fixed in cuts:
        one, other = (np.linspace(low[k] + 0.02, high[k], places) for k in axes)
        grid = section_grid(count, axes, one, other, fixed)
        panels.append(Panel(title, "xyz"[axes[0]], "xyz"[axes[1]], one, other, grid, lights[:, axes]))
        tick()
    return panels


def _search(args: Plan, station: ConicalStationCfg) -> OptimiseCfg | None:
    if args.optimise is None:
        return None
    at_least(0, seed=args.seed)
    power = sum(beacon.power_w for beacon in station.layout.beacons if beacon.role == "array")
    return OptimiseCfg(args.optimise, args.bounds, power, generations=args.generations, cone_deg=args.cone)


def _optimised(search: OptimiseCfg, found: Found, space: GuidanceSpace) -> dict[str, Any]:
    design = found.design
    rows = zip(design.azimuth_rad, design.radius_m, design.inward_tilt_deg, strict=True)
    return {
        "goal": search.goal,
        "score": found.score,
        "score_of_ring": found.start_score,
        "layouts_tried": found.evaluations,
        "volume_m3": space.volume_m3,
        "discretisation_error_m3": space.error_m3,
        "range_m": space.range_m,
        "power_w": found.power_w,
        "beam_deg": design.beam_deg,
        "lights": [
            {"azimuth_deg": float(np.degrees(azimuth)), "radius_m": float(radius), "inward_tilt_deg": float(tilt)}
            for azimuth, radius, tilt in rows
        ],
    }


def _curves(points: list[SweepPoint]) -> list[tuple[str, Array, Array]]:
    names = {"beam_angle_deg": "beam angle [°]", "lights": "lights, equal total power", "tilt_deg": "inward tilt [°]"}
    curves: list[tuple[str, Array, Array]] = []
    for quantity, label in names.items():
        rows = [(point.value, point.volume_m3) for point in points if point.quantity == quantity]
        table = np.array(rows)
        curves.append((label, table[:, 0], table[:, 1]))
    return curves


def _report(
    args: Plan, space: GuidanceSpace, region_s: float, points: list[SweepPoint], files: list[str]
) -> dict[str, Any]:
    return {
        "station": str(args.station),
        "water": args.water,
        "attenuation_per_m": args.attenuation,
        "min_lights": args.min_lights,
        "volume_m3": space.volume_m3,
        "discretisation_error_m3": space.error_m3,
        "voxel_m": space.region.voxel_m if space.region is not None else None,
        "near_m": space.near_m,
        "range_m": space.range_m,
        "half_angle_deg": space.half_angle_deg,
        "array_power_w": space.power_w,
        "volume_per_watt_m3": space.volume_m3 / space.power_w,
        "places_evaluated": space.region.evaluations if space.region is not None else 0,
        "wall_s": region_s,
        "sweep": [asdict(point) for point in points],
        "files": files,
    }


def _print(report: dict[str, Any], points: list[SweepPoint]) -> None:
    console = output()
    table = Table(title=f"guidance space of {report['station']} in {report['water']}", title_justify="left")
    table.add_column("measure")
    table.add_column("value", justify="right")
    error = report["discretisation_error_m3"]
    voxel = report["voxel_m"]
    rows = (
        ("volume", f"{report['volume_m3']:.1f} ± {error:.1f} m³ (discretisation)"),
        ("voxel", "-" if voxel is None else f"{voxel:.2f} m"),
        ("along the axis", f"{report['near_m']:.1f} to {report['range_m']:.1f} m"),
        ("half angle at half range", f"{report['half_angle_deg']:.1f}°"),
        ("array power", f"{report['array_power_w']:.0f} W"),
        ("volume per watt", f"{report['volume_per_watt_m3']:.2f} m³/W"),
        ("wall-clock time", f"{report['wall_s']:.1f} s"),
    )
    for name, value in rows:
        table.add_row(name, value)
    console.print(table)
    if report["optimised"] is not None:
        _print_optimised(console, report)
    if points:
        table = Table(title="sweeps, the array's total power held", title_justify="left")
        for name in ("quantity", "value", "volume m³", "range m", "half angle °", "m³/W"):
            table.add_column(name, justify="left" if name == "quantity" else "right")
        for point in points:
            table.add_row(
                point.quantity,
                f"{point.value:g}",
                f"{point.volume_m3:.0f}",
                f"{point.range_m:.1f}",
                f"{point.half_angle_deg:.0f}",
                f"{point.volume_per_watt_m3:.2f}",
            )
        console.print(table)
    for name in report["files"]:
        console.print(name, highlight=False, soft_wrap=True)
    console.print(f"fly it: {report['fly_it']}", highlight=False, soft_wrap=True)


def _print_optimised(console: Console, report: dict[str, Any]) -> None:
    found = report["optimised"]
    table = Table(title=f"optimised for {found['goal'].replace('_', ' ')}", title_justify="left")
    for name in ("light", "azimuth °, 0 is up", "radius m", "inward tilt °"):
        table.add_column(name, justify="right")
    for index, row in enumerate(found["lights"]):
        table.add_row(
            str(index), f"{row['azimuth_deg']:+.0f}", f"{row['radius_m']:.2f}", f"{row['inward_tilt_deg']:+.1f}"
        )
    console.print(table)
    console.print(
        f"beam {found['beam_deg']:.0f}°, {found['power_w']:.0f} W: {found['volume_m3']:.0f} ± "
        f"{found['discretisation_error_m3']:.0f} m³; goal {found['score']:.4g}, the ring's {found['score_of_ring']:.4g}"
    )
