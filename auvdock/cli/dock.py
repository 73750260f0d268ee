"""`auvdock dock conical`: one episode with live progress, a result table, a recording or JSON.

`run_dock` serves the other stations with a bow camera too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import tyro

from auvdock.campaign.replay import StoredEpisode, stored_episode
from auvdock.campaign.row import differences, row_of
from auvdock.cli.dock_flags import DockFlags, fly
from auvdock.cli.parsing import base_config, parse
from auvdock.core.errors import ConfigError
from auvdock.episode.config import EpisodeCfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner

__all__ = ["DockConical", "run_conical", "run_dock"]


@dataclass(frozen=True)
class DockConical(DockFlags):
    """Dock into the conical station: one episode.

    Exit code: 0 docked, 1 not docked, 2 input that cannot be used.
    """

    from_: Annotated[str | None, tyro.conf.arg(name="from", metavar="DIR#EPISODE")] = None
    """Fly an episode of a campaign again, bit for bit; other flags then change single things of it."""
    episode: Annotated[EpisodeCfg, tyro.conf.arg(name="")] = field(default_factory=EpisodeCfg)

    def resolve(self) -> EpisodeCfg:
        """The configuration with all flags applied.

        Raises:
            ConfigError: a value that does not fit.
        """
        return self.episode.override(self.changes()).override(self.special())

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
    runner = EpisodeRunner(args.resolve())
    title = {"conical": "conical docking", "rotating": "docking by the rotating beacon"}.get(station, station)
    if stored is None or (runner.cfg, args.seed) != (stored.cfg, stored.spec.seed):
        return fly(runner, args, title)  # no episode of a campaign, or flags made it another one
    return fly(runner, args, title, lambda result: _tell_whether_equal(stored, result))


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
