"""Parameters and operations of the papers' networks beside ours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from auvdock.networks.catalog import load_model
from auvdock.networks.extra import need_torch

__all__ = ["NOTES", "PUBLISHED", "TOLERANCE", "Published", "SizeResult", "compare_sizes"]

TOLERANCE = 0.02
"""Relative difference that is aimed at."""

NOTES: dict[str, str] = {
    "rounded": "within the paper's own rounding: ours gives the printed figure",
    "C3k2": "needs YOLOv11's light class branch in the head too; the paper does not tell",
    "GhostConv": "needs the neck's two convolutions too; the paper names the backbone alone",
    "v12": "not built: YOLOv12n-pose as published has 2.6 M and 7.7 GFLOPs, which is not this either",
    "redter": "not built: the paper describes and cites nothing of it",
    "v10": "not built: the only one with two heads, and no part of any paper's method",
    "MB": "the paper's 'Parameter (M)' fits files of 2 bytes a weight: MB, not 10⁶ weights",
    "8.7": "8.7 is YOLOv8n with 80 classes and no keypoints (ours: 8.74); with one of each it is 8.3, as in paper A",
    "P2": "the file cannot stay at 6.2 MB: with P2 the channels of the class and keypoint branches halve",
    "DC": "as a profiler counts that hooks on layers: it misses dynamic convolutions (with them: 12.44)",
    "RFA": "RFAConv holds the 3×3 convolution that it replaces, so it cannot cost less; where in the head is not told",
    "kp": "the row before with other suppression: the same network",
    "Container": "the block as its authors publish it adds 0.79 M; 0.75 M would be an MLP 3.7 times as wide",
}
"""What could not be matched, or only by reading more into a paper than it says."""


@dataclass(frozen=True)
class Published:
    """One row of a paper's table."""

    paper: str
    """A, B or C."""
    table: int
    """Its number."""
    row: str
    """What the paper calls it."""
    model: str | None
    """Ours, of `auvdock.networks.catalog`; None if we have none."""
    size: str
    """As printed."""
    unit: Literal["M", "MB"]
    """Of the size: 10⁶ parameters, or 10⁶ bytes of a file with 2 bytes a parameter."""
    gflops: str | None
    """10⁹ operations at 640 × 640 px, as printed."""
    notes: tuple[str, ...]
    """Keys of `NOTES`."""
    required: bool
    """Whether it is to be met."""
    by_layers: bool = False
    """Whether the paper's profiler is taken to have seen layers alone (`NetworkSize.module_gflops`)."""


@dataclass(frozen=True)
class SizeResult:
    """One row, and ours."""

    published: Published
    """The paper's."""
    parameters: int
    """Ours, with normalisations folded into convolutions."""
    trained_parameters: int
    """Ours before folding."""
    gflops: float
    """Ours, counted as the paper's are."""
    size: float
    """Ours in the unit of the paper's size: 10⁶ parameters, or MB."""
    size_difference: float
    """Ours over the paper's, less 1."""
    gflops_difference: float | None
    """The same."""
    met: bool
    """Whether all of the paper's figures differ by 2 % or less, or are ours when rounded as they are."""


def _a(table: int, row: str, model: str | None, m: str, gflops: str, *notes: str) -> Published:
    return Published("A", table, row, model, m, "M", gflops, notes, model is not None)


def _b(row: str, model: str, mb: str, gflops: str, *notes: str, by_layers: bool = False) -> Published:
    return Published("B", 4, row, model, mb, "MB", gflops, notes, False, by_layers)


def _c(table: int, row: str, model: str | None, m: str, *notes: str, required: bool = False) -> Published:
    return Published("C", table, row, model, m, "M", None, notes, required)


PUBLISHED: tuple[Published, ...] = (
    _a(7, "YOLOv8n-pose", "yolov8n_pose", "3.1", "8.4"),
    _a(7, "YOLOv11n-pose", "yolov11n_pose", "2.7", "6.7"),
    _a(7, "YOLOv12n-pose", None, "2.3", "6.2", "v12"),
    _a(7, "YOLO8-redter", None, "6.1", "11.8", "redter"),
    _a(7, "ours", "paper_a_light", "1.8", "4.8"),
    _a(8, "YOLOv8n-pose", "yolov8n_pose", "3.1", "8.4"),
    _a(8, "A: C3k2", "paper_a_c3k2", "2.5", "6.7", "C3k2"),
    _a(8, "B: CSPPC", "paper_a_csppc", "2.6", "7.1"),
    _a(8, "C: GhostConv", "paper_a_ghost", "2.8", "7.8", "GhostConv"),
    _a(8, "A + B", "paper_a_c3k2_csppc", "2.1", "5.3"),
    _a(8, "B + C", "paper_a_csppc_ghost", "2.3", "6.5"),
    _a(8, "A + C", "paper_a_c3k2_ghost", "2.2", "6.0", "rounded"),
    _a(8, "A + B + C", "paper_a_light", "1.8", "4.8"),
    _b("YOLOv8n-pose", "yolov8n_pose", "6.2", "8.7", "MB", "8.7"),
    _b("+P2", "paper_b_p2", "6.2", "12.4", "P2"),
    _b("+P2, +DC", "paper_b_p2_dynamic", "7.5", "11.8", "DC", by_layers=True),
    _b("+P2, +DC, +RFApose", "paper_b", "9.1", "10.5", "RFA", by_layers=True),
    _b("+P2, +DC, +RFApose, +kp", "paper_b", "9.1", "10.5", "kp", "RFA", by_layers=True),
    _c(4, "YOLOv3n", "yolov3", "103.67"),
    _c(4, "YOLOv5n", "yolov5n", "2.50"),
    _c(4, "YOLOv8n", "yolov8n", "3.01"),
    _c(4, "YOLOv10n", None, "2.70", "v10"),
    _c(4, "YOLOv11n", "yolov11n", "2.58", required=True),
    _c(4, "YOLO-D", "yolo_d", "3.03", "Container"),
    _c(5, "1: YOLOv11n", "yolov11n", "2.58", required=True),
    _c(5, "2: BiFPN", "yolo_d_bifpn", "2.58", required=True),
    _c(5, "3: AKConv", "yolo_d_akconv", "2.28", required=True),
    _c(5, "4: CONTAINER", "yolo_d_container", "3.33", "Container"),
    _c(5, "5: BiFPN, AKConv", "yolo_d_bifpn_akconv", "2.28", required=True),
    _c(5, "6: BiFPN, CONTAINER", "yolo_d_bifpn_container", "3.33", "Container"),
    _c(5, "7: AKConv, CONTAINER", "yolo_d_akconv_container", "3.03", "Container"),
    _c(5, "8: all", "yolo_d", "3.03", "Container"),
)
"""Paper A's tables 7 and 8, paper B's table 4, paper C's tables 4 and 5.

The marks of paper C's table 5 are lost; its parameters tell which rows are which.
"""


def compare_sizes(told: Callable[[], object]) -> list[SizeResult | Published]:
    """Count each row's network; a row without a network of ours stays as it is.

    Args:
        told: called after each row.

    Raises:
        AuvdockError: PyTorch is not installed.
    """
    need_torch()
    from auvdock.networks.size import NetworkSize, measure_size

    counted: dict[str, NetworkSize] = {}
    rows: list[SizeResult | Published] = []
    for published in PUBLISHED:
        if published.model is None:
            rows.append(published)
        else:
            if published.model not in counted:
                counted[published.model] = measure_size(load_model(published.model))
            size = counted[published.model]
            gflops = size.module_gflops if published.by_layers else size.gflops
            rows.append(_result(published, size.parameters, size.trained_parameters, gflops))
        told()
    return rows


def _result(published: Published, parameters: int, trained: int, gflops: float) -> SizeResult:
    printed, ours = published.size, (1e-6 if published.unit == "M" else 2e-6) * parameters
    pairs = [(printed, ours)] if published.gflops is None else [(printed, ours), (published.gflops, gflops)]
    met = all(abs(_off(text, value)) <= TOLERANCE or _rounds(text, value) for text, value in pairs)
    gflops_off = None if published.gflops is None else _off(published.gflops, gflops)
    return SizeResult(published, parameters, trained, gflops, ours, _off(printed, ours), gflops_off, met)


def _off(printed: str, ours: float) -> float:
    return ours / float(printed) - 1.0


def _rounds(printed: str, ours: float) -> bool:
    digits = len(printed.partition(".")[2])
    return f"{ours:.{digits}f}" == printed
