"""`auvdock dataset`: render labelled frames for learned detectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from auvdock.campaign.process import usable_cores
from auvdock.cli.console import counting_progress, messages
from auvdock.cli.parsing import at_least, named_by_flag, parse
from auvdock.dataset.config import load_dataset_cfg
from auvdock.dataset.make import Making
from auvdock.dataset.preview import write_preview

__all__ = ["Dataset", "run"]


@dataclass(frozen=True)
class Dataset:
    """Render labelled frames of lights and tags, split by scene: COCO keypoints, YOLO text and a data card.

    The same command gives the same bytes, whatever the number of workers. A run that was ended goes on after the scenes
    that it has finished when it is given again.
    """

    out: Path
    """Folder to write; a new one, or that of a run to go on with."""
    frames: int = 2000
    """Frames of all splits together."""
    seed: int = 0
    """Decides all that is drawn."""
    split: tuple[float, float, float] = (0.7, 0.1, 0.2)
    """Shares of train, val and test; numbers of frames serve as well."""
    config: str = "default"
    """What is drawn from which ranges: a preset, or a TOML file written as assets/datasets/default.toml."""
    workers: int = 1
    """Processes; 0 is one for each core."""
    shards: bool = False
    """Write each scene's frames as one array (.npy), too, which trainers read without decoding."""
    preview: Path | None = None
    """Also draw a sheet of labelled frames (PNG)."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Dataset, argv, prog)
    at_least(1, frames=args.frames)
    at_least(0, seed=args.seed, workers=args.workers)
    with named_by_flag(dataset="config", file="config"):
        cfg = load_dataset_cfg(args.config)
    making = Making(cfg, args.frames, args.seed, args.split, args.out, shards=args.shards)
    total = len(making.scenes)
    kept = total - len(making.missing)
    if kept:
        messages().print(f"{kept} of {total} scenes are there already", highlight=False)
    with counting_progress() as progress:
        task = progress.add_task("scenes", total=total, completed=kept)
        for _ in making.run(args.workers or usable_cores()):
            progress.advance(task)
    content = making.finish()
    if args.preview is not None:
        write_preview(args.out, making.scenes, args.preview)
    counts = {split: part["frames"] for split, part in content["splits"].items()}
    words = ", ".join(f"{count} {split}" for split, count in counts.items())
    messages().print(f"{words}; wrote {args.out}", highlight=False, soft_wrap=True)
    return 0
