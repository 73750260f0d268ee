"""`auvdock dock rotating`: one episode that begins anywhere around the station."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import tyro

from auvdock.cli.dock import DockConical
from auvdock.cli.dock_run import run_dock
from auvdock.core.strict import to_plain
from auvdock.envs.config import rotating_world_cfg
from auvdock.episode.config import EpisodeCfg
from auvdock.experiments.rotating_docking import FALSE_LIGHT

__all__ = ["DockRotating", "run_rotating"]


def _base() -> EpisodeCfg:
    return EpisodeCfg(world=rotating_world_cfg())


@dataclass(frozen=True)
class DockRotating(DockConical):
    """Dock by the rotating beacon: one episode that begins anywhere in a ring around the station, with any heading.

    Exit code: 0 docked, 1 not docked, 2 input that cannot be used, 70 unexpected error, 74 docked and 75 not docked but
    the recording or the output could not be written.
    """

    clock_offset: float | None = None
    """Error of the vehicle's clock against the station's in s, on top of what synchronising leaves."""
    drop_frames: float | None = None
    """Share of the camera's frames that are lost, 0 to 0.95."""
    false_light: bool = False
    """Put a second, steady lamp of the same colour and power beside the station."""
    no_beacon: bool = False
    """Take the rotating beacon away: the fixed lamps are then all that there is, as a comparison."""
    episode: Annotated[EpisodeCfg, tyro.conf.arg(name="")] = field(default_factory=_base)

    def special(self) -> dict[str, Any]:
        """Changes by the rotating beacon's own flags."""
        world: dict[str, Any] = {}
        if self.clock_offset is not None:
            world["clock"] = {"offset_s": self.clock_offset}
        if self.drop_frames is not None:
            world["frame_drop_share"] = self.drop_frames
        if self.false_light:
            world["extra_lights"] = [to_plain(FALSE_LIGHT)]
        if self.no_beacon:
            world["station"] = {"rotating": None}
        return {"world": world}


def run_rotating(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    return run_dock(DockRotating, argv, prog, "rotating")
