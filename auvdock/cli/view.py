"""`auvdock view FILE.rrd`: open a recording in the Rerun viewer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from auvdock.cli.parsing import parse

__all__ = ["View", "run"]


@dataclass(frozen=True)
class View:
    """Open a recording in the Rerun viewer."""

    file: Annotated[Path, tyro.conf.Positional]
    """Recording that `auvdock dock ... --record` wrote."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(View, argv, prog)
    from auvdock.recording.viewer import view

    view(args.file)
    return 0
