"""What `auvdock reproduce halo --beam-deg` tells: narrow beams off their axis, what is flown against photons."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from auvdock.cli.console import output
from auvdock.core.arrays import Array, BoolArray
from auvdock.core.errors import ConfigError
from auvdock.experiments.beam_check import BeamCheck, check_beam, flown_beam
from auvdock.experiments.halo_check import HALF_ANGLES_DEG, WELLS_RAD, HaloCase, send_batches
from auvdock.optics.halo import halo_of
from auvdock.optics.light import beam_profile
from auvdock.optics.water import WaterCfg

__all__ = ["BEAM_DEFINITION", "beam_cases", "beam_verdict", "print_beam_case", "print_beams", "read_degrees"]

BEAM_DEFINITION = (
    "radiance integrated over solid angle at a receiver off_axis_deg from the beam's axis, over what would arrive on "
    "the axis by inverse square alone without water; scattered: from all directions, scattered_in_front: from the half "
    "sphere before the receiver, within: within the half angle about the lamp, core included"
)


_SHOWN_DEG = (1.0, 10.0, 40.0)


def read_degrees(name: str, words: Sequence[str], low: float, high: float) -> tuple[float, ...]:
    """Angles given with commas or spaces between them.

    Raises:
        ConfigError: no number, or one beyond low to high.
    """
    given = [part for word in words for part in word.split(",") if part]
    try:
        degrees = tuple(float(part) for part in given)
    except ValueError:
        degrees = ()
    if not degrees or not all(low <= one <= high for one in degrees):
        raise ConfigError(name, ",".join(given), f"angles of {low:g} to {high:g}, as 5,10")
    return degrees


def beam_cases(
    water: WaterCfg,
    case: HaloCase,
    beams_deg: Sequence[float],
    off_axis_deg: tuple[float, ...],
    sent: tuple[int, int, Callable[[], object]],
) -> list[dict[str, Any]]:
    """Beams in one water at one range, all from the same photons: plain data.

    Args:
        water: for what is flown in it.
        case: of `halo_case`.
        beams_deg: full angles of the beams.
        off_axis_deg: angles of the line of sight with their axes.
        sent: photons, seed, and what is called after each of the ten batches.
    """
    photons, seed, told = sent
    at = (np.array([case.scattering_depth]), np.array([case.absorption_per_m / case.scattering_per_m]))
    batches = send_batches(case.phase, photons, seed, at, told)
    return [_case(water, case, check_beam(case.phase, batches, beam_deg, off_axis_deg)) for beam_deg in beams_deg]


def _case(water: WaterCfg, case: HaloCase, check: BeamCheck) -> dict[str, Any]:
    angle, depth = np.radians(check.off_axis_deg), case.scattering_depth
    left = case.core * math.exp(depth)
    flown = left * flown_beam(halo_of(water), depth, check.beam_deg, angle)
    profile = beam_profile(angle, check.beam_deg)
    rows: list[dict[str, Any]] = []
    for j, degrees in enumerate(check.off_axis_deg):
        core, within = case.core * float(profile[j]), left * check.within[0, 0, j]
        rows.append(
            {
                "off_axis_deg": degrees,
                "core": core,
                "scattered": left * float(check.fresh[0, 0, j]),
                "scattered_standard_error": _finite(check.error[0, 0, j]),
                "scattered_in_front": left * float(check.front[0, 0, j]),
                "scattered_in_front_standard_error": _finite(check.front_error[0, 0, j]),
                "scattered_by_table": left * float(check.table[0, 0, j]),
                "scattered_as_flown": float(flown[j]),
                "within": _by_angle(core + within),
                "halo_within": _by_angle(within),
                "isotropic_halo_times_profile": _by_angle(left * check.lamp[0, 0, j]),
                "halo_standard_error": _by_angle(check.within_error[0, 0, j]),
            }
        )
    return {"beam_deg": check.beam_deg, "photons": check.photons, "definition": BEAM_DEFINITION, "off_axis": rows}


def beam_verdict(check: BeamCheck) -> dict[str, Any]:
    """How table and flown model compare with photons over all readings: plain data."""
    judged, front = check.judged, check.front_judged
    off = np.abs(check.table / check.fresh - 1.0)
    flown, wells = check.flown / check.fresh, check.wells[:, :, None, :] / check.fresh
    lamp, known = check.lamp / check.within, check.within_judged
    return {
        "beam_deg": check.beam_deg,
        "off_axis_deg": list(check.off_axis_deg),
        "readings": judged.size,
        "judged": int(judged.sum()),
        "within_10_percent": int((off[judged] <= 0.1).sum()),
        "greatest_deviation": float(off[judged].max(initial=0.0)),
        "rms_deviation": float(np.sqrt(np.mean(off[judged] ** 2))) if judged.any() else 0.0,
        "table_over_front": _range(check.table / check.front, front),
        "front_within_10_percent": int((np.abs(check.table / check.front - 1.0)[front] <= 0.1).sum()),
        "front_judged": int(front.sum()),
        "flown_over_photons": [
            {"off_axis_deg": degrees} | _range(flown[..., j], judged[..., j])
            for j, degrees in enumerate(check.off_axis_deg)
        ],
        "wells_over_photons": [
            {"scattering_angle_rad": theta0, "off_axis_deg": degrees} | _range(ratio[..., j], judged[..., j])
            for theta0, ratio in zip(WELLS_RAD, wells, strict=True)
            for j, degrees in enumerate(check.off_axis_deg)
        ],
        "isotropic_halo_times_profile_over_photons": [
            {"off_axis_deg": degrees, "half_angle_deg": half_angle} | _range(lamp[:, :, j, m], known[:, :, j, m])
            for j, degrees in enumerate(check.off_axis_deg)
            for m, half_angle in enumerate(HALF_ANGLES_DEG)
        ],
    }


def print_beam_case(beam: dict[str, Any]) -> None:
    """A table of one beam in one case."""
    title = f"beam of {beam['beam_deg']:g}°, {beam['photons']:,} photons: scattered light, all and from in front"
    table = Table(title=title, title_justify="left")
    for name in ("off", "all", "± %", "front", "table", "flown", "flown/all", "in 1°", "± %"):
        table.add_column(name, justify="right")
    for row in beam["off_axis"]:
        table.add_row(
            f"{row['off_axis_deg']:g}°",
            f"{row['scattered']:.2g}",
            _percent(row["scattered_standard_error"]),
            f"{row['scattered_in_front']:.2g}",
            f"{row['scattered_by_table']:.2g}",
            f"{row['scattered_as_flown']:.2g}",
            f"{row['scattered_as_flown'] / row['scattered']:.2f}" if row["scattered"] else "–",
            f"{row['halo_within']['1']:.2g}",
            _percent(row["halo_standard_error"]["1"]),
        )
    output().print(table)


def _print_spans(
    console: Console,
    title: str,
    off_axis_deg: Sequence[float],
    rows: Sequence[dict[str, Any]],
    spans: Callable[[dict[str, Any]], Sequence[dict[str, Any]]],
) -> None:
    """A table of least to most over all readings at each angle off the axis."""
    table = Table(title=title, title_justify="left")
    table.add_column("phase function")
    table.add_column("beam", justify="right")
    for degrees in off_axis_deg:
        table.add_column(f"{degrees:g}° off", justify="right")
    for row in rows:
        for beam in row["beams"]:
            table.add_row(row["phase"], f"{beam['beam_deg']:g}°", *(_span(one) for one in spans(beam)))
    console.print(table)


def print_beams(rows: Sequence[dict[str, Any]]) -> None:
    """Tables of the whole check."""
    console = output()
    title = "beams: light scattered from all directions, by the halo's table over fresh photons"
    table = Table(title=title, title_justify="left")
    columns = ("phase function", "beam", "readings", "judged", "within 10 %", "greatest", "rms", "over light in front")
    for name in columns:
        table.add_column(name, justify="left" if name == columns[0] else "right")
    for row in rows:
        for beam in row["beams"]:
            counts = [str(beam[name]) for name in ("readings", "judged", "within_10_percent")]
            shares = [f"{100 * beam[name]:.1f} %" for name in ("greatest_deviation", "rms_deviation")]
            table.add_row(row["phase"], f"{beam['beam_deg']:g}°", *counts, *shares, _span(beam["table_over_front"]))
    console.print(table)
    off_axis = rows[0]["beams"][0]["off_axis_deg"]
    _print_spans(console, "as flown, over fresh photons", off_axis, rows, lambda beam: beam["flown_over_photons"])
    for theta0 in WELLS_RAD:

        def model(beam: dict[str, Any], theta0: float = theta0) -> list[dict[str, Any]]:
            return [one for one in beam["wells_over_photons"] if one["scattering_angle_rad"] == theta0]

        _print_spans(console, f"Wells (1973), θ0 = {theta0:g} rad, over fresh photons", off_axis, rows, model)
    title = "fixed lamps, f(θ) times the isotropic halo by the table, over fresh photons: light within a half angle"
    table = Table(title=title, title_justify="left")
    for name in ("phase function", "beam", "within"):
        table.add_column(name)
    for degrees in rows[0]["beams"][0]["off_axis_deg"]:
        table.add_column(f"{degrees:g}° off", justify="right")
    for row in rows:
        for beam in row["beams"]:
            found = beam["isotropic_halo_times_profile_over_photons"]
            for half_angle in _SHOWN_DEG:
                spans = [_span(one) for one in found if one["half_angle_deg"] == half_angle]
                table.add_row(row["phase"], f"{beam['beam_deg']:g}°", f"{half_angle:g}°", *spans)
    console.print(table)


def _range(ratio: Array, judged: BoolArray) -> dict[str, float | None]:
    known = ratio[judged]
    return {"least": float(known.min()), "most": float(known.max())} if known.size else {"least": None, "most": None}


def _span(found: dict[str, float | None]) -> str:
    least, most = found["least"], found["most"]
    return "–" if least is None or most is None else f"{least:.2f} to {most:.2f}"


def _percent(error: float | None) -> str:
    return "–" if error is None else f"{100.0 * error:.1f}"


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _by_angle(values: Array) -> dict[str, float | None]:
    return {f"{degrees:g}": _finite(float(v)) for degrees, v in zip(HALF_ANGLES_DEG, values, strict=True)}
