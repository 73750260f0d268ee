"""Settings of the rotating beacon's pilot."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.controllers.rotating.modes import RotatingModeCfg
from auvdock.controllers.rotating.route import RouteCfg
from auvdock.controllers.rotating.steering import CourseCfg, LookAroundCfg
from auvdock.core.checked import Checked
from auvdock.estimation.beacon_filter import BeaconFilterCfg

__all__ = ["RotatingControlCfg"]


@dataclass(frozen=True)
class RotatingControlCfg(Checked):
    """Everything that can be set about the way to the cone before the mouth."""

    look: LookAroundCfg = LookAroundCfg()
    """Looking around."""
    filter: BeaconFilterCfg = BeaconFilterCfg()
    """Where the beacon is."""
    route: RouteCfg = RouteCfg()
    """The way around."""
    course: CourseCfg = CourseCfg()
    """Speeds and view on it."""
    modes: RotatingModeCfg = RotatingModeCfg()
    """Mode machine."""
