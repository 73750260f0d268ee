"""One episode of a stored campaign, again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from auvdock.campaign.plan import EpisodeSpec, Plan
from auvdock.campaign.row import Row
from auvdock.campaign.store import read_campaign, read_table
from auvdock.core.errors import ConfigError
from auvdock.episode.config import AnyEpisodeCfg

__all__ = ["StoredEpisode", "stored_episode"]


@dataclass(frozen=True, eq=False)
class StoredEpisode:
    """An episode of a campaign.

    Attributes:
        station: that it docks into, a key of `auvdock.episode.stations.STATIONS`.
        spec: number, seed and place on the axes.
        cfg: its configuration.
        row: what the store holds of it; None if it has not been run.
    """

    station: str
    spec: EpisodeSpec
    cfg: AnyEpisodeCfg
    row: Row | None


def stored_episode(reference: str) -> StoredEpisode:
    """The episode that `FOLDER#NUMBER` names.

    Raises:
        ConfigError: text of another form, or a number that the campaign does not have.
        CampaignError: a folder without a campaign, or a damaged one.
    """
    folder, _, number = reference.rpartition("#")
    if not folder or not number.isdecimal():
        raise ConfigError("from", reference, "FOLDER#EPISODE, for example results#12")
    plan = Plan(read_campaign(Path(folder)))
    spec = plan[int(number)]
    rows = [row for row in read_table(Path(folder)).to_pylist() if row["episode"] == spec.episode]
    return StoredEpisode(plan.cfg.station, spec, plan.config(spec), rows[0] if rows else None)
