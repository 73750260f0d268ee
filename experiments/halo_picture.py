"""Picture of the halo by photons, by its table and by Wells' function."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvdock.experiments.halo_check import CHECKED_A_B, CHECKED_BR, HALF_ANGLES_DEG, WELLS_RAD, HaloCheck
from auvdock.planning.pictures import save_figure

__all__ = ["COLOURS", "SHOWN_BR", "draw_halo"]

SHOWN_BR = (0.5, 2.0, 5.0, 10.0, 20.0)
"""b r of the curves shown."""
COLOURS = ("#9dc3e6", "#5b9bd5", "#2e75b6", "#1f4e79", "#0f2540")
"""Theirs."""


def draw_halo(path: Path, checks: Sequence[HaloCheck]) -> None:
    """Write the picture: a column for each phase function; light within an angle, table and Wells over photons.

    Args:
        path: of the PNG.
        checks: of `check_halo`.
    """
    figure = Figure(figsize=(4.6 * len(checks), 11.0), layout="constrained")
    figure.suptitle("halo of an isotropic lamp: photons (dots, 1 standard error), table (lines), Wells 1973 (dashed)")
    axes = figure.subplots(3, len(checks), sharex=True, sharey="row", squeeze=False)
    middle = CHECKED_A_B.index(0.1)
    for column, check in zip(axes.T, checks, strict=True):
        _light(column[0], check, middle)
        _ratios(column[1], check)
        _wells(column[2], check, middle)
        column[2].set_xlabel("half angle in degrees")
    names = ("halo within, over e^{-ar} / r²; a/b = 0.1", "table / photons, all a/b", "Wells / photons, a/b = 0.1")
    for row, name in zip(axes, names, strict=True):
        row[0].set_ylabel(name)
    axes[0][0].legend(fontsize=8)
    save_figure(figure, path)


def _light(panel: Axes, check: HaloCheck, ratio: int) -> None:
    panel.set_title(f"{check.phase}, {check.photons:,} photons", fontsize=10)
    for br, colour in zip(SHOWN_BR, COLOURS, strict=True):
        i = CHECKED_BR.index(br)
        fresh, error = check.fresh[i, ratio], check.error[i, ratio]
        known = np.isfinite(error)
        panel.errorbar(
            np.array(HALF_ANGLES_DEG)[known], fresh[known], (fresh * error)[known], fmt="o", color=colour, ms=4
        )
        panel.plot(HALF_ANGLES_DEG, check.table[i, ratio], color=colour, lw=1.3, label=f"b r = {br:g}")
        panel.plot(HALF_ANGLES_DEG, check.wells[0, i], "--", color=colour, lw=0.9)
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.grid(True, which="both", alpha=0.25)


def _ratios(panel: Axes, check: HaloCheck) -> None:
    panel.axhspan(0.9, 1.1, color="#e8f0e4")
    for i, br in enumerate(CHECKED_BR):
        for j in range(len(CHECKED_A_B)):
            judged = check.judged[i, j]
            shift = 1.0 + 0.02 * (i - 4)
            angle = np.array(HALF_ANGLES_DEG) * shift
            colour = COLOURS[min(int(np.searchsorted(SHOWN_BR, br)), 4)]
            panel.plot(angle[judged], check.ratio[i, j][judged], "o", color=colour, ms=2.5)
            panel.plot(angle[~judged], check.ratio[i, j][~judged], "x", color="#bbbbbb", ms=3)
    panel.set_ylim(0.75, 1.25)
    panel.grid(True, alpha=0.25)


def _wells(panel: Axes, check: HaloCheck, ratio: int) -> None:
    panel.axhspan(0.9, 1.1, color="#e8f0e4")
    for br, colour in zip(SHOWN_BR, COLOURS, strict=True):
        i = CHECKED_BR.index(br)
        judged = check.judged[i, ratio]
        for theta0, wells, style in zip(WELLS_RAD, check.wells, ("-", ":", "--"), strict=True):
            label = f"θ0 = {theta0:g}" if br == SHOWN_BR[0] else None
            values = np.where(judged, wells[i] / check.fresh[i, ratio], np.nan)
            panel.plot(HALF_ANGLES_DEG, values, style, color=colour, lw=1.2, label=label)
    panel.set_yscale("log")
    panel.legend(fontsize=8)
    panel.grid(True, which="both", alpha=0.25)
