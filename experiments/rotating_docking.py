"""Docking by the rotating beacon against the same starts without it, and what spoils it (paper B as a closed loop).

Every arm flies the same seeds: start, current, compass datum and sensor noise are the same draws in each, so that arms
can be compared pair by pair.
"""

from __future__ import annotations

import hashlib
import json
import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from auvdock.campaign.statistics import McNemar, Rate, mcnemar, wilson
from auvdock.core.beacons import BeaconCfg
from auvdock.core.errors import ConfigError
from auvdock.core.strict import to_plain
from auvdock.episode.config import EpisodeCfg, level_cfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeSetup
from auvdock.experiments.kept import Kept
from auvdock.metrics.tick import Tick

__all__ = [
    "ARMS",
    "FALSE_LIGHT",
    "Arm",
    "ArmSummary",
    "Flight",
    "arm_cfg",
    "fly_arm",
    "paired",
    "pick_arms",
    "summarise",
]

FALSE_LIGHT = BeaconCfg("false", "long_range", (-1.0, 4.0, 1.2), (-1.0, 1.0, 0.0), 450.0, 30.0, 0.35, 360.0)
"""A steady lamp of the beacon's colour and power that shines all around, 4 m beside the station."""


@dataclass(frozen=True)
class Arm:
    """One way to fly the seeds.

    Attributes:
        name: for the command line.
        title: in words.
        current_m_s: speed of the current, from anywhere.
        world: further changes of the world's configuration.
    """

    name: str
    title: str
    current_m_s: float = 0.1
    world: dict[str, Any] = field(default_factory=dict)


ARMS = (
    Arm("beacon", "rotating beacon, 0.1 m/s"),
    Arm("beacon-0.3", "rotating beacon, 0.3 m/s", 0.3),
    Arm("fixed", "fixed lamps alone, 0.1 m/s", world={"station": {"rotating": None}}),
    Arm("clock", "clock 50 ms off", world={"clock": {"offset_s": 0.05}}),
    Arm("drops", "one frame in five lost", world={"frame_drop_share": 0.2}),
    Arm("false-light", "second, steady light", world={"extra_lights": [to_plain(FALSE_LIGHT)]}),
)
"""The first two are the task, the third the comparison, the others scenarios."""


@dataclass(frozen=True)
class Flight:
    """One episode of an arm.

    Attributes:
        seed: decides everything.
        result: its outcome and metrics, without configuration.
        path_m: (x, y) of the vehicle in the station frame every second.
    """

    seed: int
    result: EpisodeResult
    path_m: tuple[tuple[float, float], ...]

    @property
    def behind(self) -> bool:
        """Whether the start lay behind the station, beyond ±90° of azimuth."""
        azimuth = self.result.start_azimuth_rad
        return azimuth is not None and abs(azimuth) > math.pi / 2.0


@dataclass(frozen=True)
class ArmSummary:
    """An arm in figures; medians over the episodes in which it happened, angles in degrees.

    Attributes:
        arm: the arm.
        docked: success rate with Wilson's interval.
        front: of the starts within ±90° of the axis.
        behind: of the others.
        acquire_s: median time to the first azimuth or pose.
        first_pose_s: median time to the first pose.
        time_s: median time of the successful episodes.
        azimuth_rms_deg: root mean square error of all azimuth fixes.
        azimuth_median_deg: median over the episodes of their root mean square error.
        handover_deg: median magnitude of the azimuth error when the fixed lamps took over.
        failures: episodes per failure reason.
    """

    arm: Arm
    docked: Rate
    front: Rate
    behind: Rate
    acquire_s: float | None
    first_pose_s: float | None
    time_s: float | None
    azimuth_rms_deg: float | None
    azimuth_median_deg: float | None
    handover_deg: float | None
    failures: dict[str, int]


def pick_arms(names: Sequence[str]) -> tuple[Arm, ...]:
    """Arms by name, in the order of `ARMS`.

    Raises:
        ConfigError: no such arm, or none at all.
    """
    known = [arm.name for arm in ARMS]
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise ConfigError("arms", unknown[0] if unknown else "none", f"one or more of {', '.join(known)}")
    return tuple(arm for arm in ARMS if arm.name in names)


def arm_cfg(arm: Arm, fidelity: str = "beacons") -> EpisodeCfg:
    """Level 1 of the rotating beacon with the arm's changes."""
    world = {"fidelity": fidelity, "sim": {"current": {"speed_m_s": arm.current_m_s}}, **arm.world}
    return level_cfg(1, "rotating").override({"world": world})


def fly_arm(
    arm: Arm,
    seeds: Sequence[int],
    fidelity: str = "beacons",
    workers: int = 1,
    done: Callable[[], object] = lambda: None,
    kept: Kept | None = None,
) -> tuple[Flight, ...]:
    """Fly the seeds, in order whatever the number of processes.

    Args:
        arm: what to fly.
        seeds: which episodes.
        fidelity: "beacons" or "pixels".
        workers: processes.
        done: called after each episode.
        kept: holds earlier flights, which are not flown again, and takes each new one as it ends.
    """
    kept = kept or Kept()
    cfg = arm_cfg(arm, fidelity)
    digest = hashlib.sha256(json.dumps(to_plain(cfg), sort_keys=True).encode()).hexdigest()
    flights: dict[int, Flight] = {}

    def key(seed: int) -> dict[str, object]:
        return {"arm": arm.name, "config_sha256": digest, "seed": seed}

    def keep(flight: Flight) -> None:
        kept.add(key(flight.seed), flight)
        flights[flight.seed] = flight
        done()

    for seed in seeds:
        if (flight := kept.find(Flight, key(seed))) is not None:
            flights[seed] = flight
            done()
    missing = [seed for seed in seeds if seed not in flights]
    if workers <= 1:
        runner = EpisodeRunner(cfg)
        for seed in missing:
            keep(_fly(runner, seed))
    else:
        with ProcessPoolExecutor(workers) as pool:
            for finished in as_completed([pool.submit(_fly_alone, cfg, seed) for seed in missing]):
                keep(finished.result())
    return tuple(flights[seed] for seed in seeds)


def summarise(arm: Arm, flights: Sequence[Flight]) -> ArmSummary:
    """Rates, medians and errors of an arm's flights."""
    results = [flight.result for flight in flights]
    fixes = [(r.azimuth_fixes, r.azimuth_rms_rad) for r in results if r.azimuth_fixes and r.azimuth_rms_rad is not None]
    pooled = None
    if fixes:
        pooled = math.degrees(math.sqrt(sum(n * rms * rms for n, rms in fixes) / sum(n for n, _ in fixes)))
    handovers = [abs(r.handover_azimuth_error_rad) for r in results if r.handover_azimuth_error_rad is not None]
    return ArmSummary(
        arm=arm,
        docked=_rate(flights),
        front=_rate([flight for flight in flights if not flight.behind]),
        behind=_rate([flight for flight in flights if flight.behind]),
        acquire_s=_median([r.acquire_s for r in results]),
        first_pose_s=_median([r.first_pose_s for r in results]),
        time_s=_median([r.time_s for r in results if r.success]),
        azimuth_rms_deg=pooled,
        azimuth_median_deg=_degrees(_median([rms for _, rms in fixes])),
        handover_deg=_degrees(_median(handovers)),
        failures=dict(Counter(r.failure_reason for r in results if r.failure_reason is not None)),
    )


def paired(first: Sequence[Flight], second: Sequence[Flight]) -> McNemar:
    """McNemar's test of two arms over the seeds that both have flown."""
    one = {flight.seed: flight.result.success for flight in first}
    other = {flight.seed: flight.result.success for flight in second}
    counts = Counter((one[seed], other[seed]) for seed in one.keys() & other.keys())
    return mcnemar(counts[True, True], counts[True, False], counts[False, True], counts[False, False])


class _Path:
    """Observer that keeps where the vehicle was, once a second."""

    def __init__(self) -> None:
        self.places: list[tuple[float, float]] = []
        self._next_s = 0.0

    def on_start(self, setup: EpisodeSetup) -> None:
        """Remember where the station is."""
        self._origin = np.asarray(setup.T_world_station)[:2, 3]

    def on_tick(self, tick: Tick) -> None:
        """Keep a place."""
        if tick.truth.time_s >= self._next_s - 1e-9:
            self._next_s += 1.0
            x, y = (tick.truth.T_world_body[:2, 3] - self._origin).tolist()
            self.places.append((x, y))

    def on_end(self, result: EpisodeResult) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


def _fly(runner: EpisodeRunner, seed: int) -> Flight:
    path = _Path()
    result = runner.run(seed, [path])
    return Flight(seed, replace(result, config={}, versions={}), tuple(path.places))


def _fly_alone(cfg: EpisodeCfg, seed: int) -> Flight:
    return _fly(EpisodeRunner(cfg), seed)


def _rate(flights: Sequence[Flight]) -> Rate:
    return wilson(sum(flight.result.success for flight in flights), len(flights))


def _present(values: Sequence[float | None]) -> Iterator[float]:
    return (value for value in values if value is not None)


def _median(values: Sequence[float | None]) -> float | None:
    present = list(_present(values))
    return statistics.median(present) if present else None


def _degrees(value: float | None) -> float | None:
    return None if value is None else math.degrees(value)
