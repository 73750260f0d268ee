"""`auvdock dock conical`: one episode with live progress, a result table, a recording or JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import tyro

from auvdock.cli.dock_flags import DockFlags
from auvdock.cli.dock_run import run_dock
from auvdock.episode.config import EpisodeCfg

__all__ = ["DockConical", "run_conical"]


@dataclass(frozen=True)
class DockConical(DockFlags):
    """Dock into the conical station: one episode.

    Exit code: 0 docked, 1 not docked, 2 input that cannot be used, 70 unexpected error, 74 docked and 75 not docked but
    the recording or the output could not be written.
    """

    episode: Annotated[EpisodeCfg, tyro.conf.arg(name="")] = field(default_factory=EpisodeCfg)

    def resolve(self) -> EpisodeCfg:
        """The configuration with all flags applied.

        Raises:
            ConfigError: a value that does not fit.
        """
        return self.episode.override(self.changes()).override(self.special())

    def special(self) -> dict[str, Any]:
        """Changes by flags of this station alone."""
        return {}


def run_conical(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    return run_dock(DockConical, argv, prog, "conical")
