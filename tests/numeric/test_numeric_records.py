"""Records: what is written by name is read by name, in compiled code and outside."""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest

from auvdock.numeric.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records


@dataclass(frozen=True)
class Lens(Record):
    focal_px: float
    skewed: bool


@dataclass
class Lamp(Record):
    place_m: Annotated[Array, 3]
    gain: Annotated[Array, 2, 3]
    pixel: Annotated[IntArray, 2]
    count: int
    lens: Lens


@dataclass(frozen=True)
class Shapeless(Record):
    place_m: Array


@compiled
def _brighten(lamps: Records[Lamp], factor: float) -> float:
    total = 0.0
    for i in range(len(lamps)):
        total += _focal_px(lamps[i])
        lamps[i].gain[1, 2] *= factor
        lamps[i].count += 1
    return total


@compiled
def _focal_px(lamp: Lamp) -> float:
    return lamp.lens.focal_px if lamp.lens.skewed else 0.0


def _lamp(number: int) -> Lamp:
    gain = np.arange(6.0).reshape(2, 3) + number
    return Lamp(np.full(3, float(number)), gain, np.array([number, -number]), number, Lens(10.0 * number, number > 1))


def _same(first: Lamp, second: Lamp) -> bool:
    numbers = (first.count, first.lens) == (second.count, second.lens)
    arrays = zip((first.place_m, first.gain, first.pixel), (second.place_m, second.gain, second.pixel), strict=True)
    return numbers and all(np.array_equal(a, b) and a.dtype == b.dtype for a, b in arrays)


def test_rows_are_read_as_they_were_written() -> None:
    lamps = Lamp.table(_lamp(number) for number in range(3))
    assert len(lamps) == 3
    assert all(_same(Lamp.read(lamps, number), _lamp(number)) for number in range(3))
    assert type(Lamp.read(lamps, 1).count) is int
    assert _same(Lamp.read(_lamp(2).packed()), _lamp(2))


def test_compiled_code_reads_and_writes_rows_by_name() -> None:
    lamps = Lamp.table(_lamp(number) for number in range(1, 4))
    assert _brighten(lamps, 2.0) == 20.0 + 30.0
    assert [Lamp.read(lamps, row).gain[1, 2] for row in range(3)] == [12.0, 14.0, 16.0]
    assert [Lamp.read(lamps, row).count for row in range(3)] == [2, 3, 4]
    assert np.all(Lamp.read(lamps, 0).gain[0] == _lamp(1).gain[0])


def test_arrays_that_were_read_are_views_and_copies_are_not() -> None:
    lamps = Lamp.table([_lamp(1)])
    copied = pickle.loads(pickle.dumps(copy.deepcopy(lamps)))
    Lamp.read(lamps).place_m[1] = 7.0
    assert Lamp.read(lamps).place_m[1] == 7.0
    assert _same(Lamp.read(copied), _lamp(1))


def test_shapes_are_kept() -> None:
    wrong = Lamp(np.zeros(1), np.zeros((2, 3)), np.zeros(2, dtype=np.int64), 0, Lens(1.0, False))
    with pytest.raises(ValueError, match=r"place_m.*\(1,\).*\(3,\)"):
        Lamp.table([wrong])
    with pytest.raises(TypeError, match=r"Shapeless\.place_m.*no fixed shape"):
        Shapeless.zeros()
