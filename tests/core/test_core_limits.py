"""Limits of settings: what an annotation says is what is refused, in Python and in files, in words that are true."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, Limit, NotNegative, Positive, above, at_least, at_most, below, between
from auvdock.core.strict import from_mapping, merge, recheck

MEANINGS: Mapping[Callable[..., Limit], Callable[[float, float], bool]] = {
    above: operator.gt,
    at_least: operator.ge,
    below: operator.lt,
    at_most: operator.le,
}
NUMBERS = st.floats(-1e6, 1e6) | st.integers(-1000, 1000) | st.just(0.0)


@pytest.mark.parametrize("make", MEANINGS)
@settings(max_examples=100, derandomize=True, deadline=None, database=None)
@given(bound=NUMBERS, value=NUMBERS)
def test_a_limit_is_the_comparison_that_it_is_named_for(make: Callable[..., Limit], bound: float, value: float):
    limit = make(bound)
    for number in (value, bound, math.nextafter(bound, math.inf), math.nextafter(bound, -math.inf)):
        assert limit.admits(number) == MEANINGS[make](number, bound)
    assert not limit.admits(math.nan)


@settings(max_examples=100, derandomize=True, deadline=None, database=None)
@given(low=NUMBERS, high=NUMBERS, value=NUMBERS)
def test_between_is_both_ends_included(low: float, high: float, value: float):
    for number in (low, high, value):
        assert between(low, high).admits(number) == (low <= number <= high)


@dataclass(frozen=True)
class Tank(Checked):
    depth_m: Annotated[float, above(0.0), at_most(12.5)] = 1.0
    windows: Count = 4
    kind: Literal["round", "square"] = "round"
    size_m: tuple[Positive, Positive] = (2.0, 2.0)
    leak_m: NotNegative | None = None
    level: float = 0.5

    def __post_init__(self) -> None:
        if self.level > self.depth_m:
            raise ConfigError("level", self.level, "at most depth_m")


@dataclass(frozen=True)
class Hall(Checked):
    tank: Tank = Tank()
    tanks: tuple[Tank, ...] = ()


REFUSED = [
    ("depth_m", 0.0, "depth_m", "more than 0 m and at most 12.5 m"),
    ("depth_m", math.nan, "depth_m", "a finite number"),
    ("depth_m", "deep", "depth_m", "a finite number"),
    ("windows", 0, "windows", "1 or more"),
    ("windows", 2.5, "windows", "a whole number"),
    ("kind", "oval", "kind", "one of round, square"),
    ("size_m", (2.0, -1.0), "size_m[1]", "more than 0 m"),
    ("size_m", (2.0,), "size_m", "a list of 2"),
    ("leak_m", -1.0, "leak_m", "0 m or more"),
    ("level", math.inf, "level", "a finite number"),
    ("level", 2.0, "level", "at most depth_m"),
]


@pytest.mark.parametrize(("name", "value", "field", "remedy"), REFUSED)
def test_each_is_refused_by_its_path_however_it_is_made(name: str, value: object, field: str, remedy: str):
    unchecked = object.__new__(Tank)
    for known, right in vars(Tank()).items():
        object.__setattr__(unchecked, known, right)
    object.__setattr__(unchecked, name, value)
    makers: list[tuple[str, Callable[[], object]]] = [
        ("", lambda: Tank(**{name: value})),  # type: ignore[arg-type]
        ("", lambda: replace(Tank(), **{name: value})),
        ("", lambda: from_mapping(Tank, {name: value})),
        ("tank.", lambda: from_mapping(Hall, {"tank": {name: value}})),
        ("tank.", lambda: merge(Hall(), {"tank": {name: value}})),
        ("tanks[1].", lambda: merge(Hall(), {"tanks": [{}, {name: value}]})),
        ("hall.tank.", lambda: recheck(replace(Hall(), tank=unchecked), "hall.")),
    ]
    for prefix, make in makers:
        with pytest.raises(ConfigError) as caught:
            make()
        assert caught.value.field == f"{prefix}{field}"
        assert remedy in caught.value.remedy


def test_what_is_allowed_is_made():
    tank = Tank(12.5, 1, "square", (0.1, 9.0), 0.0, 12.5)
    assert from_mapping(Hall, {"tank": vars(tank)}) == Hall(tank)
    assert Tank(leak_m=None, level=-3.0).leak_m is None
    read = Hall({"depth_m": np.float32(2.5), "windows": np.int64(3)}, [Tank(size_m=[3, 4])])  # type: ignore[arg-type]
    assert repr(read) == repr(Hall(Tank(2.5, 3), (Tank(size_m=(3.0, 4.0)),)))


def test_a_reason_is_told_and_a_number_without_unit_has_none():
    @dataclass(frozen=True)
    class Lights(Checked):
        lights: Annotated[int, at_least(4, "PnP needs 4")] = 4
        share: Annotated[float, at_least(0.0), below(1.0)] = 0.0

    with pytest.raises(ConfigError, match=re.escape("lights: 3 cannot be used; give 4 or more, PnP needs 4")):
        Lights(lights=3)
    with pytest.raises(ConfigError, match=re.escape("share: 1.0 cannot be used; give 0 or more and less than 1")):
        Lights(share=1.0)
