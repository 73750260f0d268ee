"""`auvdock reproduce guidance-design`: optimised arrays against the paper's ring of six at equal power."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import command_line, counting_progress, output
from auvdock.cli.parsing import at_least, named_by_flag, parse
from auvdock.cli.saving import Saving
from auvdock.core.station import load_conical_station
from auvdock.experiments.guidance_space_design import (
    Campaign,
    PaperComparison,
    PhysicalComparison,
    compare_paper,
    compare_physical,
    default_search,
    design_rows,
    dock_campaign,
    draw_comparison,
)
from auvdock.optics.water import load_water
from auvdock.planning.pictures import make_folder
from auvdock.planning.station_file import write_station

__all__ = ["GuidanceDesign", "run_guidance_design"]


@dataclass(frozen=True)
class GuidanceDesign:
    """Six lights placed by the optimiser against the paper's ring (45°, +6°), at equal power.

    In paper A's model and in the physical one, and docking campaigns with both arrays in the physical one.
    Exit code: 0 if the optimised arrays have the greater guidance space in both models, 1 if not.
    """

    water: str = "pool"
    """Water preset of the physical model."""
    episodes: int = 24
    """Docking episodes with each array; 0 leaves them out."""
    cone: float = 25.0
    """In the physical model, count only places within this angle of the approach axis, in degrees; 90 is the whole
    half space."""
    seed: int = 0
    """Of the search."""
    out: Path | None = None
    """Folder for guidance_design.png and the optimised station's file."""
    workers: int | None = None
    """Processes of the docking campaigns; by default one per core."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_guidance_design(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(GuidanceDesign, argv, prog)
    at_least(0, episodes=args.episodes, seed=args.seed)
    at_least(1, workers=args.workers)
    load_water(args.water)
    cfg = default_search()
    with named_by_flag(cone_deg="cone"):
        search = dataclasses.replace(cfg, cone_deg=args.cone)
    if args.out is not None:
        make_folder(args.out)
    layouts = cfg.population * (cfg.generations + 1)
    campaigns: list[Campaign] = []
    with counting_progress() as progress:
        task = progress.add_task("layouts in paper A's model", total=layouts)
        paper = compare_paper(cfg, args.seed, lambda: progress.advance(task))
        second = progress.add_task(f"layouts in {args.water}", total=layouts)
        physical = compare_physical(args.water, search, args.seed, lambda: progress.advance(second))
        if args.episodes:
            stations = {"paper's ring": load_conical_station(), "optimised": physical.station}
            third = progress.add_task("docking campaigns", total=2)
            for name, station in stations.items():
                campaigns.append(dock_campaign(name, station, args.water, args.episodes, workers=args.workers))
                progress.advance(third)
    saving = Saving()
    fly_it: str | None = None
    if args.out is not None:
        saving.attempt(args.out / "guidance_design.png", lambda path: draw_comparison(path, physical, paper))
        station_file = args.out / f"optimised_{Path(args.water).stem}.toml"
        saving.attempt(station_file, lambda path: write_station(path, physical.station))
        fly_it = command_line("auvdock", "dock", "conical", "--station", station_file, "--water", args.water)
    report = _report(paper, physical, campaigns, saving.written, args.cone)
    report["fly_it"] = fly_it
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        _print(report)
    better = paper.best_m3 > paper.ring_m3 and physical.found.score > physical.found.start_score
    return saving.finish(exit_codes.DONE if better else exit_codes.NOT_MET)


def _report(
    paper: PaperComparison, physical: PhysicalComparison, campaigns: list[Campaign], files: list[str], cone_deg: float
) -> dict[str, Any]:
    return {
        "paper_a_model": {
            "ring_m3": paper.ring_m3,
            "optimised_m3": paper.best_m3,
            "gain": paper.best_m3 / paper.ring_m3 - 1.0,
            "ring_voxel_m3": paper.ring_voxel_m3,
            "optimised_voxel_m3": paper.best_voxel_m3,
            "beam_deg": paper.found.design.beam_deg,
            "lights": design_rows(paper.found.design),
            "layouts_tried": paper.found.evaluations,
        },
        "physical_model": {
            "water": physical.water,
            "ring_m3": physical.ring.volume_m3,
            "ring_error_m3": physical.ring.error_m3,
            "optimised_m3": physical.best.volume_m3,
            "optimised_error_m3": physical.best.error_m3,
            "gain": physical.best.volume_m3 / physical.ring.volume_m3 - 1.0,
            "ring_range_m": physical.ring.range_m,
            "optimised_range_m": physical.best.range_m,
            "cone_deg": cone_deg,
            "ring_in_cone_m3": physical.found.start_score,
            "optimised_in_cone_m3": physical.found.score,
            "power_w": physical.found.power_w,
            "beam_deg": physical.found.design.beam_deg,
            "lights": design_rows(physical.found.design),
            "layouts_tried": physical.found.evaluations,
        },
        "campaigns": [asdict(campaign) for campaign in campaigns],
        "files": files,
    }


def _print(report: dict[str, Any]) -> None:
    console = output()
    table = Table(title="six lights, equal power", title_justify="left")
    for name in ("model", "paper's ring m³", "optimised m³", "gain", "beam °"):
        table.add_column(name, justify="left" if name == "model" else "right")
    paper, physical = report["paper_a_model"], report["physical_model"]
    inner, outer = physical["ring_in_cone_m3"], physical["optimised_in_cone_m3"]
    rows = (
        ("paper A's", paper["ring_m3"], paper["optimised_m3"], paper["beam_deg"]),
        (f"physical, within {physical['cone_deg']:g}°", inner, outer, physical["beam_deg"]),
        ("physical, all", physical["ring_m3"], physical["optimised_m3"], physical["beam_deg"]),
    )
    for name, ring, best, beam in rows:
        table.add_row(name, f"{ring:.1f}", f"{best:.1f}", f"{best / ring - 1.0:+.1%}", f"{beam:.0f}")
    console.print(table)
    if report["campaigns"]:
        table = Table(title="docking campaigns, beacons fidelity", title_justify="left")
        names = ("array", "docked", "first pose m", "precise range m", "distortion", "pose error m", "time s")
        for name in names:
            table.add_column(name, justify="left" if name == "array" else "right")
        for row in report["campaigns"]:
            figures = ("entry_distance_m", "precise_range_m", "distortion_rate", "pose_error_m", "time_s")
            values = ["-" if row[key] is None else f"{row[key]:.3f}" for key in figures]
            table.add_row(row["name"], f"{row['docked']}/{row['episodes']}", *values)
        console.print(table)
    for name in report["files"]:
        console.print(name, highlight=False, soft_wrap=True)
    if report["fly_it"] is not None:
        console.print(f"fly it: {report['fly_it']}", highlight=False, soft_wrap=True)
