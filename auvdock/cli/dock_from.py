"""`auvdock dock --from DIR#EPISODE`: an episode of a campaign again, whatever its station."""

from __future__ import annotations

from collections.abc import Sequence

from auvdock.campaign.replay import stored_episode
from auvdock.cli.dock_run import reference_in
from auvdock.cli.main import find_run
from auvdock.core.errors import ConfigError
from auvdock.episode.stations import STATIONS

__all__ = ["run_from"]


def run_from(argv: Sequence[str], prog: str) -> int:
    """Run the command of the episode's own station, with all flags that it has.

    Raises:
        ConfigError: neither a station nor an episode was named.
        CampaignError: there is no such campaign.
    """
    reference = reference_in(argv)
    if reference is None and {"-h", "--help"} & set(argv):
        print(f"usage: {prog} {{{','.join(STATIONS)}}} [--help] ...\n       {prog} --from DIR#EPISODE ...")
        return 0
    if reference is None:
        given = argv[0] if argv else ""
        raise ConfigError("dock", given, f"a station ({', '.join(STATIONS)}), or --from DIR#EPISODE of a campaign")
    station = stored_episode(reference).station
    return find_run(("dock", station))(argv, f"{prog} {station}")
