"""Worlds that cannot be are refused by the name of a setting; all others start where a vehicle can be."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.cli.main import main
from auvdock.core.errors import ConfigError
from auvdock.core.landing_station import load_landing_station
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import rotation_from_quat_wxyz
from auvdock.core.vehicle import load_vehicle
from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.envs.landing_config import LandingStartCfg, LandingWorldCfg
from auvdock.envs.landing_world import draw_landing_start
from auvdock.envs.room import hull_room
from auvdock.envs.world import draw_start
from auvdock.episode.config import landing_level_cfg, level_cfg
from auvdock.sim.simulator import SimCfg, Simulator

CONICAL, LANDING = load_conical_station(), load_landing_station()
VEHICLES = {name: load_vehicle(name) for name in ("remus_hybrid", "bluerov2_heavy")}
LENGTHS = st.floats(-5.0, 40.0)
CORNERS = tuple(f"{index:04b}" for index in range(16))


class Corner:
    """A generator whose draws are all at an end of their range."""

    def __init__(self, ends: str) -> None:
        self.ends = iter(ends)

    def uniform(self, low: float, high: float) -> float:
        return low if next(self.ends) == "0" else high


def at_corner(ends: str) -> Any:
    return Corner(ends)


def heights(place, quat, vehicle):
    """Lowest and highest of the hull's corners in the world."""
    box = vehicle.hull_box_body_m
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    z = place[2] + corners @ rotation_from_quat_wxyz(quat)[2]
    return z.min(), z.max()


def accepted(make, fields):
    """What `make` gives; None if it refuses, which it has to do by one of these names."""
    try:
        return make()
    except ConfigError as error:
        if error.field not in fields:
            raise
        return None


@settings(max_examples=200, deadline=None)
@given(LENGTHS, LENGTHS, LENGTHS, st.floats(2.0, 20.0), st.booleans(), st.sampled_from(sorted(VEHICLES)))
def test_what_a_conical_world_accepts_starts_between_floor_and_surface(depth, floor, vertical, least, ring, name):
    def make():
        station = dataclasses.replace(CONICAL, depth_m=depth, floor_below_m=floor)
        start = StartCfg(ring=ring, min_range_m=least, vertical_m=vertical)
        return WorldCfg(station=station, start=start, sim=SimCfg(vehicle=name))

    station, start = ("depth_m", "floor_below_m"), ("vertical_m", "min_range_m")
    cfg = accepted(
        make, {*station, *(f"start.{name}" for name in start), *start, *(f"station.{name}" for name in station)}
    )
    if cfg is None:
        return
    for corner in CORNERS:
        low, high = heights(*draw_start(cfg.start, depth, at_corner(corner)), VEHICLES[name])
        assert -depth - floor - 1e-9 <= low < high <= 1e-9


@settings(max_examples=200, deadline=None)
@given(LENGTHS, LENGTHS, LENGTHS, st.sampled_from(sorted(VEHICLES)))
def test_what_a_landing_world_accepts_starts_between_guides_and_surface(depth, least, most, name):
    def make():
        station = dataclasses.replace(LANDING, depth_m=depth)
        start = LandingStartCfg(min_height_m=least, max_height_m=most)
        return LandingWorldCfg(station=station, start=start, sim=SimCfg(vehicle=name))

    start = ("min_height_m", "max_height_m")
    cfg = accepted(make, {"depth_m", "station.depth_m", *start, *(f"start.{name}" for name in start)})
    if cfg is None:
        return
    for corner in CORNERS:
        low, high = heights(
            *draw_landing_start(cfg.start, cfg.station, VEHICLES[name], at_corner(corner)), VEHICLES[name]
        )
        assert cfg.station.guide.top_m - depth - 1e-9 <= low < high <= 1e-9


@pytest.mark.parametrize("name", VEHICLES)
def test_the_narrowest_ring_touches_nothing(name):
    """All around the station at the least radius that is accepted, pointing at it and across."""
    funnel, room = CONICAL.funnel, hull_room(name)
    radius = math.hypot(funnel.length_m + funnel.tube_length_m, funnel.mouth_radius_m) + room.around_m
    StartCfg(ring=True, min_range_m=math.ceil(radius))
    sim = Simulator(SimCfg(vehicle=name), CONICAL)
    for azimuth in np.radians(np.arange(0.0, 360.0, 15.0)):
        place = np.array([radius * math.cos(azimuth), radius * math.sin(azimuth), -CONICAL.depth_m])
        for heading in (azimuth + math.pi, azimuth, azimuth + 0.5 * math.pi):
            quat = np.array([math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading)])
            sim.reset(place, quat, np.random.default_rng(0))
            assert sim.data.ncon == 0


MADE = {"conical": level_cfg(1), "rotating": level_cfg(1, "rotating"), "landing": landing_level_cfg(1)}
LATCH = "world.station.latch."
REFUSED = [
    *((kind, "world.start.vertical_m", value) for kind in ("conical", "rotating") for value in (20.0, 3.95, -1.0)),
    *((kind, "world.station.depth_m", value) for kind in MADE for value in (-8.0, 0.0)),
    ("conical", "world.station.depth_m", 1.0),
    ("rotating", "world.station.depth_m", 1.55),  # its lantern stands 1.6 m above the mouth
    *((kind, "world.station.floor_below_m", value) for kind in ("conical", "rotating") for value in (-4.0, 0.5)),
    ("rotating", "world.start.min_range_m", 3.5),
    *((kind, LATCH + "hold_s", -0.5) for kind in MADE),
    *((kind, LATCH + "depth_m", value) for kind in ("conical", "rotating") for value in (-0.5, 1.6)),
    *((kind, LATCH + "max_speed_m_s", 0.0) for kind in MADE),
    *(("conical", LATCH + name, value) for name in ("max_angle_deg", "max_entry_speed_m_s") for value in (-1.0, 0.0)),
    ("conical", LATCH + "max_angle_deg", 91.0),
    *(("landing", LATCH + name, -0.01) for name in ("along_m", "across_m", "height_m", "max_touchdown_m_s")),
    *(("landing", LATCH + name, value) for name in ("max_heading_deg", "max_tilt_deg") for value in (0.0, 91.0)),
    ("landing", "world.start.max_height_m", 9.4),
    *(("conical", f"world.station.{name}", -1.0) for name in ("array_power_w", "array_count", "array_beam_angle_deg")),
    *((kind, "world.limits." + name, 0.0) for kind in MADE for name in ("surfaced_s", "carried_off_m", "max_time_s")),
    ("rotating", "world.station.rotating.power_w", -1.0),
    ("rotating", "world.station.rotating.rate_rev_s", 0.0),
    ("conical", "world.sim.current.speed_m_s", -0.1),
    ("conical", "world.sim.physics_hz", 10.0),
    ("landing", "world.station.guide.seat_height_m", -0.1),
    ("landing", "world.station.height_m", -0.25),
]


@pytest.mark.parametrize(("kind", "field", "value"), REFUSED)
def test_a_world_that_cannot_be_is_refused_by_the_name_that_the_user_gave(kind, field, value):
    changes = value
    for name in reversed(field.split(".")):
        changes = {name: changes}
    with pytest.raises(ConfigError) as refusal:
        MADE[kind].override(changes)
    assert (refusal.value.field, refusal.value.value) == (field, value)
    assert refusal.value.remedy


def test_a_value_that_fits_only_beside_another_is_taken_with_it():
    deep = {"station": {"depth_m": 40.0, "floor_below_m": 30.0}, "start": {"vertical_m": 20.0}}
    assert level_cfg(1).override({"world": deep}).world.start.vertical_m == 20.0


def test_a_lamp_in_the_air_is_refused():
    lamp = dataclasses.replace(CONICAL.beacons[0], name="moon", position_m=(0.0, 0.0, 8.5))
    with pytest.raises(ConfigError, match=r"^extra_lights\[0\]\.position_m"):
        WorldCfg(extra_lights=(lamp,))
    with pytest.raises(ConfigError, match=r"^depth_m"):
        dataclasses.replace(CONICAL, beacons=(*CONICAL.beacons, lamp))


def test_the_command_says_what_would_be_right(capsys):
    assert main(["dock", "conical", "--fidelity", "beacons", "--world.start.vertical-m", "20"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "world.start.vertical_m" in line
    assert "at most 3.904 m" in line
