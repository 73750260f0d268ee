"""`auvdock reproduce halo`: the halo's table and Wells' model against photons, or one water at one range."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import named_by_flag, parse
from auvdock.cli.reproduce_halo_beam import beam_cases, beam_verdict, print_beam_case, print_beams, read_degrees
from auvdock.cli.saving import Saving
from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.experiments.beam_check import BeamCheck, check_beam
from auvdock.experiments.beam_picture import draw_beams
from auvdock.experiments.halo_check import (
    CHECKED_BR,
    HALF_ANGLES_DEG,
    PHASES,
    WELLS_RAD,
    HaloCheck,
    check_halo,
    halo_case,
    send_photons,
)
from auvdock.experiments.halo_picture import draw_halo
from auvdock.optics.photons.making import BATCHES, count_photons, make_grid
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.table import load_halo, save_halo
from auvdock.optics.water import water_of
from auvdock.planning.pictures import make_folder

__all__ = ["Halo", "run_halo"]

_LEAST_PHOTONS, _MOST_PHOTONS = 1000, 10**9
_DEFINITION = (
    "radiance within the half angle about the lamp's direction, integrated over solid angle, of an isotropic lamp, "
    "over what would arrive by inverse square alone without water"
)


@dataclass(frozen=True)
class Halo:
    """Light scattered about a lamp: a table made by single photons against photons sent out afresh, and Wells' model.

    With --water and --range it tells what arrives in that one case. With --make-table it makes tables instead.
    With --beam-deg narrow beams are checked too.
    Exit code: 1 if the table is off by more than 10 % where the fresh photons can tell, or they never can; else 0.
    """

    water: str | None = None
    """A water preset, for one case."""
    range_m: Annotated[float | None, tyro.conf.arg(name="range")] = None
    """Distance to the lamp in m, for one case."""
    attenuation: float | None = None
    """Turbidity of that water: c = a + b at 450 nm in 1/m, by more or less scattering; by default the preset's."""
    turbidity: float | None = None
    """In place of --water: c at 530 nm in 1/m of a water between those that Petzold measured."""
    wavelength_nm: float = 450.0
    """Of the lamp in that one case; by default the blue lamps'."""
    beam_deg: tuple[str, ...] = ()
    """Full angles of narrow beams, as 10,60: what they scatter against photons, in one case or in all of the check."""
    off_axis_deg: tuple[str, ...] = ("0,5,10,20,40",)
    """Angles of the line of sight with such a beam's axis."""
    phases: tuple[str, ...] | None = None
    """Phase functions; by default fournier-forand-0.018, petzold-coastal and petzold-harbour."""
    photons: int = 1_000_000
    """Photons for each phase function."""
    seed: int = 0
    """Of the photons; those of a check are never those of a table."""
    make_table: Path | None = None
    """Folder for a new table of each phase function: PHASE.npz."""
    out: Path | None = None
    """Folder for halo.png, the picture, and beam.png with --beam-deg."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_halo(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Halo, argv, prog)
    if not _LEAST_PHOTONS <= args.photons <= _MOST_PHOTONS:
        raise ConfigError("photons", args.photons, f"{_LEAST_PHOTONS} to {_MOST_PHOTONS}")
    if args.seed < 0:
        raise ConfigError("seed", args.seed, "0 or more")
    # What a photon left at is known to half a degree.
    beams = read_degrees("beam_deg", args.beam_deg, 4.0, 360.0) if args.beam_deg else ()
    off_axis = read_degrees("off_axis_deg", args.off_axis_deg, 0.0, 180.0)
    if args.water is not None or args.turbidity is not None:
        return _case(args, beams, off_axis)
    for name in ("range_m", "attenuation"):
        if getattr(args, name) is not None:
            raise ConfigError(name.removesuffix("_m"), getattr(args, name), "goes with --water NAME, for one case")
    phases = args.phases or PHASES
    for phase in phases:
        load_phase(phase)
        if args.make_table is None:
            load_halo(phase)
    folder = args.out if args.make_table is None else args.make_table
    if folder is not None:
        make_folder(folder)
    saving = Saving()
    checks: list[HaloCheck] = []
    narrow: list[list[BeamCheck]] = []
    with counting_progress() as progress:
        for phase in phases:
            task = progress.add_task(f"photons in {phase}", total=BATCHES)
            told = partial(progress.advance, task)
            if args.make_table is not None:
                grid = make_grid(phase, count_photons(load_phase(phase), args.photons, args.seed, told))
                saving.attempt(args.make_table / f"{phase}.npz", partial(save_halo, grid))
            else:
                batches = send_photons(phase, args.photons, args.seed, told)
                checks.append(check_halo(phase, batches))
                narrow.append([check_beam(phase, batches, beam_deg, off_axis) for beam_deg in beams])
    if args.make_table is not None:
        sizes = {Path(table).stem: Path(table).stat().st_size for table in saving.written}
        _tell(args, {"photons": args.photons, "bytes": sizes}, [f"{p}.npz: {n} bytes" for p, n in sizes.items()])
        return saving.finish(exit_codes.DONE)
    if args.out is not None:
        saving.attempt(args.out / "halo.png", lambda path: draw_halo(path, checks))
        if beams:
            saving.attempt(args.out / "beam.png", lambda path: draw_beams(path, narrow))
    rows: list[dict[str, Any]] = [
        _verdict(check) | {"beams": [beam_verdict(beam) for beam in found]}
        for check, found in zip(checks, narrow, strict=True)
    ]
    if args.json:
        print(json.dumps({"target": 0.1, "phases": rows}, allow_nan=False))
    else:
        _print(rows)
        if beams:
            print_beams(rows)
    verdicts = [verdict for row in rows for verdict in (row, *row["beams"])]
    good = all(verdict["judged"] and verdict["greatest_deviation"] <= 0.1 for verdict in verdicts)
    return saving.finish(exit_codes.DONE if good else exit_codes.NOT_MET)


def _case(args: Halo, beams: Sequence[float], off_axis: tuple[float, ...]) -> int:
    if args.range_m is None:
        raise ConfigError("range", None, "--range M, the distance to the lamp")
    if args.water is not None and args.turbidity is not None:
        raise ConfigError("turbidity", args.turbidity, "either it or --water: it is a water of its own")
    with named_by_flag(attenuation_per_m="attenuation", turbidity_per_m="turbidity"):
        water = water_of(args.water or "", args.attenuation, args.turbidity)
    name = args.water or water.name
    case = halo_case(water, args.range_m, args.wavelength_nm)
    narrow: list[dict[str, Any]] = []
    if beams:
        with counting_progress() as progress:
            told = partial(progress.advance, progress.add_task("photons", total=BATCHES))
            narrow = beam_cases(water, case, beams, off_axis, (args.photons, args.seed, told))
    halo, wells = _by_angle(case.halo), _by_angle(case.wells)
    plain = {
        "water": name,
        "range_m": args.range_m,
        "attenuation_per_m": water.attenuation[0],
        "wavelength_nm": args.wavelength_nm,
        "absorption_per_m": case.absorption_per_m,
        "scattering_per_m": case.scattering_per_m,
        "scattering_depth": case.scattering_depth,
        "phase_function": case.phase,
        "definition": _DEFINITION,
        "within": _by_angle(case.core + case.halo),
        "core": case.core,
        "halo_within": halo,
        "halo_standard_error": _by_angle(case.error),
        "comparison": {
            "model": "Wells 1973",
            "scattering_angle_rad": water.scattering_angle_rad,
            "within": _by_angle(case.core + case.wells),
            "halo_within": wells,
        },
        "beams": narrow,
    }
    if args.json:
        print(json.dumps(plain, allow_nan=False))
        return 0
    console = output()
    console.print(
        f"{name} at {args.range_m:g} m, {args.wavelength_nm:g} nm: a = {case.absorption_per_m:.3g} 1/m, "
        f"b = {case.scattering_per_m:.3g} 1/m, b r = {case.scattering_depth:.3g}, {case.phase}; "
        f"unscattered {case.core:.3g}",
        highlight=False,
    )
    table = Table(title="light arriving within a half angle about the lamp", title_justify="left")
    for column in ("half angle", "all", "scattered", "± %", "scattered, Wells", "Wells / photons"):
        table.add_column(column, justify="right")
    for i, degrees in enumerate(HALF_ANGLES_DEG):
        table.add_row(
            f"{degrees:g}°",
            f"{case.core + case.halo[i]:.3g}",
            f"{case.halo[i]:.3g}",
            f"{100.0 * case.error[i]:.1f}",
            f"{case.wells[i]:.3g}",
            f"{case.wells[i] / case.halo[i]:.2f}",
        )
    console.print(table)
    console.print(f"{_DEFINITION}; the simulator flies the table; Wells (1973) is for comparison", highlight=False)
    for beam in narrow:
        print_beam_case(beam)
    return 0


def _by_angle(values: Array) -> dict[str, float]:
    return {f"{degrees:g}": float(value) for degrees, value in zip(HALF_ANGLES_DEG, values, strict=True)}


def _tell(args: Halo, plain: dict[str, Any], lines: Sequence[str]) -> None:
    if args.json:
        print(json.dumps(plain, allow_nan=False))
    else:
        print("\n".join(lines))


def _verdict(check: HaloCheck) -> dict[str, Any]:
    judged = check.judged
    off = np.abs(check.ratio - 1.0)
    wells = check.wells[:, :, None, :] / check.fresh
    return {
        "phase": check.phase,
        "photons": check.photons,
        "readings": judged.size,
        "judged": int(judged.sum()),
        "within_10_percent": int((off[judged] <= 0.1).sum()),
        "greatest_deviation": float(off[judged].max(initial=0.0)),
        "rms_deviation": float(np.sqrt(np.mean(off[judged] ** 2))) if judged.any() else 0.0,
        "greatest_table_error": float(check.table_error.max()),
        "table_over_photons": [
            {"scattering_depth": br, "least": float(ratio[known].min()), "most": float(ratio[known].max())}
            for br, ratio, known in zip(CHECKED_BR, check.ratio, judged, strict=True)
            if known.any()
        ],
        "wells_over_photons": [
            {"scattering_angle_rad": theta0, "least": float(w[judged].min()), "most": float(w[judged].max())}
            for theta0, w in zip(WELLS_RAD, wells, strict=True)
            if judged.any()
        ],
    }


def _print(rows: Sequence[dict[str, Any]]) -> None:
    console = output()
    title = "halo within 0.2° to 40°, b r 0.5 to 20, a/b 0.05 to 1: table over fresh photons"
    table = Table(title=title, title_justify="left")
    columns = ("phase function", "readings", "judged", "within 10 %", "greatest", "rms", "table's error up to")
    for name in columns:
        table.add_column(name, justify="left" if name == columns[0] else "right")
    for row in rows:
        shares = [row[name] for name in ("greatest_deviation", "rms_deviation", "greatest_table_error")]
        counts = [str(row[name]) for name in ("readings", "judged", "within_10_percent")]
        table.add_row(row["phase"], *counts, *(f"{100 * value:.1f} %" for value in shares))
    console.print(table)
    title = "Wells' function over fresh photons: least to most"
    table = Table(title=title, title_justify="left")
    table.add_column("phase function")
    for theta0 in WELLS_RAD:
        table.add_column(f"θ0 = {theta0:g} rad", justify="right")
    for row in rows:
        table.add_row(row["phase"], *(f"{w['least']:.2f} to {w['most']:.2f}" for w in row["wells_over_photons"]))
    console.print(table)
    console.print("judged: where three standard errors of the fresh photons are 10 % or less", highlight=False)
