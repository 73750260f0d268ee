"""The BlueROV2 Heavy's steady speeds by stick beside a tank run of a real one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from auvdock.controllers.linear_model import hydrodynamic_wrench
from auvdock.core.arrays import Array
from auvdock.core.vehicle import VehicleCfg, load_vehicle
from auvdock.sim.hydrodynamics import GRAVITY_M_S2

__all__ = ["ASSUMED", "PUBLISHED", "STICKS", "TankRow", "compare_tank", "steady_speed_m_s"]

STICKS = (0.125, 0.5, 0.75)
"""Shares of full stick; a thruster gets 1500 µs ± 400 µs times that, so 1700 µs at half stick as in the tank."""
PUBLISHED = {
    "surge": ((0.14, 0.17), (0.68, 0.77), (0.85, 0.99)),
    "sway": ((0.10, 0.10), (0.49, 0.58), (0.72, 0.73)),
    "heave": ((0.12, 0.13), (0.53, 0.63), (0.76, 0.92)),
}
"""Least and greatest steady speed in m/s of the real vehicle's runs to either side, at each of `STICKS`."""
ASSUMED = (
    "the supply voltage, which was not told",
    "a hull that its autopilot keeps level and on course",
    "thrust as in the bollard at any speed",
    "no tether, and our ballast: 2.3 N light in sea water",
)
"""What the comparison takes for granted."""
_AXES = {"surge": 0, "sway": 1, "heave": 2}


@dataclass(frozen=True)
class TankRow:
    """One stick position of one axis."""

    axis: str
    stick: float
    published_m_s: tuple[float, float]
    """Least and greatest."""
    ours_m_s: tuple[float, float]
    """Least and greatest of both senses."""

    @property
    def deviation(self) -> float:
        """Middle of ours over the middle of the published, less 1."""
        return sum(self.ours_m_s) / sum(self.published_m_s) - 1.0


def compare_tank(voltage_v: float) -> list[TankRow]:
    """All axes and sticks at one supply voltage.

    Raises:
        ConfigError: a voltage at which the thrusters were not measured.
    """
    vehicle = load_vehicle("bluerov2_heavy", voltage_v)
    rows: list[TankRow] = []
    for axis, published in PUBLISHED.items():
        for stick, speeds in zip(STICKS, published, strict=True):
            both = sorted(abs(steady_speed_m_s(vehicle, axis, sense * stick)) for sense in (-1.0, 1.0))
            rows.append(TankRow(axis, stick, speeds, (both[0], both[1])))
    return rows


def steady_speed_m_s(vehicle: VehicleCfg, axis: str, stick: float) -> float:
    """Speed along a body axis at which drag, net buoyancy and thrust balance, the hull held level.

    Each thruster that pushes along the axis gets the stick, with the sign that makes it push that way.
    """
    row = _AXES[axis]
    senses = np.sign(np.round(vehicle.thruster_wrenches_body[row], 6))
    thrust_n = float(vehicle.thruster_wrenches_body[row] @ vehicle.efforts(stick * senses))
    if axis == "heave":
        thrust_n += vehicle.buoyancy_n - vehicle.mass_kg * GRAVITY_M_S2

    def net_n(speed_m_s: float) -> float:
        nu: Array = np.zeros(6)
        nu[row] = speed_m_s
        return thrust_n + float(hydrodynamic_wrench(vehicle, nu)[row])

    speed_m_s: Any = brentq(net_n, -5.0, 5.0, xtol=1e-9)
    return float(speed_m_s)
