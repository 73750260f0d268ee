"""`auvdock reproduce vehicle`: a BlueROV2's tank run and REMUS' stability and turning beside our vehicles'."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import output
from auvdock.cli.parsing import named_by_flag, parse
from auvdock.core.vehicle import VehicleCfg, load_vehicle
from auvdock.experiments.tank_run import ASSUMED, TankRow, compare_tank
from auvdock.experiments.turning import (
    FOSSEN,
    PRESTERO,
    SGARIOTO,
    SPEED_M_S,
    PlanarSet,
    course_eigenvalues,
    pitch_eigenvalues,
    turn,
)

__all__ = ["Vehicle", "run_vehicle"]

_SPEEDS_M_S = (0.25, 0.5, 1.0, SPEED_M_S, 2.0, 2.5)


@dataclass(frozen=True)
class Vehicle:
    """The vehicles beside published runs and models: steady speeds by stick, eigenvalues, turning circles.

    Exit code: 0; it judges nothing.
    """

    voltage: float | None = None
    """Supply of the BlueROV2's thrusters in V, 10 to 20; by default 14, 14.8, 16 and 18."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_vehicle(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Vehicle, argv, prog)
    voltages = (14.0, 14.8, 16.0, 18.0) if args.voltage is None else (args.voltage,)
    with named_by_flag(voltage_v="voltage"):
        tank = {voltage: compare_tank(voltage) for voltage in voltages}
    torpedo = load_vehicle("remus_hybrid")
    turns, stability = _turns(torpedo), _stability(torpedo)
    if args.json:
        plain = {
            "tank": {
                "assumed": ASSUMED,
                "by_voltage": {
                    f"{voltage:g}": [{**asdict(row), "deviation": row.deviation} for row in rows]
                    for voltage, rows in tank.items()
                },
            },
            "turns": {"speed_m_s": SPEED_M_S, "models": turns},
            "stability": stability,
        }
        print(json.dumps(plain, allow_nan=False))
    else:
        _print_tank(tank)
        _print_remus(turns, stability)
    return exit_codes.DONE


def _turns(torpedo: VehicleCfg) -> list[dict[str, Any]]:
    models: dict[str, VehicleCfg | PlanarSet] = {"ours": torpedo, PRESTERO.name: PRESTERO, SGARIOTO.name: SGARIOTO}
    rows: list[dict[str, Any]] = [
        {"model": name, **asdict(turn(model, angle))} for name, model in models.items() for angle in FOSSEN
    ]
    for angle, radius_m in FOSSEN.items():
        rows.append({"model": "Fossen remus100", "rudder_deg": angle, "radius_m": radius_m})
    return rows


def _stability(torpedo: VehicleCfg) -> list[dict[str, Any]]:
    """Greatest real parts of the eigenvalues, 1/s."""
    return [
        {
            "speed_m_s": speed,
            "course_1_s": course_eigenvalues(torpedo, speed)[0].real,
            "pitch_1_s": pitch_eigenvalues(torpedo, speed)[0].real,
            "prestero_course_1_s": course_eigenvalues(PRESTERO, speed)[0].real,
            "sgarioto_course_1_s": course_eigenvalues(SGARIOTO, speed)[0].real,
        }
        for speed in _SPEEDS_M_S
    ]


def _print_tank(tank: dict[float, list[TankRow]]) -> None:
    table = Table(title="BlueROV2 Heavy: steady speed in m/s by stick, to either side", title_justify="left")
    for name in ("axis", "stick", "published", *(f"{voltage:g} V" for voltage in tank)):
        table.add_column(name, justify="left" if name == "axis" else "right")
    for row in zip(*tank.values(), strict=True):
        ours = (f"{_between(each.ours_m_s)} {100.0 * each.deviation:+.0f}%" for each in row)
        table.add_row(row[0].axis, f"±{row[0].stick:g}", _between(row[0].published_m_s), *ours)
    output().print(table)
    output().print(f"assumed: {'; '.join(ASSUMED)}", highlight=False)


def _between(speeds: tuple[float, float]) -> str:
    low, high = (f"{speed:.2f}" for speed in speeds)
    return low if low == high else f"{low} to {high}"


def _print_remus(turns: Sequence[dict[str, Any]], stability: Sequence[dict[str, Any]]) -> None:
    table = Table(title=f"REMUS: steady turn at {SPEED_M_S:g} m/s by rudder", title_justify="left")
    for name in ("model", "rudder", "radius", "yaw rate", "drift"):
        table.add_column(name, justify="left" if name == "model" else "right")
    for row in turns:
        rate, drift = row.get("yaw_rate_deg_s"), row.get("drift_deg")
        table.add_row(
            row["model"],
            f"{row['rudder_deg']:g}°",
            f"{row['radius_m']:.1f} m",
            "-" if rate is None else f"{rate:.1f} °/s",
            "-" if drift is None else f"{drift:.1f}°",
        )
    output().print(table)
    table = Table(title="REMUS hands off: greatest real part of the eigenvalues in 1/s", title_justify="left")
    for name in ("speed", "ours, course", "ours, pitch", "Prestero, course", "Sgarioto, course"):
        table.add_column(name, justify="right")
    for row in stability:
        speed, *values = row.values()
        table.add_row(f"{speed:g} m/s", *(f"{value:+.2f}" for value in values))
    output().print(table)
