"""`auvdock dock landing`: one landing with live progress, a result table, a recording or JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import tyro

from auvdock.cli.dock_flags import DockFlags
from auvdock.cli.dock_run import run_dock
from auvdock.episode.config import LandingEpisodeCfg

__all__ = ["DockLanding", "run_landing"]


@dataclass(frozen=True)
class DockLanding(DockFlags):
    """Land on the platform by its lights and its AprilTag: one episode that begins some metres above it.

    Exit code: 0 docked, 1 not docked, 2 input that cannot be used, 70 unexpected error, 74 docked and 75 not docked but
    the recording or the output could not be written.
    """

    vehicle: str | None = None
    """Vehicle preset: bluerov2_heavy or remus_hybrid."""
    levels: Literal["both", "lights", "tag"] | None = None
    """What perception goes by."""
    tag_detector: str | None = None
    """apriltag or contour."""
    episode: Annotated[LandingEpisodeCfg, tyro.conf.arg(name="")] = field(default_factory=LandingEpisodeCfg)

    def resolve(self) -> LandingEpisodeCfg:
        """The configuration with all flags applied.

        Raises:
            ConfigError: a value that does not fit.
        """
        changes: dict[str, Any] = {}
        if self.vehicle is not None:
            changes["world"] = {"sim": {"vehicle": self.vehicle}}
        perception = {"levels": self.levels, "tag_detector": self.tag_detector}
        changes["perception"] = {name: value for name, value in perception.items() if value is not None}
        return self.episode.override(self.changes()).override(changes)


def run_landing(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    return run_dock(DockLanding, argv, prog, "landing")
