"""`auvdock bench`: speed on this machine, on one core, as ratios that can be compared between machines."""

from __future__ import annotations

import json
import os
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from rich.table import Table

from auvdock.cli.console import output, track
from auvdock.cli.parsing import at_least, parse
from auvdock.core.errors import GraphicsError
from auvdock.envs.docking import DockingEnv
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.stations import STATIONS
from auvdock.sim.mj import mujoco

__all__ = ["Bench", "run"]


@dataclass(frozen=True)
class Bench:
    """Measure speed on one core: physics, camera, perception, pilot, and whole closed-loop episodes."""

    json: bool = False
    """Print one JSON object and nothing else."""
    episodes: int = 3
    """Closed-loop episodes per fidelity; the median counts."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Bench, argv, prog)
    at_least(1, episodes=args.episodes)
    _pin_to_one_core()
    steps: list[tuple[str, Callable[[], dict[str, Any]]]] = [
        ("physics", _physics),
        ("state observation", _state_env),
        ("beacons", lambda: _episodes("beacons", args.episodes)),
        ("pixels", lambda: _episodes("pixels", args.episodes)),
        ("rotating beacons", lambda: _episodes("beacons", args.episodes, "rotating")),
        ("rotating pixels", lambda: _episodes("pixels", args.episodes, "rotating")),
        ("landing beacons", lambda: _episodes("beacons", args.episodes, "landing")),
        ("landing pixels", lambda: _episodes("pixels", args.episodes, "landing")),
    ]
    report: dict[str, Any] = {"cores": 1, "machine_cores": os.cpu_count()}
    shown = steps if args.json else track(steps, "measuring")
    for name, measure in shown:
        try:
            report[name.replace(" ", "_")] = measure()
        except GraphicsError as error:
            report[name.replace(" ", "_")] = {"skipped": str(error)}
    if args.json:
        print(json.dumps(report))
    else:
        _print(report)
    return 0


def _pin_to_one_core() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    os.environ.setdefault("LP_NUM_THREADS", "0")  # Mesa's software rasteriser would start threads of its own
    cv2.setNumThreads(1)


def _seconds_per_call(call: Callable[[], object], calls: int, rounds: int = 5) -> float:
    samples: list[float] = []
    for _ in range(rounds):
        start = time.perf_counter()
        for _ in range(calls):
            call()
        samples.append((time.perf_counter() - start) / calls)
    return statistics.median(samples)


def _physics() -> dict[str, Any]:
    runner = EpisodeRunner(_cfg("beacons"))
    world = runner.world
    world.reset(0)
    command = np.full(len(world.simulator.vehicle.actuators), 0.2)
    step_s = _seconds_per_call(lambda: world.simulator.step(command), 1000)
    data = mujoco.MjData(world.simulator.model)
    bare_s = _seconds_per_call(lambda: mujoco.mj_step(world.simulator.model, data), 1000)
    rate_hz = world.simulator.cfg.physics_hz
    return {
        "steps_per_s": 1.0 / step_s,
        "step_us": step_s * 1e6,
        "bare_mj_step_us": bare_s * 1e6,
        "ratio_to_bare_mj_step": step_s / bare_s,
        "real_time_factor": 1.0 / (step_s * rate_hz),
    }


def _state_env() -> dict[str, Any]:
    env = DockingEnv(observation="state")
    env.reset(seed=0)
    action = np.zeros(env.action_space.shape or (), dtype=np.float32)
    step_s = _seconds_per_call(lambda: env.step(action), 300)
    return {"env_steps_per_s": 1.0 / step_s}


def _episodes(fidelity: str, count: int, station: str = "conical") -> dict[str, Any]:
    runner = EpisodeRunner(_cfg(fidelity, station))
    runner.run(0)  # not timed: on a new machine it compiles the inner loops, which is done once
    clock = _StageClock()
    clock.attach(runner)
    factors: list[float] = []
    simulated_s = 0.0
    for seed in range(count):
        result = runner.run(seed)
        factors.append(result.real_time_factor)
        simulated_s += result.time_s
    frames = simulated_s * runner.cfg.world.camera.rate_hz
    wall_ms = 1e3 * sum(clock.seconds.values())
    return {
        "real_time_factor": statistics.median(factors),
        "real_time_factor_min": min(factors),
        "episodes": count,
        "simulated_s": simulated_s,
        "ms_per_frame": {name: 1e3 * spent / frames for name, spent in clock.seconds.items()},
        "share": {name: 1e3 * spent / wall_ms for name, spent in clock.seconds.items()},
        "latency_ms": clock.latency_ms(),
    }


class _StageClock:
    """Adds up the time that each stage of the loop takes, by wrapping the runner's own calls."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._calls: dict[str, list[float]] = {}

    def latency_ms(self) -> dict[str, float]:
        """Time from a frame to its command, perception and pilot together, over all control periods."""
        parts = zip(self._calls["perception"], self._calls["pilot"], strict=False)
        spent = 1e3 * np.array([sum(part) for part in parts])
        return {"median": float(np.median(spent)), "p95": float(np.percentile(spent, 95.0)), "max": float(spent.max())}

    def attach(self, runner: EpisodeRunner) -> None:
        self._wrap(runner.world, "step", "physics")
        self._wrap(runner.world, "sense", "optics")
        self._wrap(runner.perceiver, "perceive", "perception")
        self._wrap(runner.pilot, "step", "pilot")

    def _wrap(self, owner: Any, method: str, name: str) -> None:  # noqa: ANN401
        original = getattr(owner, method)
        self.seconds[name] = 0.0
        calls = self._calls.setdefault(name, [])

        def timed(*args: Any) -> Any:  # noqa: ANN401
            start = time.perf_counter()
            try:
                return original(*args)
            finally:
                spent = time.perf_counter() - start
                self.seconds[name] += spent
                calls.append(spent)

        object.__setattr__(owner, method, timed)


def _cfg(fidelity: str, station: str = "conical") -> AnyEpisodeCfg:
    return STATIONS[station].level(1).override({"world": {"fidelity": fidelity}})


def _print(report: dict[str, Any]) -> None:
    table = Table(title="auvdock bench, one core", title_justify="left")
    table.add_column("part")
    table.add_column("figure", justify="right")
    for part, figures in report.items():
        if isinstance(figures, dict):
            _rows(table, part, figures)
    output().print(table)


def _rows(table: Table, prefix: str, figures: dict[str, Any]) -> None:
    for name, value in figures.items():
        if isinstance(value, dict):
            _rows(table, f"{prefix}.{name}", value)
        else:
            table.add_row(f"{prefix}.{name}", f"{value:.3g}" if isinstance(value, float) else str(value))
