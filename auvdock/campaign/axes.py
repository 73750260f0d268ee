"""What a campaign varies: an axis is one quantity with a grid of values or a distribution."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from scipy.special import ndtri

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import between
from auvdock.core.strict import bare_type, setting_type
from auvdock.episode.config import AnyEpisodeCfg

__all__ = [
    "ALIASES",
    "KIND_WORDS",
    "TURBIDITY_AXES",
    "WATER_AXES",
    "AxisCfg",
    "AxisValue",
    "Distribution",
    "axis_kind",
    "joined",
    "nested",
]

AxisValue = float | int | str | bool
"""What an axis can set."""

ALIASES: Mapping[str, tuple[str, ...]] = {
    "level": ("level",),
    "current": ("world.sim.current.speed_m_s",),
    "current_direction": ("world.sim.current.direction_deg",),
    "gust": ("world.sim.current.gust_std_m_s",),
    "shear": ("world.sim.current.shear_per_m",),
    "attenuation": ("world.attenuation_per_m",),
    "turbidity": ("world.turbidity_per_m",),
    "water": ("world.water",),
    "flicker": ("world.nuisance.flicker",),
    "marine_snow": ("world.nuisance.marine_snow",),
    "interfering_lights": ("world.nuisance.interfering_lights",),
    "surface_reflection": ("world.nuisance.surface_reflection",),
    "daylight": ("world.nuisance.daylight",),
    "start_range": ("world.start.min_range_m", "world.start.max_range_m"),
    "start_lateral": ("world.start.lateral_m",),
    "start_vertical": ("world.start.vertical_m",),
    "start_heading": ("world.start.heading_deg",),
    "detector": ("perception.detector",),
    "association": ("perception.association",),
    "controller": ("control.controller",),
    "fidelity": ("world.fidelity",),
}
"""Short names of axes and the episode's settings that each sets; any other dotted setting is its own name."""

WATER_AXES = ("water", "world.water")
"""Names of the axis that varies the water, whose values may be files."""

TURBIDITY_AXES = ("turbidity", "world.turbidity_per_m")
"""Names of the axis along Petzold's waters, each of which is a water of its own."""

Distribution = Literal["uniform", "log_uniform", "normal"]
"""`normal` has 95 % of its mass between low and high and is cut off there."""

KIND_WORDS: Mapping[type[AxisValue], str] = {
    float: "finite numbers",
    int: "whole numbers",
    bool: "true or false",
    str: "text",
}
_TAIL = 0.025
_MOST_VALUES = 1000
"""Of a grid; each is tried before a campaign begins."""


@dataclass(frozen=True)
class AxisCfg(Checked):
    """One varied quantity.

    With `values`, or with `low`, `high` and `count`, it is a grid axis; with `low` and `high` alone each episode draws
    from the distribution.
    """

    name: str
    """Short name (`ALIASES`) or dotted setting of the episode; the rows' column bears it too."""
    values: tuple[float | int | str | bool, ...] = ()
    """Grid values, in order."""
    low: float | None = None
    """Least value."""
    high: float | None = None
    """Greatest value."""
    count: Annotated[int, between(0, _MOST_VALUES)] = 0
    """Grid values between low and high, both included; 0 draws from the distribution."""
    distribution: Distribution = "uniform"
    """"uniform", "log_uniform" or "normal"."""

    def __post_init__(self) -> None:
        """Refuse axes without values or with two meanings."""
        if self.values:
            if self.low is not None or self.high is not None or self.count:
                raise ConfigError("values", self.values, "either values or low and high")
            kinds = {_kind(value) for value in self.values}
            if len(kinds) != 1 or len(set(self.values)) != len(self.values):
                raise ConfigError("values", self.values, "different values of one kind")
            return
        if self.low is None or self.high is None:
            raise ConfigError("values", (), f"values for the axis {self.name!r}, or low and high in their place")
        if not self.low < self.high:
            raise ConfigError("low", self.low, f"finite numbers with low below high, which is {self.high}")
        if self.count == 1:
            raise ConfigError("count", self.count, "2 or more grid values, or 0 to draw from a distribution")
        if self.distribution == "log_uniform" and self.low <= 0.0:
            raise ConfigError("low", self.low, "a number above 0 for log_uniform")

    @property
    def is_grid(self) -> bool:
        """A grid axis, not a drawn one."""
        return bool(self.values) or self.count > 0

    @property
    def grid(self) -> tuple[AxisValue, ...]:
        """The grid's values; empty if the axis is drawn."""
        if self.values:
            return self.values
        if not self.count or self.low is None or self.high is None:
            return ()
        # Twelve decimals: 0.1 rather than 0.1 + 1e-17, so that values read well and compare equal.
        step = 1.0 / (self.count - 1)
        return tuple(round(self.quantile(index * step, "uniform"), 12) for index in range(self.count))

    def quantile(self, probability: float, distribution: str | None = None) -> float:
        """Value of a drawn axis at a cumulative probability."""
        if self.low is None or self.high is None:
            raise ValueError(f"axis {self.name} is a list of values")
        shape = distribution or self.distribution
        if shape == "log_uniform":
            return math.exp(math.log(self.low) + probability * (math.log(self.high) - math.log(self.low)))
        if shape == "normal":
            middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
            return middle + half * float(ndtri(_TAIL + probability * (1.0 - 2.0 * _TAIL)) / ndtri(1.0 - _TAIL))
        return self.low + probability * (self.high - self.low)

    def drawn(self, probability: float, kind: type[AxisValue]) -> AxisValue:
        """Value of a drawn axis at a cumulative probability, of the type `kind`.

        Whole numbers are drawn with a half to either side and rounded: each of a uniform axis is as likely as another.
        """
        if kind is not int or self.low is None or self.high is None:
            return self.typed(self.quantile(probability), kind)
        low, high = (int(self.typed(end, int)) for end in (self.low, self.high))
        wide = replace(self, low=self.low - 0.5, high=self.high + 0.5)
        return min(max(round(wide.quantile(probability)), low), high)

    def typed(self, value: AxisValue, kind: type[AxisValue]) -> AxisValue:
        """`value` as the setting has it: 4 and 4.0 are the same on an axis, but not in a configuration.

        Raises:
            ConfigError: a value that the type `kind` does not hold.
        """
        if type(value) is kind:
            return value
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
        if kind is float and math.isfinite(number):
            return number
        if kind is int and number.is_integer():
            return int(number)
        raise ConfigError(self.name, value, f"{KIND_WORDS[kind]}, as this setting is")

    def changes(self, value: AxisValue) -> dict[str, Any]:
        """The nested change of an episode's configuration that `value` stands for; nothing for `level`."""
        result: dict[str, Any] = {}
        if self.name == "level":
            return result
        for field in ALIASES.get(self.name, (self.name,)):
            result = _join(result, nested(field, value))
        if self.name == "current_direction":
            result["world"].setdefault("start", {})["random_current_direction"] = False
        return result


def joined(changes: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Several nested changes as one; of two for the same setting the later."""
    result: dict[str, Any] = {}
    for change in changes:
        result = _join(result, change)
    return result


def nested(field: str, value: object) -> dict[str, Any]:
    """`a.b.c` and a value as nested mappings."""
    *parents, last = field.split(".")
    result: dict[str, Any] = {last: value}
    for name in reversed(parents):
        result = {name: result}
    return result


def axis_kind(episode: type[AnyEpisodeCfg], name: str) -> type[AxisValue]:
    """The type of the values of an axis: that of the setting that it varies.

    Args:
        episode: configuration of the station's episodes.
        name: short name or dotted setting.

    Raises:
        ConfigError: no such setting, or one that is a table or a list.
    """
    if name == "level":
        return int
    if "." not in name and name not in ALIASES:
        near = get_close_matches(name, ALIASES, n=1)
        known = f"the axis {near[0]!r}" if near else f"one of {', '.join(ALIASES)}"
        raise ConfigError(name, name, f"{known}, or a dotted setting such as world.start.heading_deg")
    hint = setting_type(episode, ALIASES.get(name, (name,))[0])
    options = [bare_type(option) for option in get_args(hint)] if get_origin(hint) in (Union, UnionType) else [hint]
    for kind in KIND_WORDS:
        if kind in options:
            return kind
    raise ConfigError(name, name, "a setting that is one number, one text or one truth value")


def _kind(value: AxisValue) -> type[AxisValue]:
    return float if isinstance(value, int) and not isinstance(value, bool) else type(value)


def _join(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Deep union of two nested mappings."""
    union = dict(one)
    for key, value in other.items():
        both = isinstance(value, dict) and isinstance(union.get(key), dict)
        union[key] = _join(union[key], value) if both else value
    return union
