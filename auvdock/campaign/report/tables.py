"""Tables for the paper: CSV with all figures, LaTeX with the success map."""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from statistics import median

from auvdock.campaign.report.cells import Campaign, Map, binning, rate_of, success_map
from auvdock.campaign.row import Row
from auvdock.campaign.statistics import Rate
from auvdock.episode.result import FAILURE_REASONS

__all__ = ["csv_table", "latex_table"]

TOTALS = ("measured_poses", "false_poses")
"""Columns whose sum the CSV gives."""

MEDIANS = (
    *("distortion_rate", "entry_distance_m", "time_s", "energy_j", "peak_contact_force_n"),
    *("touchdown_speed_m_s", "final_position_error_m", "final_heading_error_rad"),
)
"""Columns whose median the CSV gives; empty where a station has no such thing."""


def csv_table(campaign: Campaign) -> str:
    """One line per cell of all axes: counts, rate, Wilson 95 % interval, sums, medians, failures by cause.

    `episodes` are those that left a result, over which the rate is; `lost` are the others.
    """
    cuts = [binning(axis) for axis in campaign.cfg.axes]
    cells: dict[tuple[int, ...], list[Row]] = defaultdict(list)
    for row in campaign.rows:
        cells[tuple(cut.place(row[cut.name] or 0) for cut in cuts)].append(row)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    totals = [f"total_{name}" for name in TOTALS]
    medians = [f"median_{name}" for name in MEDIANS]
    causes = [f"failed_{name}" for name in FAILURE_REASONS]
    names = [cut.name for cut in cuts]
    figures = ("episodes", "lost", "successes", "success_rate", "ci_low", "ci_high")
    writer.writerow([*names, *figures, *totals, *medians, *causes])
    for places, rows in sorted(cells.items()):
        rate = rate_of(rows)
        ticks = [cut.ticks[place] for cut, place in zip(cuts, places, strict=True)]
        summed = [sum(int(row[name] or 0) for row in rows) for name in TOTALS]
        middle = [_median(rows, name) for name in MEDIANS]
        failed = [sum(row["failure_reason"] == name for row in rows) for name in FAILURE_REASONS]
        share = "" if rate.rate is None else f"{rate.rate:.6g}"
        interval = (f"{rate.low:.6g}", f"{rate.high:.6g}")
        counted = (rate.episodes, rate.lost, rate.successes)
        writer.writerow([*ticks, *counted, share, *interval, *summed, *middle, *failed])
    return buffer.getvalue()


def latex_table(campaign: Campaign) -> str:
    """The success map as a booktabs table: rate and Wilson 95 % interval in percent."""
    found = success_map(campaign)
    title = _escape(campaign.cfg.name)
    lost = f" and {campaign.rate.lost} without a result, which count in no rate" if campaign.rate.lost else ""
    caption = (
        f"Success rate in \\% with Wilson 95\\,\\% interval, {campaign.rate.episodes} episodes{lost}"
        f" ({title}, seed {campaign.cfg.seed})."
    )
    if found is None:
        return f"% {caption}\n{_cell(campaign.rate)}\n"
    return _latex_map(found, caption, _escape(campaign.cfg.name.replace(" ", "-")))


def _latex_map(found: Map, caption: str, label: str) -> str:
    corner = _escape(found.down.label) if found.down else ""
    head = " & ".join([corner, *(_escape(tick) for tick in found.across.ticks)])
    names = found.down.ticks if found.down else ("all",)
    lines = [
        " & ".join([_escape(name), *(_cell(rate) for rate in line)]) + " \\\\"
        for name, line in zip(names, found.rates, strict=True)
    ]
    width = len(found.across.ticks)
    return "\n".join(
        [
            "% needs \\usepackage{booktabs}",
            "\\begin{table}",
            "\\centering",
            f"\\caption{{{caption}}}",
            f"\\label{{tab:{label}}}",
            f"\\begin{{tabular}}{{l{'c' * width}}}",
            "\\toprule",
            f" & \\multicolumn{{{width}}}{{c}}{{{_escape(found.across.label)}}} \\\\",
            f"{head} \\\\",
            "\\midrule",
            *lines,
            "\\bottomrule",
            "\\end{tabular}",
            "\\end{table}",
            "",
        ]
    )


def _cell(rate: Rate) -> str:
    if rate.rate is None:
        return "--"
    return f"{100 * rate.rate:.1f} [{100 * rate.low:.1f}, {100 * rate.high:.1f}]"


def _median(rows: list[Row], name: str) -> str:
    values = [float(value) for row in rows if (value := row[name]) is not None]
    return f"{median(values):.6g}" if values else ""


def _escape(text: str) -> str:
    for mark in "&%$#_{}":
        text = text.replace(mark, f"\\{mark}")
    return text.replace("°", "$^\\circ$")
