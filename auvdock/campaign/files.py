"""A campaign's TOML file, and how a campaign keeps the stations and waters of one's own that it names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from auvdock.campaign.axes import WATER_AXES
from auvdock.campaign.config import CampaignCfg
from auvdock.core.strict import from_mapping, names_file, read_toml, to_plain
from auvdock.episode.files import embed_files, read_water
from auvdock.episode.stations import STATIONS, station_kind

__all__ = ["keep_files", "load_campaign"]


def load_campaign(path: Path) -> CampaignCfg:
    """Read a campaign's TOML file; its `station` may be the name of another one, which a station is read from.

    Files are looked for from the current folder on, and read now: the campaign keeps what they say.

    Raises:
        ConfigError: a file cannot be read, has an unknown key or a value that does not fit.
    """
    data = read_toml(path)
    station = data.get("station")
    if not names_file(station):
        return keep_files(from_mapping(CampaignCfg, data))
    cfg = keep_files(from_mapping(CampaignCfg, {**data, "station": station_kind(Path(str(station)))}))
    base = STATIONS[cfg.station].level(cfg.level).override({"world": {"station": station}}).override(cfg.episode)
    world = {**cfg.episode.get("world", {}), "station": to_plain(base.world.station)}
    return replace(cfg, episode={**cfg.episode, "world": world})


def keep_files(cfg: CampaignCfg) -> CampaignCfg:
    """The campaign with the content of the files that its episodes' settings and its axes name.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    episode = embed_files(cfg.episode, type(STATIONS[cfg.station].level(cfg.level).world.station))
    named = [value for axis in cfg.axes if axis.name in WATER_AXES for value in axis.values if names_file(value)]
    waters = {str(value): read_water(Path(str(value))) for value in named}
    return replace(cfg, episode=episode, waters=waters)
