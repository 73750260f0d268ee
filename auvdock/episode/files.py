"""Stations and waters of one's own: settings that name a TOML file become what the file says.

A resolved configuration thus needs none of the files that it came from; a campaign can be flown again without them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from auvdock.core.stations import StationCfg
from auvdock.core.strict import from_mapping, names_file, read_toml, to_plain
from auvdock.optics.water import WaterCfg

__all__ = ["embed_files", "read_station", "read_water"]


def embed_files(changes: Mapping[str, Any], station: type[StationCfg]) -> Mapping[str, Any]:
    """Nested changes of an episode, with `world.station` and `world.water` read where they name files.

    Args:
        changes: as `EpisodeCfg.override` takes them.
        station: what the file of a station describes.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    world: Any = changes.get("world") if isinstance(cast(Any, changes), Mapping) else None
    if not isinstance(world, Mapping):
        return changes
    read = dict(cast(Mapping[str, Any], world))
    if names_file(read.get("station")):
        read["station"] = read_station(Path(read["station"]), station)
    if names_file(read.get("water")):
        read["water"] = read_water(Path(read["water"]))
    return {**changes, "world": read}


def read_station(path: Path, station: type[StationCfg]) -> dict[str, Any]:
    """All settings of a station's file, those that it leaves to their defaults included.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    return to_plain(from_mapping(cast(Any, station), read_toml(path), "world.station."))


def read_water(path: Path) -> dict[str, Any]:
    """All settings of a water's file.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    return to_plain(from_mapping(WaterCfg, read_toml(path), "world.water."))
