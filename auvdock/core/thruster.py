"""A thruster as its maker measured it: thrust and electrical power by command, at the voltage that it is supplied with.

The command c in [-1, 1] is the width of the pulse to the speed controller, 1500 µs + 400 µs c. Thrust is that of the
bollard, in still water.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from auvdock.assets import asset
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.strict import load_toml

__all__ = ["ThrusterCfg", "ThrusterCurve", "load_curve"]

_NEUTRAL_US, _SPAN_US = 1500.0, 400.0


@dataclass(frozen=True)
class SupplyCfg(Checked):
    """What was measured at one supply voltage."""

    voltage_v: float
    dead_band_us: tuple[float, float]
    """Pulses between these give nothing."""
    thrust_n: tuple[float, ...]
    """At each pulse of the file, astern negative."""
    power_w: tuple[float, ...]
    """Electrical, likewise."""


@dataclass(frozen=True)
class ThrusterCfg(Checked):
    """A thruster's measured curves, read from TOML (`assets/thrusters`)."""

    source: str
    """Where the figures were published."""
    pulse_us: tuple[float, ...]
    """Pulses at which was measured, all of them outside the dead bands; growing."""
    supplies: tuple[SupplyCfg, ...]
    """In the order of their voltages."""

    def __post_init__(self) -> None:
        """Refuse curves that do not grow with the command: they could not be inverted."""
        for index, supply in enumerate(self.supplies):
            count = len(self.pulse_us)
            if len(supply.thrust_n) != count:
                raise ConfigError(f"supplies[{index}].thrust_n", len(supply.thrust_n), f"{count} numbers, one a pulse")
            if len(supply.power_w) != count:
                raise ConfigError(f"supplies[{index}].power_w", len(supply.power_w), f"{count} numbers, one a pulse")
            command, thrust, _ = _nodes(self, supply)
            if np.any(np.diff(command) < 0.0) or np.any(np.diff(thrust) < 0.0):
                raise ConfigError(f"supplies[{index}].thrust_n", supply.voltage_v, "thrust that grows with the pulse")


@dataclass(frozen=True, eq=False)
class ThrusterCurve:
    """Thrust and power at one voltage, straight between its nodes; both 0 in the dead band.

    Attributes:
        command: (n,) nodes in [-1, 1], the dead band's edges among them.
        thrust_n: (n,) thrust there.
        power_w: (n,) electrical power there.
        reference_n: what is called full effort: the greatest thrust of the weaker way, so that either way gives it.
    """

    command: Array
    thrust_n: Array
    power_w: Array
    reference_n: float

    def effort(self, command: Array) -> Array:
        """Thrust over `reference_n` of commands, any shape; what lies beyond ±1 counts as ±1."""
        return np.interp(command, self.command, self.thrust_n) / self.reference_n

    def command_for(self, effort: Array) -> Array:
        """The commands that give efforts, any shape: 0 for none, beyond the dead band's edge for any other."""
        return np.where(effort == 0.0, 0.0, np.interp(effort * self.reference_n, self.thrust_n, self.command))


def _nodes(cfg: ThrusterCfg, supply: SupplyCfg) -> tuple[Array, Array, Array]:
    """Command, thrust and power (n,) with the dead band's two edges put between the measured points."""
    pulses = np.array(cfg.pulse_us)
    place = int(np.searchsorted(pulses, _NEUTRAL_US))
    nodes = np.insert(pulses, place, supply.dead_band_us)
    edges = np.zeros(2)
    thrust, power = np.array(supply.thrust_n), np.array(supply.power_w)
    return (nodes - _NEUTRAL_US) / _SPAN_US, np.insert(thrust, place, edges), np.insert(power, place, edges)


@lru_cache(maxsize=64)
def load_curve(name: str, voltage_v: float) -> ThrusterCurve:
    """The curve of a thruster preset, straight between the voltages at which it was measured.

    Raises:
        ConfigError: no such preset, or a voltage beyond those of its file.
    """
    cfg = load_toml(ThrusterCfg, asset("thrusters", name))
    voltages = np.array([supply.voltage_v for supply in cfg.supplies])
    if not voltages[0] <= voltage_v <= voltages[-1]:
        raise ConfigError("voltage_v", voltage_v, f"{voltages[0]:g} V to {voltages[-1]:g} V, where {name} was measured")
    upper = min(max(int(np.searchsorted(voltages, voltage_v)), 1), len(voltages) - 1)
    share = (voltage_v - voltages[upper - 1]) / (voltages[upper] - voltages[upper - 1])
    low, high = _nodes(cfg, cfg.supplies[upper - 1]), _nodes(cfg, cfg.supplies[upper])
    command, thrust_n, power_w = (a + share * (b - a) for a, b in zip(low, high, strict=True))
    for values in (command, thrust_n, power_w):
        values.setflags(write=False)
    return ThrusterCurve(command, thrust_n, power_w, float(min(-thrust_n[0], thrust_n[-1])))
