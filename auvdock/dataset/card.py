"""The data card: what a data set was drawn from, and what came out."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from auvdock.dataset.labels import CLASSES
from auvdock.dataset.plan import SPLITS

__all__ = ["card", "card_markdown"]

_SIDES_PX = (10.0, 16.0, 32.0)
"""Borders between sizes of boxes, before floor and cap."""


def card(recipe: Mapping[str, Any], scenes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Counts of a data set as plain data.

    Args:
        recipe: what it was asked for: command, seeds, configuration, version.
        scenes: the records of its scenes, as `store` writes them.
    """
    edges = recipe["config"]["range"]["edges"]
    splits: dict[str, Any] = {}
    for split in SPLITS:
        ours = [scene for scene in scenes if scene["split"] == split]
        frames = [frame for scene in ours for frame in scene["frames"]]
        labels = [label for frame in frames for label in frame["labels"]]
        positive = [label for label in labels if not label["ignored"]]
        splits[split] = {
            "scenes": len(ours),
            "scene_seeds": [scene["seed"] for scene in ours],
            "frames": len(frames),
            "frames_without_positive": sum(all(label["ignored"] for label in frame["labels"]) for frame in frames),
            "frames_by_kind": _counts(frame["facts"]["kind"] for frame in frames),
            "frames_by_lights": _counts(
                str(frame["facts"]["lights"]) for frame in frames if not frame["facts"]["kind"].startswith("unlit")
            ),
            "frames_by_water": _counts(frame["facts"]["water"] for frame in frames),
            "frames_by_c_range": _counts(_band(frame["facts"]["c_range"], edges) for frame in frames),
            "frames_with_jellyfish": sum(frame["facts"]["jellyfish"] > 0 for frame in frames),
            "positives_by_class": _counts(CLASSES[label["class_id"]] for label in positive),
            "positives_by_c_range": _counts(_band(label["c_range"], edges) for label in positive),
            "positives_by_side_px": _counts(_band(label["side_px"], (0.0, *_SIDES_PX)) for label in positive),
            "positives_of_merged_lights": sum(len(label["lamps"]) > 1 for label in positive),
            "ignored_by_reason": _counts(label["ignored"] for label in labels if label["ignored"]),
        }
    return {**recipe, "splits": splits}


def card_markdown(content: Mapping[str, Any]) -> str:
    """The same for people."""
    lines = [
        "# Data card",
        "",
        f"Frames rendered and labelled by auvdock {content['version']}; the rules of the labels stand in its",
        "`docs/dataset.md`. The same command with the same settings (below) gives the same bytes.",
        "",
        f"    {content['command']}",
        "",
    ]
    splits = content["splits"]
    rows = [("scenes",), ("frames",), ("frames_without_positive",), ("frames_with_jellyfish",)]
    lines += _table("Size", [(key[0].replace("_", " "), [splits[split][key[0]] for split in SPLITS]) for key in rows])
    for key, title in (
        ("frames_by_kind", "Frames by kind of scene"),
        ("frames_by_lights", "Frames by number of lights that shine"),
        ("frames_by_water", "Frames by water"),
        ("frames_by_c_range", "Frames by c · range to the station at 450 nm"),
        ("positives_by_class", "Positive labels by class"),
        ("positives_by_c_range", "Positive labels by c · range at the light's own wavelength"),
        ("positives_by_side_px", "Positive labels by longer side in px, before floor and cap"),
        ("ignored_by_reason", "Ignored labels by reason"),
    ):
        names = sorted({name for split in SPLITS for name in splits[split][key]}, key=_order)
        lines += _table(title, [(name, [splits[split][key].get(name, 0) for split in SPLITS]) for name in names])
    lines += ["## Drawn from", "", "| Setting | Value |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in _flat(content["config"])]
    lines += ["", "Seeds of the scenes stand in `card.json`; no two splits share one.", ""]
    return "\n".join(lines)


def _table(title: str, rows: Sequence[tuple[str, Sequence[int]]]) -> list[str]:
    head = [f"## {title}", "", f"| | {' | '.join(SPLITS)} |", "|---|" + "---:|" * len(SPLITS)]
    return [*head, *(f"| {name} | {' | '.join(str(count) for count in counts)} |" for name, counts in rows), ""]


def _counts(names: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(names).items(), key=lambda item: _order(item[0])))


def _order(name: str) -> tuple[float, str]:
    """Numbers by size, then names."""
    first = name.split(" ")[0]
    try:
        return float(first), name
    except ValueError:
        return math.inf, name


def _band(value: float, edges: Sequence[float]) -> str:
    for low, high in pairwise(edges):
        if low <= value < high:
            return f"{low:g} to {high:g}"
    return f"{edges[-1]:g} and more"


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, str]]:
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", ", ".join(map(str, value)) if isinstance(value, list) else str(value)
