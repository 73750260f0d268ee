"""Configuration of a campaign, and its strict TOML file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Annotated, Any, Literal

from auvdock.campaign.axes import TURBIDITY_AXES, WATER_AXES, AxisCfg, AxisValue, axis_kind, joined
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.limits import Positive, at_least, below, between
from auvdock.core.strict import from_mapping
from auvdock.episode.config import LEVELS, AnyEpisodeCfg
from auvdock.episode.stations import STATIONS

__all__ = ["CampaignCfg", "campaign_from_plain"]

_MOST_EPISODES = 1_000_000
"""Of which a second each take a core eleven days; their seeds differ (`plan`)."""
_MOST_CORNERED = 6
_LEAST_LIMIT_S, _TIMES_SIMULATED = 600.0, 5.0


@dataclass(frozen=True)
class CampaignCfg(Checked):
    """Many episodes of one task: what stays, what varies, how many, and from which seed."""

    name: str = "campaign"
    """Title of the report."""
    station: str = "conical"
    """Docking station."""
    level: int = 1
    """Difficulty level that all episodes start from, unless an axis named "level" varies it."""
    episodes: Annotated[int, between(1, _MOST_EPISODES)] = 100
    """Episodes; with `until_ci` the most that are run."""
    seed: Annotated[int, at_least(0)] = 0
    """Decides every episode's seed and every draw."""
    sampling: Literal["random", "latin_hypercube", "sobol"] = "random"
    """How drawn axes are sampled: "random", "latin_hypercube" or "sobol"."""
    until_ci: Annotated[float, at_least(0.0), below(0.5)] = 0.0
    """Stop once the success rate's 95 % interval is no wider than plus or minus this; 0 runs all episodes."""
    until_ci_per_cell: bool = False
    """With `until_ci`: every cell of the grid goes on until its own interval is narrow enough."""
    episode_limit_s: Positive | None = None
    """Wall-clock limit of one episode; past it the episode counts as `hung`. None: see `wall_limit_s`."""
    axes: tuple[AxisCfg, ...] = ()
    """What varies. Grid axes are crossed with each other; drawn axes are drawn anew for each episode."""
    episode: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Changes of the level's settings that all episodes share, nested as in an episode's TOML file."""
    waters: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Waters of one's own by the names that an axis gives them, each with the content of its file."""

    def __post_init__(self) -> None:
        """Refuse what cannot be run, before anything is run."""
        if self.station not in STATIONS:
            raise ConfigError("station", self.station, f"one of {', '.join(STATIONS)}")
        if self.until_ci_per_cell and not self.until_ci:
            raise ConfigError("until_ci_per_cell", True, "until_ci beside it, the width that each cell is to reach")
        names = [axis.name for axis in self.axes]
        if len(set(names)) != len(names):
            raise ConfigError("axes", names, "each axis once")
        if any(name in WATER_AXES for name in names) and any(name in TURBIDITY_AXES for name in names):
            raise ConfigError("axes", names, "either a water or a turbidity, which is a water of its own")
        for axis in self.axes:
            unknown = [value for value in self._ends(axis) if value not in LEVELS] if axis.name == "level" else []
            if unknown:
                raise ConfigError("level", unknown[0], f"one of {', '.join(map(str, LEVELS))}")
        base = self.base(self.level)
        for point in self.points():
            base.override(self.changes_at(point))

    @property
    def wall_limit_s(self) -> float:
        """`episode_limit_s`, or else five times what an episode may take in simulated time, and 600 s at least.

        Rendered episodes run faster than real time on a machine that is not crowded; five leaves room for one that is.
        """
        if self.episode_limit_s is not None:
            return self.episode_limit_s
        return max(_LEAST_LIMIT_S, _TIMES_SIMULATED * self.base(self.level).world.limits.max_time_s)

    def points(self) -> Iterable[tuple[AxisValue, ...]]:
        """Places on the axes that have to be possible: every value once, and the corners where they are not too many.

        Of an axis that is drawn these are its ends.
        """
        ends = [self._ends(axis) for axis in self.axes]
        first = tuple(values[0] for values in ends)
        points = [first]
        points += [(*first[:place], value, *first[place + 1 :]) for place, them in enumerate(ends) for value in them]
        if 1 < len(ends) <= _MOST_CORNERED:
            points += product(*((values[0], values[-1]) for values in ends))
        return dict.fromkeys(points)

    def _ends(self, axis: AxisCfg) -> Sequence[AxisValue]:
        return axis.grid or tuple(axis.drawn(end, self.kind(axis)) for end in (0.0, 1.0))

    def base(self, level: int) -> AnyEpisodeCfg:
        """What all episodes of a level share.

        Raises:
            ConfigError: no such level, or changes that do not fit.
        """
        plain = STATIONS[self.station].level(level)
        with located("episode."):
            return plain.override(self.episode)

    def kind(self, axis: AxisCfg) -> type[AxisValue]:
        """The type of an axis' values in configurations and rows.

        Raises:
            ConfigError: no such setting.
        """
        return axis_kind(type(STATIONS[self.station].level(self.level)), axis.name)

    def changes(self, axis: AxisCfg, value: AxisValue) -> dict[str, Any]:
        """The nested change of an episode's configuration that a value of an axis stands for.

        Raises:
            ConfigError: a value that is not of the setting's type.
        """
        if axis.name in WATER_AXES and value in self.waters:
            return {"world": {"water": self.waters[str(value)]}}
        return axis.changes(axis.typed(value, self.kind(axis)))

    def changes_at(self, point: Sequence[AxisValue]) -> dict[str, Any]:
        """What a value of each axis changes together: some fit only beside one another.

        Raises:
            ConfigError: a value that is not of its setting's type.
        """
        return joined(self.changes(axis, value) for axis, value in zip(self.axes, point, strict=True))


def campaign_from_plain(data: Mapping[str, Any]) -> CampaignCfg:
    """The campaign that a manifest holds; the inverse of `auvdock.core.strict.to_plain`."""
    axes = [{key: value for key, value in axis.items() if value is not None} for axis in data.get("axes", ())]
    return from_mapping(CampaignCfg, {**data, "axes": axes})
