"""`auvdock dock --from DIR#EPISODE`: an episode of a campaign again, whatever its station."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from auvdock.campaign.replay import stored_episode
from auvdock.cli.dock import run_conical
from auvdock.cli.dock_landing import run_landing
from auvdock.cli.dock_rotating import run_rotating
from auvdock.cli.dock_run import reference_in
from auvdock.core.errors import ConfigError

__all__ = ["run_from"]

RUN: Mapping[str, Callable[[Sequence[str], str], int]] = {
    "conical": run_conical,
    "rotating": run_rotating,
    "landing": run_landing,
}
"""Command of each station of `auvdock.campaign.config.STATIONS`."""


def run_from(argv: Sequence[str], prog: str) -> int:
    """Run the command of the episode's own station, with all flags that it has.

    Raises:
        ConfigError: neither a station nor an episode was named.
        CampaignError: there is no such campaign.
    """
    reference = reference_in(argv)
    if reference is None and {"-h", "--help"} & set(argv):
        print(f"usage: {prog} {{{','.join(RUN)}}} [--help] ...\n       {prog} --from DIR#EPISODE ...")
        return 0
    if reference is None:
        given = argv[0] if argv else ""
        raise ConfigError("dock", given, f"a station ({', '.join(RUN)}), or --from DIR#EPISODE of a campaign")
    station = stored_episode(reference).station
    return RUN[station](argv, f"{prog} {station}")
