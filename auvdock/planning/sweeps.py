"""How the guidance space changes with beam angle, number of lights and tilt of the array."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass

from auvdock.core.beacons import BeaconLayout
from auvdock.core.errors import ConfigError
from auvdock.core.station import ConicalStationCfg
from auvdock.planning.region import GuidanceSpace, PlanCfg, guidance_space

__all__ = ["SweepPoint", "sweep", "variants"]

BEAM_ANGLES_DEG = (10.0, 20.0, 30.0, 45.0, 60.0, 90.0)
COUNTS = (4, 5, 6, 8, 10)
TILTS_DEG = (-6.0, 0.0, 6.0, 12.0, 18.0)


@dataclass(frozen=True)
class SweepPoint:
    """One layout of a sweep.

    Attributes:
        quantity: what was varied: "beam_angle_deg", "lights", "tilt_deg".
        value: its value.
        volume_m3: the region's volume.
        range_m: its range along the approach axis.
        half_angle_deg: its half angle.
        volume_per_watt_m3: volume over the array's power.
    """

    quantity: str
    value: float
    volume_m3: float
    range_m: float
    half_angle_deg: float
    volume_per_watt_m3: float


def variants(station: ConicalStationCfg) -> list[tuple[str, float, BeaconLayout]]:
    """The layouts of all three sweeps; the array's total power stays that of the station.

    Raises:
        ConfigError: the station lists its lights one by one and has no ring to vary.
    """
    if station.array_count < 4:
        raise ConfigError("array_count", station.array_count, "a station with a ring of 4 lights or more to sweep over")
    total_w = station.array_count * station.array_power_w
    found: list[tuple[str, float, BeaconLayout]] = []
    for angle in BEAM_ANGLES_DEG:
        found.append(("beam_angle_deg", angle, dataclasses.replace(station, array_beam_angle_deg=angle).layout))
    for count in COUNTS:
        ring = dataclasses.replace(station, array_count=count, array_power_w=total_w / count)
        found.append(("lights", float(count), ring.layout))
    for tilt in TILTS_DEG:
        found.append(("tilt_deg", tilt, dataclasses.replace(station, array_tilt_deg=tilt).layout))
    return found


def sweep(
    cases: Sequence[tuple[str, float, BeaconLayout]],
    cfg: PlanCfg,
    tick: Callable[[], object] | None = None,
    workers: int | None = None,
) -> list[SweepPoint]:
    """Regions of all layouts, in processes; `tick` is called after each."""
    points: dict[int, SweepPoint] = {}
    with ProcessPoolExecutor(workers or os.cpu_count() or 1) as pool:
        jobs = {pool.submit(guidance_space, layout, cfg): index for index, (_, _, layout) in enumerate(cases)}
        for done in as_completed(jobs):
            index = jobs[done]
            space: GuidanceSpace = done.result()
            quantity, value, _ = cases[index]
            points[index] = SweepPoint(
                quantity,
                value,
                space.volume_m3,
                space.range_m,
                space.half_angle_deg,
                space.volume_m3 / space.power_w,
            )
            if tick is not None:
                tick()
    return [points[index] for index in range(len(cases))]
