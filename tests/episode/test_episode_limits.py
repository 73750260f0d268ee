"""Every limit of every setting of the package: what a message promises is taken, the numbers beside it are refused."""

from __future__ import annotations

import dataclasses
import importlib
import math
import pkgutil
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import auvdock
from auvdock.assets import asset, asset_names
from auvdock.campaign.axes import AxisCfg
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.magnitudes import unit_of
from auvdock.core.reader import from_mapping, hints_of
from auvdock.core.strict import load_toml, read_toml
from auvdock.core.vehicle import VehicleCfg
from auvdock.dataset.config import load_dataset_cfg
from auvdock.episode.stations import STATIONS
from auvdock.footage.camera_file import PixelCameraCfg
from auvdock.networks.catalog import ModelCfg, load_model, model_names
from auvdock.networks.schedule import ScheduleCfg
from auvdock.optics.detection_model import DetectionModelCfg
from auvdock.optics.tag_model import TagModelCfg
from auvdock.optics.water import load_water
from auvdock.perception.network_file import NetworkCardCfg, network_names

for found in pkgutil.walk_packages(auvdock.__path__, "auvdock."):
    if not found.name.endswith("__main__"):
        importlib.import_module(found.name)


def offspring(cls: type[Checked]) -> Iterator[type[Checked]]:
    """All classes of settings of the package, without those that tests make."""
    for sub in cls.__subclasses__():
        yield from (each for each in (sub, *offspring(sub)) if each.__module__.startswith("auvdock"))


def within(value: Any) -> Iterator[Checked]:
    """All settings inside a value, itself included."""
    if isinstance(value, Checked):
        yield value
        yield from (part for inner in vars(value).values() for part in within(inner))
    elif isinstance(value, tuple):
        yield from (part for inner in value for part in within(inner))


CLASSES = sorted(
    {cls for cls in offspring(Checked) if "__dataclass_fields__" in vars(cls)},
    key=lambda cls: (cls.__module__, cls.__qualname__),
)
SAMPLES: dict[type, Checked] = {}
for whole in (
    *(kind.level(1) for kind in STATIONS.values()),
    *(load_toml(VehicleCfg, asset("vehicles", name)) for name in asset_names("vehicles")),
    load_toml(DetectionModelCfg, asset("detection", asset_names("detection")[0])),
    load_toml(TagModelCfg, asset("tag_detection", asset_names("tag_detection")[0])),
    load_water("lake"),
    load_dataset_cfg(),
    *(load_model(name) for name in model_names()),
    ModelCfg("yolov8n"),
    PixelCameraCfg(640, 480, (500.0, 500.0), (320.0, 240.0)),
    from_mapping(ScheduleCfg, read_toml(asset("networks/schedules", "default"))["schedule"], "schedule."),
    load_toml(NetworkCardCfg, asset("networks/weights", network_names()[0])),
    AxisCfg("current", (0.1, 0.2)),
):
    SAMPLES.update((type(part), part) for part in within(whole))


def sample(cls: Any) -> Checked:
    """Settings of a class that are taken: shipped ones, else its defaults with 1 where it has none."""
    absent = [f.name for f in dataclasses.fields(cls) if f.default is f.default_factory is dataclasses.MISSING]
    return SAMPLES[cls] if cls in SAMPLES else cls(**dict.fromkeys(absent, 1.0))


def marks(hint: Any) -> Iterator[Any]:
    """The limited numbers and the names in a field's annotation."""
    if get_origin(hint) in (Annotated, Literal):
        yield hint
    else:
        yield from (part for option in get_args(hint) for part in marks(option))


PLACES = [(cls, name, part) for cls in CLASSES for name, hint in hints_of(cls).items() for part in marks(hint)]
LIMITED = [(cls, name, part) for cls, name, part in PLACES if get_origin(part) is Annotated]

_NUMBER = r"(-?[\d.]+(?:e[-+]\d+)?)"
PROMISES: Mapping[str, Any] = {
    rf"more than {_NUMBER}": lambda value, bound: value > bound,
    rf"less than {_NUMBER}": lambda value, bound: value < bound,
    rf"at most {_NUMBER}": lambda value, bound: value <= bound,
    rf"{_NUMBER}(?: 1/\w+|[^\d]*) or more": lambda value, bound: value >= bound,
    rf"{_NUMBER} to {_NUMBER}": lambda value, low, high: low <= value <= high,
}
"""What a message's words mean, read apart from the code that makes them."""


def refusal(cls: type[Checked], name: str, value: Any) -> tuple[str, ConfigError | None]:
    """The path of a number in a field, the first one of a list, and what is said of a value there."""
    now = sample(cls)
    listed = get_origin(hints_of(cls)[name]) is tuple
    filled = (value, *getattr(now, name)[1:]) if listed else value
    try:
        dataclasses.replace(now, **{name: filled})  # type: ignore[type-var]
    except ConfigError as error:
        return f"{name}[0]" if listed else name, error
    return name, None


def promised(remedy: str, value: float) -> bool:
    """Whether a message promises that a value is taken."""
    found = [
        meaning(value, *map(float, match.groups()))
        for words, meaning in PROMISES.items()
        for match in re.finditer(words, remedy.partition(",")[0])
    ]
    assert found, remedy
    return all(found)


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__qualname__)
def test_bounds_are_where_the_annotation_says(cls: type[Checked]):
    for _, name, part in (place for place in LIMITED if place[0] is cls):
        kind, *limits = get_args(part)
        least, greatest = max(limit.least for limit in limits), min(limit.greatest for limit in limits)
        for bound, away in ((least, -math.inf), (greatest, math.inf)):
            if math.isinf(bound):
                continue
            beyond = bound + math.copysign(1, away) if kind is int else math.nextafter(bound, away)
            path, error = refusal(cls, name, kind(beyond))
            assert error is not None
            assert (error.field, error.value) == (path, beyond)
            within_it = 1e-90 if bound == math.ulp(0.0) else bound  # nothing with a unit is as small as that
            _, relation = refusal(cls, name, kind(within_it))
            assert relation is None or relation.remedy != error.remedy


NUMBERS = st.integers(-200_000, 200_000).map(lambda thousandths: thousandths / 1000) | st.integers(-9, 999)


@settings(max_examples=400, derandomize=True, deadline=None, database=None)
@given(place=st.sampled_from(LIMITED), number=NUMBERS)
def test_a_number_is_refused_as_its_message_says(place: Any, number: float):
    cls, name, part = place
    kind, *limits = get_args(part)
    number = kind(number)
    path, error = refusal(cls, name, number)
    unit = unit_of(name, number)
    words = " and ".join(limit.words.format(unit=f" {unit}" if unit else "") for limit in limits)
    if promised(words, number):
        assert error is None or not error.remedy.startswith(words)  # a relation to another setting, or a magnitude
    else:
        assert error is not None
        assert (error.field, error.value) == (path, number)
        assert not promised(error.remedy, number)


@pytest.mark.parametrize(("cls", "name", "part"), [place for place in PLACES if get_origin(place[2]) is Literal])
def test_names_are_those_of_the_annotation(cls: type[Checked], name: str, part: Any):
    for right in get_args(part):
        _, error = refusal(cls, name, right)
        assert error is None or error.field != name
    for wrong in ("", "nonsense", get_args(part)[0].upper(), 1, None):
        _, error = refusal(cls, name, wrong)
        assert error is not None
        assert error.field == name
        assert all(right in error.remedy for right in get_args(part))


def test_there_is_much_to_check():
    assert len(CLASSES) > 75
    assert len(LIMITED) > 350


def test_whoever_reads_settings_reads_checked_ones():
    """A frozen dataclass that is called a configuration, or stands in one, checks its annotations."""
    for cls in CLASSES:
        for hint in hints_of(cls).values():
            parts = [hint, *get_args(hint)]
            assert all(part in CLASSES for part in parts if isinstance(part, type) and dataclasses.is_dataclass(part))
    names = {cls.__qualname__ for cls in CLASSES}
    for found in pkgutil.walk_packages(auvdock.__path__, "auvdock."):
        spec = found.module_finder.find_spec(found.name, None)  # type: ignore[call-arg]
        assert spec is not None
        assert spec.origin is not None
        assert names >= set(re.findall(r"^class (\w+Cfg)\b", Path(spec.origin).read_text(encoding="utf-8"), re.M))


def test_a_class_with_other_defaults_keeps_the_limits():
    for cls in CLASSES:
        for base in cls.__bases__:
            for name, hint in hints_of(base).items() if base in CLASSES else ():
                own = hints_of(cls)[name]
                assert own == hint or issubclass(own, hint)
