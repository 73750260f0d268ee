"""`auvdock reproduce detection-a`: paper A's detection of lights beside ours."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import at_least, parse
from auvdock.experiments.detection_a import BANDS, PAPER, ROWS, DetectorScore, evaluation_frames, score_detector
from auvdock.metrics.detection import need_evaluator

__all__ = ["DetectionA", "run_detection_a"]


@dataclass(frozen=True)
class DetectionA:
    """Threshold, blob and paper A's network on the same test frames, paper A's figures beside; needs pycocotools.

    The paper's figures are of its own pictures, which are not published: they stand beside ours and are no target.
    """

    data: Path | None = None
    """Folder of `auvdock dataset` whose test split is used; without, frames are rendered (needs OpenGL)."""
    frames: int = 1200
    """Test frames."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_detection_a(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(DetectionA, argv, prog)
    at_least(1, frames=args.frames)
    need_evaluator()
    frames = evaluation_frames(args.data, args.frames)
    with counting_progress() as progress:
        task = progress.add_task("frames", total=len(ROWS) * len(frames))
        scores = [score_detector(name, frames, lambda: progress.advance(task)) for name in ROWS]
    if args.json:
        rows = [{**asdict(score), "paper_ap50": PAPER.get(score.detector)} for score in scores]
        print(json.dumps({"c_range_bands": BANDS, "rows": rows}, allow_nan=False))
    else:
        _print(scores)
    return exit_codes.DONE


def _print(scores: Sequence[DetectorScore]) -> None:
    first = scores[0]
    title = f"paper A, table 7, AP50, and ours on {first.frames} frames with {first.lights} lights"
    rows: list[tuple[str, ...]] = []
    for score in scores:
        paper = (f"{value:.3f}" for value in PAPER.get(score.detector, ()))
        box, keypoint = (*paper, "", "")[:2]
        said = score.precision
        rows.append((f"{said.box_50:.3f}", box, f"{said.keypoint_50:.3f}", keypoint, f"{said.box:.3f}"))
    _table(title, ("boxes", "paper", "keypoints", "paper", "boxes, AP50-95"), scores, rows)
    rows = [
        (
            f"{score.recall:.3f}",
            f"{score.false_alarms:.2f}",
            f"{score.median_error_px:.2f}",
            f"{score.p95_error_px:.2f}",
            f"{score.median_ms:.1f}",
        )
        for score in scores
    ]
    names = ("recall", "false a frame", "centre, median px", "95 %", "ms")
    _table("at the score from which each flies; one thread", names, scores, rows)
    rows = [tuple("" if share is None else f"{share:.3f}" for share in score.band_recall) for score in scores]
    _table("recall by c · range", [f"{low:g} to {high:g}" for low, high in pairwise(BANDS)], scores, rows)


def _table(title: str, names: Sequence[str], scores: Sequence[DetectorScore], rows: Sequence[tuple[str, ...]]) -> None:
    table = Table(title=title, title_justify="left")
    table.add_column("detector")
    for name in names:
        table.add_column(name, justify="right")
    for score, row in zip(scores, rows, strict=True):
        table.add_row(score.detector, *row)
    output().print(table)
