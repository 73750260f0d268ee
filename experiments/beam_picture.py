"""Picture of narrow beams off their axis by photons, by the halo's table and as they are flown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvdock.experiments.beam_check import BeamCheck
from auvdock.experiments.halo_check import CHECKED_A_B, CHECKED_BR, WELLS_RAD
from auvdock.experiments.halo_picture import COLOURS, SHOWN_BR
from auvdock.planning.pictures import save_figure

__all__ = ["draw_beams"]


def draw_beams(path: Path, checks: Sequence[Sequence[BeamCheck]]) -> None:
    """Write the picture: a column for each phase function; two rows for each beam, light and table over photons.

    Args:
        path: of the PNG.
        checks: beams of each phase function.
    """
    rows = 2 * len(checks[0])
    figure = Figure(figsize=(4.6 * len(checks), 3.2 * rows), layout="constrained")
    figure.suptitle("beams: photons (dots, 1 standard error), the halo's table (lines), Wells 1973 (dashed)")
    axes = figure.subplots(rows, len(checks), sharex=True, squeeze=False)
    for column, beams in zip(axes.T, checks, strict=True):
        for i, check in enumerate(beams):
            _light(column[2 * i], check)
            _ratios(column[2 * i + 1], check)
        column[-1].set_xlabel("line of sight off the beam's axis in degrees")
    for i, check in enumerate(checks[0]):
        axes[2 * i][0].set_ylabel(f"beam of {check.beam_deg:g}°: scattered\nover I0 e^(-ar) / r², a/b = 0.1")
        axes[2 * i + 1][0].set_ylabel(f"beam of {check.beam_deg:g}°: table / photons\nall a/b, b r")
    axes[0][0].legend(fontsize=8)
    axes[1][0].legend(fontsize=8)
    save_figure(figure, path)


def _light(panel: Axes, check: BeamCheck) -> None:
    panel.set_title(f"{check.phase}, {check.photons:,} photons", fontsize=10)
    ratio = CHECKED_A_B.index(0.1)
    for br, colour in zip(SHOWN_BR, COLOURS, strict=True):
        i = CHECKED_BR.index(br)
        fresh, known = check.fresh[i, ratio], np.isfinite(check.error[i, ratio])
        at = np.array(check.off_axis_deg)[known]
        error = (fresh * check.error[i, ratio])[known]
        panel.errorbar(at, fresh[known], error, fmt="o", color=colour, ms=4)
        panel.plot(check.off_axis_deg, check.table[i, ratio], color=colour, lw=1.3, label=f"b r = {br:g}")
        panel.plot(check.off_axis_deg, check.wells[0, i], "--", color=colour, lw=0.9)
    panel.text(
        0.98, 0.96, f"dashed: θ0 = {WELLS_RAD[0]:g}", transform=panel.transAxes, ha="right", va="top", fontsize=8
    )
    panel.set_yscale("log")
    panel.grid(True, which="both", alpha=0.25)


def _ratios(panel: Axes, check: BeamCheck) -> None:
    panel.axhspan(0.9, 1.1, color="#e8f0e4")
    shift = 0.25 * (np.arange(len(CHECKED_BR)) - 4)[:, None, None]
    at = np.broadcast_to(np.array(check.off_axis_deg) + shift, check.fresh.shape)
    for light, judged, colour, name in (
        (check.front, check.front_judged, "#d98e73", "over the half sphere in front"),
        (check.fresh, check.judged, "#1f4e79", "over all directions"),
    ):
        panel.plot(at[judged], (check.table / light)[judged], "o", color=colour, ms=2.5, label=name)
        panel.plot(at[~judged], (check.table / light)[~judged], "x", color="#bbbbbb", ms=3)
    panel.set_ylim(0.75, 1.4)
    panel.grid(True, alpha=0.25)
