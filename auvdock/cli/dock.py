"""`auvdock dock conical`: one episode with live progress, a result table, a recording or JSON.

`run_dock` serves the other stations with a bow camera too.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import tyro

from auvdock.campaign.replay import StoredEpisode, stored_episode
from auvdock.campaign.row import differences, row_of
from auvdock.cli.display import ProgressDisplay, print_result
from auvdock.cli.parsing import base_config, parse
from auvdock.core.errors import ConfigError, GraphicsError
from auvdock.episode.config import EpisodeCfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeObserver
from auvdock.optics.gl import probe_gl

__all__ = ["DockConical", "run_conical", "run_dock"]


@dataclass(frozen=True)
class DockConical:
    """Dock into the conical station: one episode.

    Exit code: 0 docked, 1 not docked, 2 input that cannot be used.
    """

    seed: int = 0
    """Decides start, current, sensor noise and camera noise."""
    fidelity: Literal["pixels", "beacons", "auto"] | None = None
    """pixels renders every frame; beacons draws detections from the same light model without an image; auto is pixels
    where OpenGL works, else beacons."""
    detector: str | None = None
    """threshold, blob, or your own as package.module:Name."""
    controller: str | None = None
    """A pilot of your own as package.module:Name, in place of the station's."""
    water: str | None = None
    """Water preset: I, IA, IB, II, III, 1C to 9C, clear, pool, lake."""
    attenuation: float | None = None
    """Beam attenuation at 450 nm in 1/m, in place of the preset's."""
    current: float | None = None
    """Speed of the current in m/s."""
    current_direction: str | None = None
    """Where the current flows to, degrees counter-clockwise from the approach axis seen from above, or "random"."""
    level: int = 1
    """Difficulty 0 to 4; the flags change single things of it."""
    config: Path | None = None
    """TOML file with further settings, on top of the level."""
    from_: Annotated[str | None, tyro.conf.arg(name="from", metavar="DIR#EPISODE")] = None
    """Fly an episode of a campaign again, bit for bit; other flags then change single things of it."""
    record: Path | None = None
    """Write a Rerun recording here."""
    json: bool = False
    """Print the result as one JSON object and nothing else."""
    episode: Annotated[EpisodeCfg, tyro.conf.arg(name="")] = field(default_factory=EpisodeCfg)

    def resolve(self) -> EpisodeCfg:
        """The configuration with the common flags applied.

        Raises:
            ConfigError: a value that does not fit.
        """
        changes: dict[str, Any] = {}
        world: dict[str, Any] = changes.setdefault("world", {})
        if self.fidelity is not None:
            world["fidelity"] = _working_fidelity() if self.fidelity == "auto" else self.fidelity
        if self.water is not None:
            world["water"] = self.water
        if self.attenuation is not None:
            world["attenuation_per_m"] = _finite("attenuation", self.attenuation, "a finite attenuation in 1/m")
        if self.current is not None:
            speed = _finite("current", self.current, "a finite speed in m/s")
            world.setdefault("sim", {}).setdefault("current", {})["speed_m_s"] = speed
        if self.current_direction is not None:
            start = world.setdefault("start", {})
            start["random_current_direction"] = self.current_direction == "random"
            if self.current_direction != "random":
                degrees = _degrees(self.current_direction)
                world.setdefault("sim", {}).setdefault("current", {})["direction_deg"] = degrees
        if self.detector is not None:
            changes["perception"] = {"detector": self.detector}
        if self.controller is not None:
            changes["control"] = {"controller": self.controller}
        return self.episode.override(changes).override(self.special())

    def special(self) -> dict[str, Any]:
        """Changes by flags of this station alone."""
        return {}


def run_conical(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    return run_dock(DockConical, argv, prog, "conical")


def run_dock(command: type[DockConical], argv: Sequence[str], prog: str, station: str) -> int:
    """Run a docking command whose flags are the fields of `command`, on the levels of `station`."""
    stored = _stored(argv)
    args = parse(command, argv, prog, _defaults(command, argv, stored, station))
    if args.seed < 0:
        raise ConfigError("seed", args.seed, "a whole number of 0 or more")
    cv2.setNumThreads(1)  # frames this small gain nothing from OpenCV's threads and stall on a busy machine
    runner = EpisodeRunner(args.resolve())
    if stored is not None and (runner.cfg, args.seed) != (stored.cfg, stored.spec.seed):
        stored = None  # flags made it another episode
    observers: list[EpisodeObserver] = []
    if args.record is not None:
        from auvdock.recording.rerun_recorder import RerunRecorder

        observers.append(RerunRecorder(args.record))
    if not args.json:
        observers.append(ProgressDisplay(runner.cfg.world.limits.max_time_s))
    result = runner.run(args.seed, observers)
    if stored is not None:
        _tell_whether_equal(stored, result)
    if args.json:
        print(json.dumps(result.to_json(), allow_nan=False))
    else:
        titles = {"conical": "conical docking", "rotating": "docking by the rotating beacon"}
        print_result(result, args.record, titles.get(station, station))
    return 0 if result.success else 1


def _stored(argv: Sequence[str]) -> StoredEpisode | None:
    """The campaign's episode that `--from` names."""
    finder = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for flag in ("--from", "--level", "--config"):
        finder.add_argument(flag, default=None)
    found, _ = finder.parse_known_args(list(argv))
    reference = getattr(found, "from")
    if reference is None:
        return None
    for flag in ("level", "config"):
        if getattr(found, flag) is not None:
            raise ConfigError(flag, getattr(found, flag), "no such flag beside --from, which brings its own settings")
    return stored_episode(reference)


def _defaults(
    command: type[DockConical], argv: Sequence[str], stored: StoredEpisode | None, station: str
) -> DockConical:
    if stored is not None:
        if not isinstance(stored.cfg, EpisodeCfg):
            raise ConfigError("from", stored.spec.episode, "an episode of a station that is seen by a bow camera")
        return command(seed=stored.spec.seed, episode=stored.cfg)
    return command() if {"-h", "--help"} & set(argv) else command(episode=base_config(argv, station))


def _tell_whether_equal(stored: StoredEpisode, result: EpisodeResult) -> None:
    if stored.row is None:
        return
    changed = differences(stored.row, row_of(stored.spec, result))
    found = f"differs from the campaign's in {', '.join(changed)}" if changed else "equals the campaign's, bit for bit"
    print(f"auvdock: episode {stored.spec.episode} {found}", file=sys.stderr)


def _working_fidelity() -> str:
    try:
        probe_gl()
    except GraphicsError as error:
        print(f"auvdock: {error}", file=sys.stderr)
        return "beacons"
    return "pixels"


def _finite(name: str, value: float, remedy: str) -> float:
    if not math.isfinite(value):
        raise ConfigError(name, value, remedy)
    return value


def _degrees(text: str) -> float:
    try:
        return _finite("current-direction", float(text), "degrees or 'random'")
    except ValueError as error:
        raise ConfigError("current-direction", text, "degrees or 'random'") from error
