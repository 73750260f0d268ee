"""The report's page: one HTML file that needs nothing else."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from html import escape
from pathlib import Path

from auvdock.campaign.report.cells import Campaign, success_map
from auvdock.campaign.report.compare import Comparison
from auvdock.campaign.report.figures import axis_figure, cause_figure, distribution_figure, map_figure
from auvdock.campaign.row import Row
from auvdock.campaign.statistics import Rate
from auvdock.episode.result import FAILURE_REASONS

__all__ = ["html_page", "recording_path", "replay_command"]

LISTED = 200
"""Most failures that the page lists."""

STYLE = """
:root { --ink: #1b2a38; --muted: #5b6b7a; --line: #d5dde4; --accent: #2a7ab8; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 70rem; padding: 2rem 1.5rem 4rem; color: var(--ink); background: #fff;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Helvetica, Arial, sans-serif; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; } h2 { font-size: 1.2rem; margin: 2.4rem 0 .6rem; }
p { max-width: 46rem; } .muted { color: var(--muted); font-size: .9rem; }
.figures { display: flex; flex-wrap: wrap; gap: 1rem; margin: 1.2rem 0; padding: 0; list-style: none; }
.figures li { border: 1px solid var(--line); border-radius: 8px; padding: .7rem 1rem; min-width: 9rem; }
.figures b { display: block; font-size: 1.5rem; font-variant-numeric: tabular-nums; }
figure { margin: 0; overflow-x: auto; } svg { max-width: 100%; height: auto; }
svg text { font-family: system-ui, Helvetica, Arial, sans-serif !important; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
th { color: var(--muted); font-weight: 600; } .scroll { overflow-x: auto; max-height: 32rem; overflow-y: auto; }
code { font: .85em ui-monospace, Menlo, Consolas, monospace; background: #f2f5f7; padding: .1em .3em;
  border-radius: 4px; }
.lost { color: #b3262e; } a { color: var(--accent); } @media print { .scroll { max-height: none; } }
"""


def recording_path(folder: Path, episode: int) -> Path:
    """Where the recording of an episode lies, if there is one."""
    return folder / f"episode-{episode:06d}.rrd"


def html_page(campaign: Campaign, comparison: Comparison | None) -> str:
    """The whole page."""
    title = escape(campaign.cfg.name)
    parts = [
        f"<h1>{title}</h1>",
        _facts(campaign),
        _headline(campaign),
        _map(campaign),
        _axes(campaign),
        "<h2>Why episodes failed</h2>",
        "<p>The guidance stage in which the pilot gave up or time ran out, or what ended the episode.</p>",
        f"<figure>{cause_figure(campaign)}</figure>" if campaign.rate.successes < len(campaign.rows) else "",
        _causes(campaign),
        "<h2>Distributions</h2>",
        f"<figure>{distribution_figure(campaign.rows)}</figure>" if campaign.rows else "",
        _comparison(comparison) if comparison else "",
        _failures(campaign),
        _reproduce(campaign),
    ]
    body = "\n".join(part for part in parts if part)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{title}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _facts(campaign: Campaign) -> str:
    cfg = campaign.cfg
    axes = "; ".join(_axis_words(campaign)) or "nothing"
    done = len(campaign.rows)
    part = "" if done >= cfg.episodes else f" of {cfg.episodes} planned"
    level = "" if any(axis.name == "level" for axis in cfg.axes) else f", level {cfg.level}"
    fidelity = cfg.episode.get("world", {}).get("fidelity", "pixels")
    return (
        f'<p class="muted">{escape(cfg.station)} station{level}, {escape(str(fidelity))} fidelity, '
        f"{done} episodes{part}, seed {cfg.seed}. Varied: {escape(axes)}.</p>"
    )


def _axis_words(campaign: Campaign) -> list[str]:
    words: list[str] = []
    for axis in campaign.cfg.axes:
        if axis.values:
            words.append(f"{axis.name} {', '.join(_value(value) for value in axis.values)}")
        elif axis.is_grid:
            words.append(f"{axis.name} {axis.low:g} to {axis.high:g} ({axis.count} values)")
        else:
            words.append(f"{axis.name} {axis.low:g} to {axis.high:g}, {axis.distribution} ({campaign.cfg.sampling})")
    return words


def _headline(campaign: Campaign) -> str:
    rate = campaign.rate
    lost = [(f'<span class="lost">{rate.lost}</span>', "crashed or hung: no result, in no rate")] if rate.lost else []
    items = [
        (_percent(rate.rate), "success rate"),
        (f"{100 * rate.low:.1f} to {100 * rate.high:.1f} %", "Wilson 95 % interval"),
        (str(rate.episodes), "episodes with a result" if rate.lost else "episodes"),
        (str(rate.episodes - rate.successes), "failures"),
        *lost,
        *_false_poses(campaign.rows),
    ]
    return '<ul class="figures">' + "".join(f"<li><b>{value}</b>{name}</li>" for value, name in items) + "</ul>"


def _false_poses(rows: Sequence[Row]) -> list[tuple[str, str]]:
    measured = sum(int(row["measured_poses"] or 0) for row in rows)
    false = sum(int(row["false_poses"] or 0) for row in rows)
    return [(f"{false} of {measured}", "false among the measured poses")] if measured else []


def _map(campaign: Campaign) -> str:
    found = success_map(campaign)
    if found is None:
        return ""
    over = " and ".join(part.name.replace("_", " ") for part in (found.down, found.across) if part)
    return f"<h2>Success over {escape(over)}</h2>\n<figure>{map_figure(found)}</figure>"


def _axes(campaign: Campaign) -> str:
    if not any(not axis.is_grid or len(axis.grid) > 1 for axis in campaign.cfg.axes):
        return ""
    return f"<h2>Success along each axis</h2>\n<figure>{axis_figure(campaign)}</figure>"


def _causes(campaign: Campaign) -> str:
    counts = Counter(str(row["failure_reason"]) for row in campaign.rows if row["failure_reason"] is not None)
    if not counts:
        return "<p>No episode failed.</p>"
    total = len(campaign.rows)
    lines = [
        (name, str(counts[name]), f"{100 * counts[name] / total:.2f} %") for name in FAILURE_REASONS if counts[name]
    ]
    return _table(("cause", "episodes", "share of all"), lines)


def _comparison(found: Comparison) -> str:
    test = found.test
    one, other = escape(found.first.cfg.name), escape(str(found.second.folder))
    square = _table(
        ("", "docked in the other", "failed in the other"),
        [
            ("docked here", str(test.both), str(test.only_first)),
            ("failed here", str(test.only_second), str(test.neither)),
        ],
    )
    verdict = "less than 0.0001" if test.p_value < 1e-4 else f"{test.p_value:.4f}"
    points = f"{100 * test.difference:+.1f} percentage points [{100 * test.low:+.1f}, {100 * test.high:+.1f}]"
    changed = [
        (str(one_row["episode"]), str(one_row["failure_reason"] or "docked"), str(two["failure_reason"] or "docked"))
        for one_row, two in found.changed[:LISTED]
    ]
    listing = _table(("episode", "here", "in the other"), changed) if changed else ""
    lost = f" Left out: {found.lost} pairs in which an episode crashed or hung." if found.lost else ""
    return (
        f"<h2>Against {other}</h2>\n<p>{test.pairs} pairs of equal seed. {one}: {_rate(found.first.rate)}; the other: "
        f"{_rate(found.second.rate)}. Difference over the pairs: {points} (95 %, Newcombe's paired interval). "
        f"McNemar's exact test: p = {verdict}.{lost}</p>\n{square}\n{listing}"
    )


def _failures(campaign: Campaign) -> str:
    failed = [row for row in campaign.rows if row["success"] is not True]
    if not failed:
        return ""
    names = [axis.name for axis in campaign.cfg.axes]
    lines = [
        (
            str(row["episode"]),
            escape(str(row["failure_reason"])),
            *(escape(_value(row[name])) for name in names),
            _value(row["time_s"]),
            _link(campaign.folder, row),
            escape(str(row["error"] or "")),
        )
        for row in failed[:LISTED]
    ]
    more = f'<p class="muted">The first {LISTED} of {len(failed)}.</p>' if len(failed) > LISTED else ""
    head = ("episode", "cause", *(escape(name) for name in names), "time, s", "recording", "")
    title = "Failures and lost episodes" if campaign.rate.lost else "Failures"
    return f"<h2>{title}</h2>\n{more}{_table(head, lines, raw=True)}"


def _link(folder: Path, row: Row) -> str:
    episode = int(row["episode"] or 0)
    path = recording_path(folder, episode)
    if path.exists():
        name = path.relative_to(folder).as_posix()
        return f'<a href="{escape(name)}">{escape(path.name)}</a>'
    return f"<code>{escape(replay_command(folder, episode))}</code>"


def replay_command(folder: Path, episode: int) -> str:
    """The command that flies an episode again and records it."""
    origin, record = shlex.quote(f"{folder}#{episode}"), shlex.quote(str(recording_path(folder, episode)))
    return f"auvdock dock --from {origin} --record {record}"


def _reproduce(campaign: Campaign) -> str:
    sessions = [
        f"{', '.join(f'{name} {number}' for name, number in session['versions'].items())}; "
        f"git revision {session['git_revision'] or 'none'}; begun {session['begun']}"
        for session in campaign.manifest["sessions"]
    ]
    return (
        f"<h2>To run it again</h2>\n<p><code>manifest.json</code> holds the campaign. Any episode flies again, bit for "
        f"bit, with <code>{escape(replay_command(campaign.folder, 0))}</code>.</p>"
        + "".join(f'<p class="muted">{escape(session)}.</p>' for session in sessions)
    )


def _table(head: Sequence[str], lines: Sequence[Sequence[str]], raw: bool = False) -> str:
    clean = str if raw else escape
    top = "".join(f"<th>{clean(name)}</th>" for name in head)
    body = "".join("<tr>" + "".join(f"<td>{clean(cell)}</td>" for cell in line) + "</tr>" for line in lines)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def _rate(rate: Rate) -> str:
    lost = f" and {rate.lost} without a result" if rate.lost else ""
    return f"{_percent(rate.rate)} [{100 * rate.low:.1f}, {100 * rate.high:.1f}] of {rate.episodes} episodes{lost}"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.1f} %"


def _value(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
