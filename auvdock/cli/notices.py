"""What a user may want to put right although the command goes on: one line each on standard error."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from typing import TextIO

from auvdock.cli.console import tell
from auvdock.core.errors import AuvdockWarning

__all__ = ["told_once", "unusable_gl"]


@contextmanager
def told_once() -> Generator[None]:
    """Print the first warning of each kind of ours on one line, and leave all other warnings as they are."""
    told: set[type[Warning]] = set()
    with warnings.catch_warnings():
        warnings.simplefilter("always", AuvdockWarning)
        others = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if not issubclass(category, AuvdockWarning):
                others(message, category, filename, lineno, file, line)
            elif category not in told:
                told.add(category)
                tell(str(message))

        warnings.showwarning = show
        yield


def unusable_gl() -> None:
    """Tell that MUJOCO_GL cannot be used, if MuJoCo was loaded and said so; a command without images needs none."""
    refusal: str | None = getattr(sys.modules.get("auvdock.sim.mj"), "GL_REFUSAL", None)
    if refusal is not None:
        tell(f"no images: {refusal}")
