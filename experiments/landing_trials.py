"""Paper C's ten pool trials (section 4.4, figures 15 and 16) beside ours, for both levels and for each alone.

The paper landed ten times, shows five, and reports about 90 % success, position within ±20 mm and heading within 3°.
Here each trial is an episode of the standard landing task. It is flown three times over from the same seed: by the
fused pose, by the lights alone, by the tag alone. In every flight all three perceptions look at the same detections of
the same frames, so that their errors are paired (`landing_ranges`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auvdock.campaign.statistics import Rate, wilson
from auvdock.core.arrays import Array
from auvdock.core.transforms import invert
from auvdock.episode.config import LandingEpisodeCfg, landing_level_cfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeSetup
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.metrics.landing import ALIGNED_MODES, estimate_error
from auvdock.metrics.tick import Tick
from auvdock.perception.landing.config import LEVELS, LandingPerceptionCfg

__all__ = ["PAPER", "LandingTrial", "LandingWatch", "TrialSummary", "fly_trials", "summarise", "trial_cfg"]

PAPER: Mapping[str, float] = {"trials": 10, "shown": 5, "success": 0.9, "position_m": 0.020, "heading_deg": 3.0}
"""What paper C reports: "approximately 90 %", "less than ±20 mm", "less than 3°"."""


@dataclass(eq=False)
class LandingTrial:
    """One flight.

    Attributes:
        seed: of the episode.
        levels: by what it was flown: "both", "lights" or "tag".
        result: the episode's result.
        time_s: (n,) times of the frames.
        true: (n, 4) ξ, η, ζ in m and ψ in rad of the vehicle's seat over its place in the guides, the paper's axes:
            ξ to the head, η to starboard, ζ down, ψ to starboard; all zero when seated.
        estimated: (n, 4) the same by the pose that was flown on, NaN without one.
        aligned: (n,) whether the pilot had aligned and was going down.
        range_m: (n,) height of the camera over the tag.
        errors: for each of "both", "lights" and "tag" (n, 4) estimate less truth, package axes, NaN without a pose.
        measured: for each of them (n,) whether a level measured in that frame.
    """

    seed: int
    levels: str
    result: EpisodeResult
    time_s: Array
    true: Array
    estimated: Array
    aligned: Array
    range_m: Array
    errors: dict[str, Array]
    measured: dict[str, Array]


class LandingWatch:
    """Runs all three perceptions on a flight's frames and keeps their errors; an `EpisodeObserver`."""

    def __init__(self, flown: LandingEpisodeCfg) -> None:
        """Keep the settings of the perception that flies; the other two share them but for their levels."""
        self._cfg, self._station = flown.perception, flown.world.station
        self._rows: list[tuple[float, bool, float, Array, Array]] = []
        self._errors: dict[str, list[Array]] = {name: [] for name in LEVELS}
        self._measured: dict[str, list[bool]] = {name: [] for name in LEVELS}
        self.result: EpisodeResult | None = None

    def on_start(self, setup: EpisodeSetup) -> None:
        """Build the perceptions for the flight's camera and station."""
        self._T_station_world = invert(setup.T_world_station)
        self._T_camera_body = invert(setup.camera.T_body_camera)
        self._T_body_camera = setup.camera.T_body_camera
        self._seat = np.append(setup.vehicle.seat_body_m, 1.0)
        self._eyes = {
            name: LandingEstimator(_with_levels(self._cfg, name), setup.camera, self._station)
            for name in LEVELS
            if name != self._cfg.levels
        }

    def on_tick(self, tick: Tick) -> None:
        """Take in one frame."""
        percept = tick.percept
        if not isinstance(percept, LandingPercept) or tick.truth.latched:
            return
        T_true = self._T_station_world @ tick.truth.T_world_body
        for name in LEVELS:
            eye = self._eyes.get(name)
            seen = eye.update(percept.detections, percept.tags, tick.proprioception) if eye is not None else percept
            self._errors[name].append(self._error(seen, T_true))
            self._measured[name].append(seen.pose is not None and seen.pose.measured)
        flown = np.full(4, math.nan)
        if percept.pose is not None:
            flown = self._offsets(percept.pose.T_station_camera @ self._T_camera_body)
        height = float((T_true @ self._T_body_camera)[2, 3]) - self._station.tag.position_m[2]
        aligned = tick.command.mode in ALIGNED_MODES
        self._rows.append((tick.truth.time_s, aligned, height, self._offsets(T_true), flown))

    def on_end(self, result: EpisodeResult) -> None:
        """Keep the result."""
        self.result = result

    def close(self) -> None:
        """Nothing to release."""

    def trial(self, seed: int, levels: str) -> LandingTrial:
        """What was seen, once the flight is over."""
        if self.result is None:
            raise ValueError("the flight is not over")
        rows = self._rows
        return LandingTrial(
            seed=seed,
            levels=levels,
            result=self.result,
            time_s=np.array([row[0] for row in rows]),
            true=np.array([row[3] for row in rows]).reshape(-1, 4),
            estimated=np.array([row[4] for row in rows]).reshape(-1, 4),
            aligned=np.array([row[1] for row in rows], dtype=np.float64),
            range_m=np.array([row[2] for row in rows]),
            errors={name: np.array(self._errors[name]).reshape(-1, 4) for name in LEVELS},
            measured={name: np.array(self._measured[name], dtype=np.float64) for name in LEVELS},
        )

    def _error(self, percept: LandingPercept, T_true: Array) -> Array:
        if percept.pose is None:
            return np.full(4, math.nan)
        return estimate_error(percept.pose.T_station_camera @ self._T_camera_body, T_true, self._seat)

    def _offsets(self, T_station_body: Array) -> Array:
        x, y, z = (T_station_body @ self._seat)[:3].tolist()
        yaw = math.atan2(T_station_body[1, 0], T_station_body[0, 0])
        return np.array([x, -y, self._station.guide.seat_height_m - z, -yaw])


@dataclass(frozen=True)
class TrialSummary:
    """Trials of one kind together.

    Attributes:
        levels: by what they were flown.
        docked: success rate with its Wilson interval.
        failures: seed and failure reason of those that did not dock.
        frames: frames after alignment with a pose, of all flights.
        within_paper: share of them within 20 mm and 3°, estimate against truth.
        within_target: share within 10 mm and 1°.
        position_p95_m: 95 % of them have no coordinate farther off.
        heading_p95_deg: likewise the heading.
        final_position_m: greatest final distance of the seat from its place, along and across, of docked flights.
        final_heading_deg: greatest final heading error of docked flights.
    """

    levels: str
    docked: Rate
    failures: dict[int, str] = field(default_factory=dict)
    frames: int = 0
    within_paper: float | None = None
    within_target: float | None = None
    position_p95_m: float | None = None
    heading_p95_deg: float | None = None
    final_position_m: float | None = None
    final_heading_deg: float | None = None


def trial_cfg(fidelity: str, changes: Mapping[str, Any] | None = None) -> LandingEpisodeCfg:
    """The standard task: clear water, 0.1 m/s of current, 3 to 6 m above, ±1.5 m, ±45°.

    Raises:
        ConfigError: an unknown key or a value that does not fit.
    """
    cfg = landing_level_cfg(1).override({"world": {"fidelity": fidelity}})
    return cfg.override(changes) if changes else cfg


def fly_trials(
    cfg: LandingEpisodeCfg, seeds: Sequence[int], levels: Sequence[str], advance: Callable[[], None] | None = None
) -> list[LandingTrial]:
    """Fly every seed by each of the given levels; `advance` is called after each flight."""
    trials: list[LandingTrial] = []
    for name in levels:
        flown = cfg.override({"perception": {"levels": name}})
        runner = EpisodeRunner(flown)
        for seed in seeds:
            watch = LandingWatch(flown)
            runner.run(seed, [watch])
            trials.append(watch.trial(seed, name))
            if advance is not None:
                advance()
    return trials


def summarise(trials: Sequence[LandingTrial], levels: str) -> TrialSummary:
    """The figures of the flights that were flown by the given levels."""
    chosen = [trial for trial in trials if trial.levels == levels]
    docked = [trial for trial in chosen if trial.result.success]
    failures = {trial.seed: trial.result.failure_reason or "" for trial in chosen if not trial.result.success}
    rate = wilson(len(docked), len(chosen))
    errors = [np.abs(trial.errors[levels][trial.aligned > 0.0]) for trial in chosen]
    error = np.vstack(errors) if errors else np.zeros((0, 4))
    error = error[np.isfinite(error[:, 0])]
    if len(error) == 0:
        return TrialSummary(levels, rate, failures)
    position, heading = error[:, :3].max(axis=1), np.degrees(error[:, 3])
    return TrialSummary(
        levels=levels,
        docked=rate,
        failures=failures,
        frames=len(error),
        within_paper=float(np.mean((position <= 0.020) & (heading <= 3.0))),
        within_target=float(np.mean((position <= 0.010) & (heading <= 1.0))),
        position_p95_m=float(np.percentile(position, 95.0)),
        heading_p95_deg=float(np.percentile(heading, 95.0)),
        final_position_m=max((trial.result.final_position_error_m or 0.0 for trial in docked), default=None),
        final_heading_deg=max(
            (math.degrees(trial.result.final_heading_error_rad or 0.0) for trial in docked), default=None
        ),
    )


def _with_levels(cfg: LandingPerceptionCfg, levels: str) -> LandingPerceptionCfg:
    return LandingEpisodeCfg(perception=cfg).override({"perception": {"levels": levels}}).perception
