"""Pilots by name: the station's own and a user's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from auvdock.controllers.pilot import Pilot
from auvdock.core.camera import Camera
from auvdock.core.errors import ConfigError
from auvdock.core.named import find_named
from auvdock.core.stations import StationCfg
from auvdock.core.vehicle import VehicleCfg

__all__ = ["OWN", "PilotFactory", "find_pilot", "make_named_pilot"]

OWN = "own"
"""Name that stands for the pilot that the package has for the station."""

PilotFactory = Callable[[Any, VehicleCfg, Any, Camera, float], Pilot[Any]]
"""Makes a pilot from control settings, vehicle, station, camera and control period in s, as `ConicalPilot` does."""


def find_pilot(name: str) -> PilotFactory | None:
    """The factory that "package.module:Name" names; None for `OWN`.

    Raises:
        ConfigError: no such module or attribute.
    """
    if name == OWN:
        return None
    if ":" not in name:
        raise ConfigError("controller", name, f"{OWN}, or a pilot of yours as package.module:Name")
    return find_named("controller", name)


def make_named_pilot(
    name: str,
    own: PilotFactory,
    control: Any,  # noqa: ANN401 - each kind of station has settings of its own
    vehicle: VehicleCfg,
    station: StationCfg,
    camera: Camera,
    dt_s: float,
) -> Pilot[Any]:
    """The pilot `name` for a station; `own` makes the package's.

    Raises:
        ConfigError: nothing of that name, or an object that is no pilot or does not take these arguments.
    """
    found = find_pilot(name)
    if found is None:
        return own(control, vehicle, station, camera, dt_s)
    try:
        pilot = found(control, vehicle, station, camera, dt_s)
    except TypeError as error:
        remedy = f"a pilot made from (control, vehicle, station, camera, dt_s) ({error})"
        raise ConfigError("controller", name, remedy) from error
    for method in ("initial_state", "step"):
        if not callable(getattr(pilot, method, None)):
            raise ConfigError("controller", name, "a class with the methods of auvdock.controllers.pilot.Pilot")
    return pilot
