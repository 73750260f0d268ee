"""The way around: never into the disc, always to the gate, on the shorter side, as short as geometry allows."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.controllers.rotating.route import RouteCfg, route
from auvdock.core.errors import ConfigError

CFG = RouteCfg()
angles = st.floats(-math.pi, math.pi)
ranges = st.floats(16.0, 60.0)


def walk(angle, range_m, step_m=0.1, cfg=CFG):
    """Places on the way to the gate."""
    x, y = cfg.centre_x_m + range_m * math.cos(angle), range_m * math.sin(angle)
    side, places = 0.0, [(x, y)]
    for _ in range(3000):
        leg = route(x, y, side, cfg)
        if leg.left_m < 2.0 * step_m:
            return places
        side = leg.side
        x, y = x + step_m * math.cos(leg.course_rad), y + step_m * math.sin(leg.course_rad)
        places.append((x, y))
    raise AssertionError("never came to the gate")


@given(angle=angles, range_m=ranges)
def test_comes_to_the_gate_without_entering_the_disc(angle, range_m):
    places = walk(angle, range_m)
    nearest = min(math.hypot(x - CFG.centre_x_m, y) for x, y in places)
    assert nearest > CFG.radius_m - 0.15
    assert math.hypot(places[-1][0] - CFG.gate_m, places[-1][1]) < 0.5


@given(angle=angles, range_m=ranges)
def test_is_as_short_as_tangent_arc_tangent(angle, range_m):
    """Closed form of the shortest path past a disc between two places outside it."""
    reach, r = CFG.gate_m - CFG.centre_x_m, CFG.radius_m
    arc = abs(angle) - math.acos(r / range_m) - math.acos(r / reach)
    if arc > 0.0:
        shortest = math.sqrt(range_m**2 - r**2) + r * arc + math.sqrt(reach**2 - r**2)
    else:
        shortest = math.sqrt(range_m**2 + reach**2 - 2.0 * range_m * reach * math.cos(angle))
    way = 0.1 * (len(walk(angle, range_m)) - 1)
    assert way == pytest.approx(shortest, abs=0.5)
    start = route(CFG.centre_x_m + range_m * math.cos(angle), range_m * math.sin(angle), 0.0, CFG)
    assert start.left_m == pytest.approx(shortest, abs=1e-6)


@given(angle=st.floats(0.05, 3.1), range_m=ranges)
def test_is_mirrored_for_mirrored_places(angle, range_m):
    x, y = CFG.centre_x_m + range_m * math.cos(angle), range_m * math.sin(angle)
    port, starboard = route(x, y, 0.0, CFG), route(x, -y, 0.0, CFG)
    assert port.course_rad == pytest.approx(-starboard.course_rad)
    assert port.side == -starboard.side == 1.0


def test_keeps_its_side_right_behind_the_station():
    behind = (-30.0, -0.5)
    assert route(*behind, 0.0, CFG).side == -1.0
    assert route(*behind, 1.0, CFG).side == 1.0
    assert route(10.0, -20.0, 1.0, CFG).side == -1.0  # a side is no longer kept where the other is plainly shorter


@given(angle=angles, near_m=st.floats(0.5, CFG.radius_m - 0.5))
def test_leads_out_of_the_disc(angle, near_m):
    x, y = CFG.centre_x_m + near_m * math.cos(angle), near_m * math.sin(angle)
    leg = route(x, y, 0.0, CFG)
    if not leg.direct:
        outwards = math.cos(leg.course_rad - angle)
        assert outwards > 0.0


def test_caution_bends_the_course_away_from_the_station():
    sure, unsure = route(-30.0, 3.0, 0.0, CFG), route(-30.0, 3.0, 0.0, CFG, caution_m=12.0)
    assert unsure.course_rad > sure.course_rad > 0.0


def test_refuses_a_gate_inside_the_disc():
    with pytest.raises(ConfigError, match="gate_m"):
        RouteCfg(gate_m=8.0)
