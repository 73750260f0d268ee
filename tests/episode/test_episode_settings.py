"""Every setting of every station's episodes: taken as its type says, or refused under a path that a user can set."""

from __future__ import annotations

import ast
import dataclasses
import datetime
import importlib
import math
import pkgutil
import re
import types
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import auvdock
from auvdock.campaign.axes import nested
from auvdock.campaign.config import CampaignCfg, campaign_from_plain
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.reader import bare_type, hints_of
from auvdock.core.strict import from_mapping, setting_type, to_plain
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.episode.stations import STATIONS

BASES: Mapping[str, AnyEpisodeCfg] = {station: kind.level(1) for station, kind in STATIONS.items()}


def tables(cls: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Path and type of every field of nested dataclasses, of the first in a list and of tables that may be absent."""
    assert issubclass(cls, Checked)
    for name, hint in hints_of(cls).items():
        yield f"{prefix}{name}", hint
        first = "[0]" if get_origin(hint) is tuple else ""
        for option in get_args(hint) or (hint,):
            if isinstance(option, type) and dataclasses.is_dataclass(option):
                yield from tables(option, f"{prefix}{name}{first}.")


PATHS = {station: dict(tables(type(cfg))) for station, cfg in BASES.items()}
PLACES = [(station, path) for station, paths in PATHS.items() for path in paths]
LIGHT = to_plain(BASES["conical"].world.station.beacons[0]) | {"name": "another"}
WATER = {"name": "x", "source": "y", "absorption_per_m": [0.1, 0.1, 0.3], "scattering_per_m": [0.1, 0.1, 0.1]}


def value_at(cfg: Any, path: str) -> Any:
    """The value at a path; None in a table that is absent, or in an empty list."""
    for name, first in re.findall(r"(\w+)(\[0\])?", path):
        cfg = getattr(cfg, name, None)
        if first:
            cfg = cfg[0] if cfg else None
    return cfg


def change(cfg: AnyEpisodeCfg, path: str, value: Any) -> dict[str, Any]:
    """The nested change that puts a value at a path; of a list it gives all items, with the first one changed."""
    outer, inside, inner = path.partition("[0].")
    if not inside:
        return nested(path, value)
    items: list[Any] = to_plain(value_at(cfg, outer)) or [LIGHT]
    return nested(outer, [{**items[0], inner: value}, *items[1:]])


def fits(hint: Any, value: Any) -> bool:
    """Whether a value is exactly of the type, and within the limits, that an annotation states."""
    options = get_args(hint)
    if get_origin(hint) is Annotated:
        return fits(options[0], value) and all(limit.admits(value) for limit in options[1:])
    if get_origin(hint) is Literal:
        return type(value) is str and value in options
    if get_origin(hint) in (typing.Union, types.UnionType):
        return any(fits(option, value) for option in options)
    if get_origin(hint) is tuple:
        wanted = options[:1] * len(value) if options[-1] is Ellipsis else options
        return type(value) is tuple and len(value) == len(wanted) and all(map(fits, wanted, value))
    if dataclasses.is_dataclass(hint):
        return type(value) is hint and all(fits(h, getattr(value, name)) for name, h in hints_of(hint).items())
    return type(value) is hint and (hint is not float or math.isfinite(value))


def can_be_set(cfg: AnyEpisodeCfg, field: str) -> bool:
    """Whether an override at this path gets there: it is then refused, for what is given here, under the same path."""
    place = field if re.search(r"\[0\]\.", field) else re.sub(r"\[\d+\].*", "", field)
    setting_type(type(cfg), re.sub(r"\[\d+\]", "", place))
    with pytest.raises(ConfigError) as caught:
        cfg.override(change(cfg, place, datetime.date(2000, 1, 1)))
    return caught.value.field == place


def refusal(cfg: AnyEpisodeCfg, path: str, value: Any) -> ConfigError | None:
    """The error of an override, or None when it was taken; what was taken is as its type says and survives a file."""
    try:
        changed = cfg.override(change(cfg, path, value))
    except ConfigError as error:
        return error
    assert fits(PATHS_OF[type(cfg)][path], value_at(changed, path))
    table = value_at(changed, path.partition("[")[0].rpartition(".")[0]) if "." in path else changed
    assert from_mapping(type(table), to_plain(table)) == table
    return None


PATHS_OF = {type(cfg): PATHS[station] for station, cfg in BASES.items()}
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-320, 1e308, 2**63, -(2**63), 10**400]),
    st.just(6000).map(lambda digits: 16**digits),  # more digits than Python writes
    st.integers(),
    st.floats(allow_nan=True),
    st.text(max_size=8),
    st.sampled_from([datetime.date(2020, 2, 2), datetime.time(1, 2), datetime.datetime(2020, 2, 2, 1, 2)]),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@st.composite
def strange(draw: st.DrawFn, current: Any) -> Any:
    """Any TOML value, or one that is nearly right: the current one with something in it replaced, wrapped or lost."""
    if draw(st.booleans()):
        return draw(VALUES)
    if isinstance(current, dict) and current and draw(st.booleans()):
        key = draw(st.sampled_from(sorted(current)))
        return {**current, key: draw(strange(current[key]))}
    if isinstance(current, list) and current and draw(st.booleans()):
        place = draw(st.integers(0, len(current) - 1))
        return draw(
            st.sampled_from([current[:place], current * 2, [*current[:place], draw(VALUES), *current[place + 1 :]]])
        )
    return draw(st.sampled_from([current, [current], {"a": current}, str(current), [[current]], (current,)]))


@settings(max_examples=250, derandomize=True, deadline=None, database=None)
@given(data=st.data())
def test_any_value_anywhere_is_taken_as_it_should_be_or_refused_by_its_path(data: st.DataObject):
    station, path = data.draw(st.sampled_from(PLACES))
    cfg = BASES[station]
    value = data.draw(strange(to_plain(value_at(cfg, path))))
    error = refusal(cfg, path, value)
    if error is not None:
        assert len(str(error).splitlines()) == 1
        inside = error.field == path or error.field.startswith((f"{path}.", f"{path}["))
        assert inside or can_be_set(cfg, error.field)  # a relation may name its other part


@pytest.mark.parametrize(
    "data",
    [
        {"axes": 5},
        {"axes": [5]},
        {"axes": {"name": "current"}},
        {"axes": [{"name": "current", "values": "0.1"}]},
        {"axes": [{"name": "current", "values": [math.nan]}]},
        {"axes": [{"name": "current", "values": [[0.1]]}]},
        {"axes": [{"name": "current", "values": [datetime.date(2000, 1, 1)]}]},
        {"axes": [{"name": "current", "low": 0, "high": math.inf}]},
        {"axes": [{"name": "world.station", "values": ["x"]}]},
        {"axes": [{"name": "control.search.amplitudes_rad", "values": [1.0]}]},
        {"episodes": True},
        {"episodes": 2.5},
        {"episode": "world"},
        {"episode": {"world": 5}},
        {"episode": {"world": {"start": {"lateral_m": datetime.date(2000, 1, 1)}}}},
        {"episode": {"world": {"water": {"name": "x"}}}},
        {"waters": 5},
        {"seed": 2**64},
    ],
    ids=repr,
)
def test_a_campaign_is_read_as_strictly(data: dict[str, Any]):
    with pytest.raises(ConfigError) as caught:
        campaign_from_plain(data) if "axes" not in data else from_mapping(CampaignCfg, data)
    first = next(iter(data))
    assert caught.value.field.startswith((first, "world.", "control.", "current"))


REFUSED = (-1, 0, 0.0, 1e9, -1e9, 1e-310, math.nan, True, "nonsense", [], [-1.0, 0.0, 0.0])
"""What some check or other refuses, in the right type for some setting, and what none takes."""


@pytest.mark.parametrize("station", ["rotating", "landing"])
def test_each_check_names_the_setting_that_it_refuses(station: str):
    cfg = BASES[station]
    refused: dict[str, str] = {}
    for path in PATHS[station]:
        for value in REFUSED:
            error = refusal(cfg, path, value)
            if error is None:
                continue
            refused.setdefault(error.field, path)
            # A check of one setting names it; one that relates two may name the other, with the value which that has.
            same = error.field == path or error.field.startswith(f"{path}[")
            assert same or to_plain(error.value) == to_plain(value_at(cfg, error.field)), (path, value, str(error))
    for field in refused:
        assert can_be_set(cfg, field), field
    leaves = [path for path, hint in PATHS[station].items() if bare_type(hint) in (int, float, str)]
    assert len([path for path in leaves if path in refused]) > 0.8 * len(leaves)


def with_numbers(hint: Any) -> bool:
    """Whether a setting is a number, may be one, or is a list of numbers."""
    return hint in (int, float) or any(map(with_numbers, get_args(hint)))


@pytest.mark.parametrize("huge", [1e20, -1e308, 10**20], ids=repr)
@pytest.mark.parametrize("station", STATIONS)
def test_no_number_is_beyond_physics(station: str, huge: float):
    cfg, tried = BASES[station], 0
    for path, hint in PATHS[station].items():
        if with_numbers(hint) and not dataclasses.is_dataclass(hint):
            size = len(value_at(cfg, path) or (0,) * 3) if "tuple" in str(hint) else 0
            error = refusal(cfg, path, [huge] * size if size else huge)
            assert error is not None, path
            assert error.field.startswith(path)
            tried += 1
    assert tried > 100


@pytest.mark.parametrize("station", ["conical", "landing"])
def test_names_that_do_not_exist_are_refused_where_the_world_is_made(station: str):
    from auvdock.episode.runner import EpisodeRunner

    cfg = BASES[station].override({"world": {"fidelity": "beacons"}})
    paths = ["world.sim.vehicle", "world.water", "perception.detector", "control.controller"]
    paths += ["perception.tag_detector"] if station == "landing" else []
    for path in paths:
        with pytest.raises(ConfigError) as caught:
            EpisodeRunner(cfg.override(nested(path, "nonsense")))
        assert caught.value.field == path
    others = {"world.attenuation_per_m": 1e-9}
    if station == "landing":
        others |= {"world.faults.dead_lights": ["nonsense"], "control.autopilot.design.heading_crossover_rad_s": 9.9}
    else:
        others |= {"world.station.array_power_w": -1.0, "world.camera.vertical_fov_deg": 120.0}
    for path, value in others.items():
        with pytest.raises(ConfigError) as caught:
            EpisodeRunner(cfg.override(nested(path, value)))
        assert caught.value.field == path


def checks() -> Iterator[tuple[str, ast.Call, type]]:
    """Every `ConfigError(...)` in a dataclass' `__post_init__`, with that dataclass."""
    for found in pkgutil.walk_packages(auvdock.__path__, "auvdock."):
        spec = found.module_finder.find_spec(found.name, None)  # type: ignore[call-arg]
        source = Path(spec.origin).read_text(encoding="utf-8") if spec and spec.origin else ""
        if "__post_init__" not in source:
            continue
        for cls in (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ClassDef)):
            posts = [f for f in cls.body if isinstance(f, ast.FunctionDef) and f.name == "__post_init__"]
            for call in (node for post in posts for node in ast.walk(post)):
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "ConfigError":
                    yield f"{found.name}:{call.lineno}", call, getattr(importlib.import_module(found.name), cls.name)


def test_a_dataclass_names_its_own_fields_and_leaves_the_way_there_to_who_knows_it():
    found = 0
    for place, call, cls in checks():
        field = call.args[0]
        found += 1
        if isinstance(field, ast.Constant):
            setting_type(cls, str(field.value))  # refuses what the class does not have
        elif isinstance(field, ast.JoinedStr):
            written = "".join(str(part.value) if isinstance(part, ast.Constant) else "*" for part in field.values)
            if "[*]" in written:
                setting_type(cls, written.replace("[*]", ""))
            else:
                assert "." not in written, f"{place}: {ast.unparse(field)} is no field of {cls.__name__}"
        else:
            assert isinstance(field, ast.Name), place
    assert found > 40


def test_a_lake_of_one_s_own_may_be_given_as_a_table():
    cfg = BASES["conical"].override({"world": {"water": WATER}})
    harbour = {"phase_function": "petzold-harbour", "backscatter_ratio": 0.019}
    assert to_plain(cfg.override({"world": {"water": harbour}}).world.water).items() >= harbour.items()
    with pytest.raises(ConfigError) as caught:
        cfg.override({"world": {"water": {"backscatter_ratio": 0.9}}})
    assert caught.value.field == "world.water.backscatter_ratio"
    assert cfg.override({"world": {"water": "pool"}}).world.water == "pool"
