"""One world, one pilot, one episode."""

from __future__ import annotations

import platform
import time
from collections.abc import Iterator, Sequence
from importlib.metadata import version

import cv2
import numpy as np

from auvdock.core.strict import to_plain
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.episode.result import EpisodeResult, stage_of
from auvdock.episode.stations import STATIONS, make_task
from auvdock.episode.trace import EpisodeObserver, EpisodeSetup
from auvdock.metrics.tick import Metrics, Tick
from auvdock.sim.mj import mujoco

__all__ = ["EpisodeRunner", "software_versions"]


def software_versions() -> dict[str, str]:
    """Versions of what an episode's numbers depend on."""
    return {
        "auvdock": version("auvdock"),
        "mujoco": mujoco.__version__,
        "numba": version("numba"),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "python": platform.python_version(),
    }


class EpisodeRunner:
    """Runs episodes of one configuration; reusable, since building the world costs more than resetting it."""

    def __init__(self, cfg: AnyEpisodeCfg) -> None:
        """Build world, perception and pilot.

        Raises:
            ConfigError: a name that does not exist or a value that does not fit.
        """
        self.cfg = cfg
        self.task = make_task(cfg)
        self.world = self.task.world
        self.perceiver = self.task.perceiver
        self.pilot = self.task.pilot
        self._plain_config = to_plain(cfg)
        self._versions = software_versions()

    def run(self, seed: int, observers: Sequence[EpisodeObserver] = ()) -> EpisodeResult:
        """Run one episode to its end.

        Interrupting it (KeyboardInterrupt) ends it as `interrupted`: observers get the result of what was flown, then
        the interrupt goes on to the caller.
        """
        started = time.perf_counter()
        metrics = self.task.metrics()
        setup = self._setup(seed)
        flight = _Flight()
        try:
            for observer in observers:
                observer.on_start(setup)
            try:
                for tick in self._ticks(seed, flight):
                    for each in metrics:
                        each.add(tick)
                    for observer in observers:
                        observer.on_tick(tick)
            except KeyboardInterrupt:
                flight.failure_reason = "interrupted"
                self._finish(self._result(seed, metrics, flight, started), observers)
                raise
            return self._finish(self._result(seed, metrics, flight, started), observers)
        finally:
            for observer in observers:
                observer.close()

    def _ticks(self, seed: int, flight: _Flight) -> Iterator[Tick]:
        world = self.world
        world.reset(seed)
        self.perceiver.reset()
        state = self.pilot.initial_state()
        while True:
            sensed = world.sense()
            began = time.perf_counter()
            percept = self.perceiver.perceive(sensed)
            if percept is not None:
                flight.frames_s.append(time.perf_counter() - began)
            command, state = self.pilot.step(state, percept, sensed.proprioception)
            flight.count(command.mode)
            image = sensed.frame.image if sensed.frame is not None else None
            yield Tick(world.truth, sensed.proprioception, image, percept, command)
            if command.giving_up:
                flight.failure_reason = stage_of(flight.stage, self.task.stages)
                return
            world.step(command.values)
            if world.is_success:
                return
            end = world.end
            if end is not None:
                flight.failure_reason = stage_of(flight.mode, self.task.stages) if end == "timeout" else end
                return

    def _setup(self, seed: int) -> EpisodeSetup:
        world = self.world
        return EpisodeSetup(
            title=f"{STATIONS[self.task.kind].name}, seed {seed}, {self.cfg.world.fidelity}",
            kind=self.task.kind,
            station=self.task.station,
            vehicle=world.simulator.vehicle,
            camera=world.camera,
            T_world_station=world.simulator.T_world_station,
            detector=self.task.detector,
            water=world.water.name,
        )

    @staticmethod
    def _finish(result: EpisodeResult, observers: Sequence[EpisodeObserver]) -> EpisodeResult:
        for observer in observers:
            observer.on_end(result)
        return result

    def _result(self, seed: int, metrics: Sequence[Metrics], flight: _Flight, started: float) -> EpisodeResult:
        truth = self.world.truth
        wall_s = time.perf_counter() - started
        measured = {name: value for each in metrics for name, value in each.fields(truth).items()}
        return EpisodeResult(
            success=self.world.is_success and flight.failure_reason is None,
            failure_reason=flight.failure_reason,
            time_s=truth.time_s,
            path_length_m=truth.path_length_m,
            energy_j=truth.energy_j,
            electrical_j=truth.electrical_j,
            peak_contact_force_n=truth.peak_contact_force_n,
            attempts=flight.attempts,
            seed=seed,
            wall_s=wall_s,
            real_time_factor=truth.time_s / wall_s if wall_s > 0.0 else 0.0,
            frame_ms_median=flight.frame_ms(50.0),
            frame_ms_p95=flight.frame_ms(95.0),
            versions=self._versions,
            config=self._plain_config,
            **measured,
        )


class _Flight:
    """What the runner keeps of an episode in progress."""

    def __init__(self) -> None:
        self.mode = ""
        self.stage = ""
        self.attempts = 1
        self.failure_reason: str | None = None
        self.frames_s: list[float] = []
        """Wall-clock time that perception took for each frame."""

    def frame_ms(self, percent: float) -> float | None:
        """Percentile of the time that a frame took."""
        return 1e3 * float(np.percentile(self.frames_s, percent)) if self.frames_s else None

    def count(self, mode: str) -> None:
        """Note the pilot's mode; `stage` is the last one that was not a retreat."""
        if mode == "abort" and self.mode != "abort":
            self.attempts += 1
        if mode != "abort":
            self.stage = mode
        self.mode = mode
