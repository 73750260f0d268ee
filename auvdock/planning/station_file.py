"""A station with a given set of lights as a TOML file that `load_toml(ConicalStationCfg, ...)` reads back."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from auvdock.core.beacons import BeaconLayout
from auvdock.core.errors import ConfigError
from auvdock.core.station import ConicalStationCfg
from auvdock.core.strict import to_plain

__all__ = ["station_toml", "with_lights", "write_station"]


def with_lights(station: ConicalStationCfg, layout: BeaconLayout) -> ConicalStationCfg:
    """The station with these lights, each listed."""
    return dataclasses.replace(station, array_count=0, beacons=layout.beacons)


def station_toml(station: ConicalStationCfg) -> str:
    """The station as TOML."""
    # TOML has no null: what the station lacks stays away, as in the presets.
    plain: dict[str, Any] = {key: value for key, value in to_plain(station).items() if value is not None}
    lines = [f"{key} = {_value(value)}" for key, value in plain.items() if not isinstance(value, dict | list)]
    for key, value in plain.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]", *(f"{name} = {_value(item)}" for name, item in value.items())]
    for beacon in plain["beacons"]:
        lines += ["", "[[beacons]]", *(f"{name} = {_value(item)}" for name, item in beacon.items())]
    return "\n".join(lines) + "\n"


def write_station(path: Path, station: ConicalStationCfg) -> None:
    """Write the station file.

    Raises:
        ConfigError: the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(station_toml(station), encoding="utf-8")
    except OSError as error:
        raise ConfigError("out", str(path), f"a folder that can be written to ({error.strerror})") from error


def _value(value: object) -> str:
    # Strings, numbers, truth and lists of them look the same in JSON and TOML.
    return json.dumps(value, ensure_ascii=False)
