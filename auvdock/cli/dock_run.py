"""Flying one episode from the command line: a new one by flags, or one of a campaign again."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2

from auvdock.campaign.replay import StoredEpisode, stored_episode
from auvdock.campaign.row import differences, row_of
from auvdock.cli import exit_codes
from auvdock.cli.console import tell
from auvdock.cli.display import ProgressDisplay, print_result
from auvdock.cli.dock_flags import DockFlags
from auvdock.cli.early_flags import find_flags
from auvdock.cli.parsing import at_least, base_config, parse, station_file, with_station
from auvdock.cli.recorded import check_recordable, run_recorded
from auvdock.cli.saving import Saving
from auvdock.core.errors import ConfigError
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeObserver

__all__ = ["reference_in", "run_dock"]


def run_dock(command: type[DockFlags], argv: Sequence[str], prog: str, station: str) -> int:
    """Run a docking command.

    Args:
        command: its flags.
        argv: what the user gave.
        prog: the command's name, for its help.
        station: key of `auvdock.episode.stations.STATIONS`.

    Returns:
        The exit code.
    """
    stored = _stored(argv, station)
    args = parse(command, argv, prog, _defaults(command, argv, stored, station))
    at_least(0, seed=args.seed)
    if args.record is not None:
        check_recordable(args.record)  # now: to make a world takes a minute where its loops have to be compiled
    runner = EpisodeRunner(args.resolve())
    if stored is None or (runner.cfg, args.seed) != (stored.cfg, stored.spec.seed):
        return _fly(runner, args, station)  # no episode of a campaign, or flags made it another one
    return _fly(runner, args, station, lambda result: _tell_whether_equal(stored, result))


def reference_in(argv: Sequence[str]) -> str | None:
    """What `--from` names, if it is given."""
    return find_flags(argv, "from")["from"]


def _stored(argv: Sequence[str], station: str) -> StoredEpisode | None:
    reference = reference_in(argv)
    if reference is None:
        return None
    for flag, value in find_flags(argv, "level", "config").items():
        if value is not None:
            raise ConfigError(flag, value, "no such flag beside --from, which brings its own settings")
    stored = stored_episode(reference)
    if stored.station != station:
        remedy = f"an episode of the {station} station; this one is flown by `auvdock dock {stored.station}`"
        raise ConfigError("from", reference, remedy)
    return stored


def _defaults(command: type[DockFlags], argv: Sequence[str], stored: StoredEpisode | None, station: str) -> DockFlags:
    if stored is None and {"-h", "--help"} & set(argv):
        return command()
    cfg = stored.cfg if stored is not None else base_config(argv, station)
    own = station_file(argv)
    if own is not None:
        cfg = with_station(cfg, own)
    return replace(command(), seed=stored.spec.seed if stored is not None else command().seed, episode=cfg)


def _fly(
    runner: EpisodeRunner, flags: DockFlags, station: str, check: Callable[[EpisodeResult], None] | None = None
) -> int:
    cv2.setNumThreads(1)  # frames this small gain nothing from OpenCV's threads and stall on a busy machine
    shown: list[EpisodeObserver] = [] if flags.json else [ProgressDisplay()]
    saving = Saving()
    if flags.record is None:
        result = runner.run(flags.seed, shown)
    else:
        result = run_recorded(runner, flags.seed, flags.record, saving, shown)
    if check is not None:
        check(result)
    if flags.json:
        failed = {} if flags.record is None else {"recording_error": saving.errors[0] if saving.errors else None}
        print(json.dumps(result.to_json() | failed, allow_nan=False))
    else:
        print_result(result, station, None if saving.errors else flags.record)
    return saving.finish(exit_codes.DONE if result.success else exit_codes.NOT_MET)


def _tell_whether_equal(stored: StoredEpisode, result: EpisodeResult) -> None:
    if stored.row is None:
        return
    changed = differences(stored.row, row_of(stored.spec, result))
    found = f"differs from the campaign's in {', '.join(changed)}" if changed else "equals the campaign's, bit for bit"
    tell(f"episode {stored.spec.episode} {found}")
