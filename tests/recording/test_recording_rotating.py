"""The rotating beacon in a recording: the beam turns as the clock says, azimuths and the believed place are there."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from recording_reader import Recording
from synthetic_episode import make_result, make_setup, ticks

from auvdock.core.contracts import AzimuthFix, Bearing
from auvdock.core.station import load_conical_station
from auvdock.recording import paths
from auvdock.recording.rerun_recorder import RerunRecorder

COUNT = 60


def flown(path: Path, name: str) -> Recording:
    """An approach of 60 periods, with a fix in every twentieth and a believed place in the first half."""
    setup = dataclasses.replace(make_setup(160, 90), kind=name, station=load_conical_station(name))
    recorder = RerunRecorder(path)
    recorder.on_start(setup)
    believed = {"station_x_m": 9.0, "station_y_m": 2.0, "range_sigma_m": 3.0, "cross_sigma_m": 0.5, "azimuth_rad": 0.2}
    for index, tick in enumerate(ticks(setup, COUNT)):
        if index % 20 == 5 and tick.percept is not None:
            bearing = Bearing(np.array([0.0, 0.0, 1.0]), np.zeros(2), 0.9)
            fix = AzimuthFix(tick.percept.time_s, math.radians(12.0), 0.01, bearing)
            tick = dataclasses.replace(tick, percept=dataclasses.replace(tick.percept, azimuth=fix))
        if index < COUNT // 2:
            tick = dataclasses.replace(tick, command=dataclasses.replace(tick.command, setpoint=believed))
        recorder.on_tick(tick)
    recorder.on_end(make_result())
    recorder.close()
    return Recording(path)


def test_beam_azimuths_and_believed_place_are_recorded(tmp_path: Path) -> None:
    recording = flown(tmp_path / "run.rrd", "rotating")
    beacon = load_conical_station("rotating").rotating
    assert beacon is not None
    beam = recording.column(paths.ROTATING_BEAM, "Transform3D:mat3x3")
    assert len(beam.frames) == COUNT
    for time_s, matrix in zip(beam.times_s, beam.values, strict=True):
        x_axis = np.array(matrix[0])[:2]  # column-major: the first three numbers are the first column
        turned = math.atan2(x_axis[1], x_axis[0])
        assert math.remainder(turned - beacon.azimuth_rad(time_s), math.tau) == pytest.approx(0.0, abs=1e-5)
    fixes = recording.column(paths.AZIMUTH_FIX, "Scalars:scalars")
    assert fixes.frames == [5, 25, 45]
    assert fixes.values[0] == pytest.approx([12.0])
    half = recording.column(paths.BELIEVED, "Ellipsoids3D:half_sizes")
    assert half.frames == list(range(COUNT // 2))
    np.testing.assert_allclose(half.values[0][0][:2], [6.0, 1.0])
    true = recording.column(paths.AZIMUTH_TRUE, "Scalars:scalars")
    assert max(abs(value[0]) for value in true.values) < 30.0  # the synthetic approach stays before the mouth


def test_a_station_without_one_has_none_of_it(tmp_path: Path) -> None:
    recording = flown(tmp_path / "run.rrd", "conical")
    assert not {paths.ROTATING_BEAM, paths.AZIMUTH_TRUE, paths.BELIEVED} & recording.entities
