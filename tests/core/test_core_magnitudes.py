"""Numbers beyond anything of their unit are refused by the setting's name, up to there they are taken."""

import math

import pytest

from auvdock.core.errors import ConfigError
from auvdock.core.magnitudes import check_magnitude


@pytest.mark.parametrize(
    ("path", "greatest"),
    [
        ("world.station.depth_m", 11_000.0),
        ("lamps[3].position_m[2]", 11_000.0),
        ("world.attenuation_per_m", 100.0),
        ("attenuation", 100.0),
        ("max-speed-m-s", 1e3),
        ("world.limits.max_time_s", 1e9),
        ("a.heading_walk_rad_rs", 1e15),
        ("world.camera.radial[2]", 1e15),
    ],
)
def test_up_to_the_greatest_of_its_unit(path: str, greatest: float):
    for sign in (1.0, -1.0):
        check_magnitude(path, sign * greatest)
        for value in (1.001 * greatest, 1e20, 1e308, math.inf, math.nan):
            with pytest.raises(ConfigError) as caught:
                check_magnitude(path, sign * value)
            assert caught.value.field == path


def test_what_has_a_unit_is_nothing_or_something():
    check_magnitude("start.lateral_m", 0.0)
    check_magnitude("start.lateral_m", -1e-12)
    check_magnitude("surround_factor", 2e-15)
    with pytest.raises(ConfigError, match="at least 1e-100 m"):
        check_magnitude("start.lateral_m", 5e-324)


def test_counts_and_seeds():
    check_magnitude("world.camera.width_px", 10**9)
    check_magnitude("seed", 2**63 - 1)
    for name, value in (("array_count", 10**9 + 1), ("seed", 2**63), ("seed", -(10**30)), ("depth_m", 10**400)):
        with pytest.raises(ConfigError, match=name):
            check_magnitude(name, value)
