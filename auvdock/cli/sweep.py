"""`auvdock sweep`: a Monte Carlo campaign over currents, turbidity and whatever else varies."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.table import Table
from rich.text import Text

from auvdock.campaign.axes import AxisCfg, axis_kind, joined
from auvdock.campaign.axis_text import parse_axis
from auvdock.campaign.campaign import CampaignSummary, run_campaign
from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.executor import Executor, SerialExecutor
from auvdock.campaign.files import keep_files, load_campaign
from auvdock.campaign.job import DockingJob
from auvdock.campaign.process import ProcessExecutor, usable_cores
from auvdock.campaign.provenance import manifest_of
from auvdock.campaign.rehearsal import rehearse
from auvdock.campaign.store import Store, read_campaign
from auvdock.cli.console import command_line, messages, output, tell
from auvdock.cli.early_flags import find_flags
from auvdock.cli.parsing import DEFAULT_LEVEL, level_and_file, named_by_flag, parse, station_file, with_station
from auvdock.cli.sweep_progress import SweepProgress
from auvdock.core.errors import ConfigError
from auvdock.core.strict import names_file, read_toml, to_plain
from auvdock.episode.config import AnyEpisodeCfg, EpisodeCfg
from auvdock.episode.stations import STATIONS, station_kind

__all__ = ["Sweep", "plain_summary", "print_summary", "run"]

AXIS_FLAGS = (
    "attenuation",
    "current",
    "current_direction",
    "gust",
    "water",
    "flicker",
    "interfering_lights",
    "detector",
    "controller",
)
"""Flags that may vary; `--axis` takes any other setting."""
_MOST_WORKERS = 4096


@dataclass(frozen=True)
class Sweep:
    """Run many episodes over a grid or a distribution of conditions, and store one row each.

    A range is low:high:count for a grid, low:high to draw from a distribution, or values with commas between them. Grid
    axes are crossed with each other.

    Episodes that crashed or hung left no result: they are told apart and count in no rate.

    Exit code: 0 all episodes have run, however they ended, 2 input that cannot be used or a store that cannot be
    written.
    """

    out: Path
    """Folder of the campaign: manifest, rows as Parquet shards, later the report."""
    campaign: Path | None = None
    """Campaign as a TOML file (see experiments/campaigns); the flags below change single things of it."""
    station: str | None = None
    """Docking station: conical, rotating, landing, or the TOML file of one (conical if no campaign file says
    otherwise)."""
    episodes: int | None = None
    """Number of episodes (100 if no campaign file says otherwise)."""
    seed: int | None = None
    """Decides every episode's seed and every draw (0 if no campaign file says otherwise)."""
    executor: Literal["serial", "process", "ray"] = "process"
    """Where episodes run: here one by one, in local processes, or on a Ray cluster."""
    workers: int | None = None
    """Episodes at the same time; by default one per core, on a cluster all of its cores."""
    address: str | None = None
    """Address of a Ray cluster; by default one is started on this machine."""
    resume: bool = False
    """Go on with the campaign in --out; without other flags it is taken as it was begun."""
    until_ci: float | None = None
    """Stop once the success rate's 95 % interval is no wider than plus or minus this."""
    until_ci_per_cell: bool = False
    """With --until-ci, let every cell of the grid go on until its own interval is narrow enough."""
    sampling: Literal["random", "latin_hypercube", "sobol"] | None = None
    """How axes that are distributions are drawn."""
    episode_limit: float | None = None
    """Wall-clock limit of an episode in s; past it the episode counts as hung. By default five times its simulated time
    limit, and 600 s at least."""
    json: bool = False
    """Print the summary as one JSON object and nothing else."""
    level: str | None = None
    """Difficulty level 0 to 4, or several: 0,1,2."""
    fidelity: Literal["pixels", "beacons"] | None = None
    """pixels renders every frame; beacons draws detections from the same light model without an image."""
    attenuation: str | None = None
    """Beam attenuation at 450 nm in 1/m: value or range."""
    current: str | None = None
    """Speed of the current in m/s: value or range."""
    current_direction: str | None = None
    """Where the current flows to in degrees: value, range or "random"."""
    gust: str | None = None
    """Standard deviation of the gusts in m/s: value or range."""
    water: str | None = None
    """Water preset or a TOML file of one's own, or several with commas."""
    flicker: str | None = None
    """Flicker of the lamps: none, mild, moderate, severe, or several with commas."""
    interfering_lights: str | None = None
    """Lights that are not the station's: none, mild, moderate, severe, or several with commas."""
    detector: str | None = None
    """threshold, blob, paper_a_light, your own as NAME.onnx or package.module:Name, or several with commas."""
    controller: str | None = None
    """own, a pilot of yours as package.module:Name, or several with commas."""
    axis: tuple[str, ...] = ()
    """Further axes as NAME=RANGE; a name is a short one or a dotted setting such as world.start.heading_deg."""
    config: Path | None = None
    """TOML file with further settings of the episodes, on top of the level."""
    episode: Annotated[AnyEpisodeCfg, tyro.conf.arg(name="")] = field(default_factory=EpisodeCfg)

    def axes(self, episode: type[AnyEpisodeCfg]) -> list[AxisCfg]:
        """The axes that the flags ask for, in episodes of a configuration.

        Raises:
            ConfigError: a range that cannot be read, or an axis that such episodes do not have.
        """
        found: list[AxisCfg] = []
        for name in AXIS_FLAGS:
            text = getattr(self, name)
            if text is not None and text != "random":
                found.append(parse_axis(name, text, axis_kind(episode, name)))
        for text in self.axis:
            name, equals, values = text.partition("=")
            if not equals:
                raise ConfigError("axis", text, "NAME=RANGE, for example world.start.heading_deg=0:60:4")
            found.append(parse_axis(name, values, axis_kind(episode, name)))
        if self.level is not None and "," in self.level:
            found.append(parse_axis("level", self.level, int))
        return found


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    station = _station(argv)
    base = _base(argv, station)
    flags = _with_settings_of(type(base))
    args = parse(flags, argv, prog, flags(out=tyro.MISSING, episode=base))
    cfg = _resolve(args, args.episode, station)
    if args.workers is not None and not 1 <= args.workers <= _MOST_WORKERS:
        raise ConfigError("workers", args.workers, f"a whole number of 1 or more, up to {_MOST_WORKERS}")
    rehearse(cfg)
    executor = _executor(args, cfg)
    store = Store(args.out, cfg, manifest_of(cfg), args.resume)
    if store.is_mixed:
        tell("earlier episodes were run by other versions; rows may not repeat")
    observer = SweepProgress(messages(), executor.workers, quiet=args.json)
    with redirect_stdout(sys.stderr):  # Ray tells of lost nodes on standard output, which belongs to the summary
        summary = run_campaign(cfg, DockingJob(cfg), store, executor, observer)
    if args.json:
        print(json.dumps(plain_summary(summary), allow_nan=False))
    else:
        print_summary(summary, args.out)
    return 0


def _with_settings_of(episode: type[AnyEpisodeCfg]) -> type[Sweep]:
    """The command's flags with those of one kind of episodes' settings."""
    own = ("episode", Annotated[episode, tyro.conf.arg(name="")], field(default_factory=episode))
    made = dataclasses.make_dataclass("Sweep", [own], bases=(Sweep,), frozen=True)
    made.__doc__ = Sweep.__doc__
    return made


def _station(argv: Sequence[str]) -> str:
    """The station that decides which settings an episode has: by flag, campaign file, or the campaign to resume."""
    found = find_flags(argv, "station", "campaign", "out")
    station, campaign, out = found["station"], found["campaign"], found["out"]
    if station is not None:
        if station not in STATIONS and not names_file(station):
            raise ConfigError("station", station, f"{', '.join(STATIONS)}, or the TOML file of one")
        return station if station in STATIONS else station_kind(Path(station))
    if campaign is not None:
        return load_campaign(Path(campaign)).station
    if "--resume" in argv and out is not None:
        return read_campaign(Path(out)).station
    return CampaignCfg.station


def _base(argv: Sequence[str], station: str) -> AnyEpisodeCfg:
    """What `--level` and `--config` ask for; other flags change single fields of it."""
    make = STATIONS[station].level
    if {"-h", "--help"} & set(argv):
        return make(DEFAULT_LEVEL)
    level, file = level_and_file(_single_level(argv))
    cfg = make(level)
    if file is not None:
        cfg = cfg.override(read_toml(file))
    own = station_file(argv)
    return with_station(cfg, own) if own not in (None, *STATIONS) else cfg


def _single_level(argv: Sequence[str]) -> list[str]:
    """The words with `--level 0,1,2` taken out: then each level is applied later, the base is none of them."""
    words = list(argv)
    for place, word in enumerate(words):
        if word == "--level" and place + 1 < len(words) and "," in words[place + 1]:
            return words[:place] + words[place + 2 :]
        if word.startswith("--level=") and "," in word:
            return words[:place] + words[place + 1 :]
    return words


def _resolve(args: Sweep, episode: AnyEpisodeCfg, station: str) -> CampaignCfg:
    changes = _difference(to_plain(_start(args, station)), to_plain(episode))
    axes = args.axes(type(episode))
    if args.station is not None and args.station not in STATIONS:
        changes.setdefault("world", {})["station"] = to_plain(episode.world.station)
    if args.fidelity is not None:
        changes.setdefault("world", {})["fidelity"] = args.fidelity
    if args.current_direction == "random":
        changes.setdefault("world", {}).setdefault("start", {})["random_current_direction"] = True
    plain: dict[str, Any] = {
        name: getattr(args, name)
        for name in ("episodes", "seed", "until_ci", "sampling")
        if getattr(args, name) is not None
    }
    if args.station is not None:
        plain["station"] = station
    if args.until_ci_per_cell:
        plain["until_ci_per_cell"] = True
    if args.episode_limit is not None:
        plain["episode_limit_s"] = args.episode_limit
    if args.level is not None and "," not in args.level:
        plain["level"] = int(args.level)
    asked = bool(plain or changes or axes or args.campaign)
    if args.resume and not asked:
        return read_campaign(args.out)
    there = CampaignCfg() if args.campaign is None else load_campaign(args.campaign)
    kept = [axis for axis in there.axes if axis.name not in {axis.name for axis in axes}]
    with named_by_flag(until_ci="until-ci", until_ci_per_cell="until-ci-per-cell", episode_limit_s="episode-limit"):
        changed = joined((there.episode, changes))
        wanted = dataclasses.replace(there, **plain, axes=(*kept, *axes), episode=changed)
        return keep_files(wanted)


def _start(args: Sweep, station: str) -> AnyEpisodeCfg:
    """What the flags' changes are relative to: the level that the campaign applies again to each episode."""
    return STATIONS[station].level(
        int(args.level) if args.level is not None and "," not in args.level else DEFAULT_LEVEL
    )


def _difference(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """Nested mapping of what differs."""
    changes: dict[str, Any] = {}
    for name, value in after.items():
        old = before[name]
        if isinstance(value, dict) and isinstance(old, dict):
            inner = _difference(old, value)
            if inner:
                changes[name] = inner
        elif value != old:
            changes[name] = value
    return changes


def _executor(args: Sweep, cfg: CampaignCfg) -> Executor:
    if args.executor == "serial":
        return SerialExecutor(cfg.wall_limit_s)
    if args.executor == "ray":
        from auvdock.campaign.ray_executor import RayExecutor

        return RayExecutor(args.workers, cfg.wall_limit_s, args.address)
    return ProcessExecutor(min(args.workers or usable_cores(), cfg.episodes), cfg.wall_limit_s)


def plain_summary(summary: CampaignSummary) -> dict[str, Any]:
    """A campaign's outcome as `--json` prints it: the rate is over `episodes`, `lost` ones come on top by cause."""
    return {
        "success_rate": summary.rate.rate,
        "ci_low": summary.rate.low,
        "ci_high": summary.rate.high,
        "episodes": summary.rate.episodes,
        "failures": summary.failures,
        "lost": summary.lost,
        "wall_s": summary.wall_s,
        "peak_rss_mb": summary.peak_rss_mb,
    }


def print_summary(summary: CampaignSummary, out: Path) -> None:
    """A campaign's outcome as a table on standard output."""
    rate = summary.rate
    table = Table(title=f"campaign of {rate.episodes + rate.lost} episodes", title_justify="left")
    table.add_column("metric")
    table.add_column("value", justify="right")
    share = "-" if rate.rate is None else f"{100.0 * rate.rate:.1f} %"
    table.add_row(f"success rate of {rate.episodes} with a result" if rate.lost else "success rate", share)
    table.add_row("95 % interval (Wilson)", f"{100.0 * rate.low:.1f} to {100.0 * rate.high:.1f} %")
    for cause, count in summary.failures.items():
        table.add_row(f"failed: {cause}", str(count))
    for cause, count in summary.lost.items():
        table.add_row(Text(f"NO RESULT: {cause} (in no rate)", "red"), Text(str(count), "red"))
    table.add_row("run now", str(summary.ran))
    table.add_row("wall-clock time", f"{summary.wall_s:.0f} s")
    table.add_row("peak memory", f"{summary.peak_rss_mb:.0f} MiB")
    console = output()
    console.print(table)
    console.print(f"next: {command_line('auvdock', 'report', out)}", highlight=False, soft_wrap=True)
