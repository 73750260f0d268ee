"""Everything that can be set about the landing pilot."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.controllers.allocation import AllocationCfg, Preload
from auvdock.controllers.autopilot import AutopilotCfg
from auvdock.controllers.gains import Crossover, DesignCfg, PhaseMargin
from auvdock.controllers.landing.guidance import LandingGuidanceCfg
from auvdock.controllers.landing.modes import LandingModeCfg
from auvdock.controllers.landing.search import SpiralCfg
from auvdock.core.checked import Checked
from auvdock.core.limits import Positive

__all__ = ["HoverAllocationCfg", "HoverAutopilotCfg", "HoverDesignCfg", "LandingControlCfg"]


@dataclass(frozen=True)
class HoverDesignCfg(DesignCfg):
    """Loops for a vehicle that hovers: designed near zero speed, stiffer in attitude."""

    surge_m_s: float = 0.1
    """Speed through the water at which the vehicle is linearised: a station-keeping vehicle's in a weak current."""
    surge_crossover_rad_s: Crossover = 1.9
    """Gain crossover of the surge speed loop."""
    sway_crossover_rad_s: Crossover = 2.2
    """Gain crossover of the sway velocity loop."""
    velocity_margin_deg: PhaseMargin = 60.0
    """Phase margin for which the velocity loops are designed."""
    attitude_margin_deg: PhaseMargin = 52.0
    """Phase margin for which the attitude loops are designed."""
    pitch_crossover_rad_s: Crossover = 2.5
    """Gain crossover of the pitch loop."""
    roll_crossover_rad_s: Crossover = 2.5
    """Gain crossover of the roll loop, where thrusters act on roll."""


@dataclass(frozen=True)
class HoverAutopilotCfg(AutopilotCfg):
    """Autopilot for a vehicle that hovers."""

    design: HoverDesignCfg = HoverDesignCfg()
    """What the loops shall achieve."""
    current_time_constant_s: Positive = 0.4
    """Smoothing of the measured water velocity: gusts are fed forward as soon as the DVL's noise allows."""
    sway_acceleration_m_s2: Positive = 0.25
    """Fastest change of the sway and heave references: a descent must be stopped within decimetres."""


@dataclass(frozen=True)
class HoverAllocationCfg(AllocationCfg):
    """Allocation for a vehicle that hovers, often with next to no thrust."""

    preload: Preload = 0.03
    """Vectored thrusters push against each other with 0.9 N of a T200's 30 N: twice its dead band."""


@dataclass(frozen=True)
class LandingControlCfg(Checked):
    """Settings of the landing pilot."""

    autopilot: HoverAutopilotCfg = HoverAutopilotCfg()
    """Loops and their limits."""
    allocation: HoverAllocationCfg = HoverAllocationCfg()
    """Wrench to actuators."""
    position_walk_m_rs: float = 0.006
    """Dead reckoning without a pose: standard deviation after 1 s, growing with the square root of time. A DVL of
    3 mm/s at 20 Hz makes 0.7 mm/√s, its scale error and the compass a few more."""
    guidance: LandingGuidanceCfg = LandingGuidanceCfg()
    """Speeds, corridor, station keeping."""
    search: SpiralCfg = SpiralCfg()
    """Looking for the station."""
    modes: LandingModeCfg = LandingModeCfg()
    """Mode machine."""
    controller: str = "own"
    """"own", the package's pilot, or a pilot of yours as "package.module:Name" (`auvdock.controllers.named`)."""
