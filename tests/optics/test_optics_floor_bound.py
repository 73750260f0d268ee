"""The floor far from the station is not drawn where none of its lamps shows on it: the bound is one, and tight."""

import dataclasses
import math

import numpy as np
import pytest

from auvdock.envs.config import rotating_world_cfg
from auvdock.envs.world import DockingWorld
from auvdock.optics.water import load_water

WATER = load_water(rotating_world_cfg().water)


@pytest.fixture(scope="module")
def surfaces():
    world = DockingWorld(dataclasses.replace(rotating_world_cfg(), fidelity="pixels"))
    found = world.imager.surfaces
    assert found is not None
    return found


def brightest_floor(unit, camera, floor_z):
    """Greatest radiance per band that reaches the camera from points of the floor, lamp by lamp, on a fine grid."""
    x, y = np.meshgrid(np.linspace(-12.0, 50.0, 249), np.linspace(-12.0, 12.0, 97))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, floor_z)])
    d = np.linalg.norm(points[:, None] - unit.light.lamps_m, axis=2)
    light = (np.exp(-d * unit.light.absorption_per_m) / d**2) @ unit.light.spill_w_sr
    through = np.exp(-np.linalg.norm(points - camera, axis=1)[:, None] * WATER.attenuation)
    return (light * through).max(axis=0) / math.pi


@pytest.mark.parametrize("x_m", [3.0, 8.0, 15.0, 25.0, 40.0])
@pytest.mark.parametrize("height_m", [1.0, 4.0])
def test_no_point_of_the_floor_outshines_the_bound(surfaces, x_m, height_m):
    floor_z = -12.0
    camera = np.array([x_m, 1.0, floor_z + height_m])
    through = np.exp(-height_m * WATER.attenuation)[None]
    bound = surfaces.plane_radiance(camera, np.array([height_m]), np.zeros(3), through)[0]
    true = brightest_floor(surfaces, camera, floor_z)
    lit = true > 0.0
    assert np.all(bound[lit] >= 0.999 * true[lit])
    assert np.all(bound[lit] <= 20.0 * true[lit])  # the sum over lamps of each one's best place, and the ladder's steps


def test_far_from_the_station_nothing_is_drawn_and_near_it_is(surfaces):
    assert not surfaces.visible(np.array([40.0, 0.0, -8.0]), 0.02)
    assert surfaces.visible(np.array([5.0, 0.0, -8.0]), 0.02)
