"""Whole episodes by the rotating beacon in the `beacons` fidelity: docking, its metrics, and no truth that leaks."""

import dataclasses
import math

import pytest

from auvdock.controllers.pilot import ConicalPilot
from auvdock.controllers.rotating.pilot import RotatingPilot
from auvdock.core.errors import ConfigError
from auvdock.core.station import load_conical_station
from auvdock.core.strict import to_plain
from auvdock.episode.config import LEVELS, level_cfg
from auvdock.episode.result import FAILURE_REASONS
from auvdock.episode.runner import EpisodeRunner


def beacons(**world):
    return level_cfg(1, "rotating").override({"world": {"fidelity": "beacons", **world}})


def test_an_episode_from_the_side_docks_and_tells_how_it_was_led():
    start = {"min_range_m": 20.0, "max_range_m": 20.0, "heading_deg": 10.0}
    result = EpisodeRunner(beacons(start=start)).run(1008)
    assert result.success, result.failure_reason
    assert result.start_azimuth_rad is not None
    assert 1.0 < abs(result.start_azimuth_rad) < 1.5  # beyond the array's beams
    assert result.start_range_m == pytest.approx(20.0, abs=1.5)  # camera about the beacon, hull about the mouth
    assert result.acquire_s is not None
    assert result.first_pose_s is not None
    assert 3.0 < result.acquire_s < result.first_pose_s < result.time_s
    assert result.azimuth_fixes is not None
    assert result.azimuth_fixes >= 2
    assert result.azimuth_rms_rad is not None
    assert result.azimuth_rms_rad > 0.0
    assert result.handover_azimuth_error_rad is not None
    # It goes around by 49° without looking, at a range that it knows to 2 m of 17 m: 6° of standard deviation.
    assert abs(result.handover_azimuth_error_rad) < math.radians(8.0)


def test_without_light_nothing_leads_to_the_station():
    lamps = [to_plain(dataclasses.replace(lamp, power_w=1e-12)) for lamp in load_conical_station().beacons]
    dark = {"array_power_w": 1e-12, "beacons": lamps, "rotating": {"power_w": 1e-12}}
    result = EpisodeRunner(beacons(station=dark, limits={"max_time_s": 25.0})).run(0)
    assert result.failure_reason == "search"
    assert result.acquire_s is result.first_pose_s is result.azimuth_rms_rad is None
    assert result.azimuth_fixes == 0


def test_who_flies_depends_on_what_is_known():
    around = EpisodeRunner(beacons())
    fixed_lamps = EpisodeRunner(beacons(station={"rotating": None}))
    surveyed = EpisodeRunner(level_cfg(1).override({"world": {"fidelity": "beacons"}}))
    assert isinstance(around.pilot, RotatingPilot)
    assert isinstance(fixed_lamps.pilot, RotatingPilot)
    assert isinstance(surveyed.pilot, ConicalPilot)
    assert (around.task.kind, surveyed.task.kind) == ("rotating", "conical")


def test_conical_results_have_none_of_the_rotating_fields():
    cfg = level_cfg(1).override({"world": {"fidelity": "beacons", "limits": {"max_time_s": 1.0}}})
    result = EpisodeRunner(cfg).run(0)
    assert result.start_azimuth_rad is result.acquire_s is result.azimuth_fixes is None


@pytest.mark.parametrize("level", LEVELS)
def test_every_rotating_level_loads_and_starts_in_a_ring(level):
    cfg = level_cfg(level, "rotating").world
    assert cfg.start.ring
    assert cfg.station.rotating is not None
    assert cfg.station_heading == "unknown"


def test_stations_without_levels_are_refused():
    with pytest.raises(ConfigError, match="station"):
        level_cfg(1, "harbour")
    assert {"approach", "circle", "lineup"} <= set(FAILURE_REASONS)
