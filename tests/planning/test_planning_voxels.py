"""Voxel integration against closed forms."""

import math

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.planning.voxels import fill_region


def ball(radius, centre=(0.0, 0.0, 0.0)):
    return lambda points: np.sum((points - np.array(centre)) ** 2, axis=1) <= radius**2


def test_ball_converges_to_its_volume():
    exact = 4.0 / 3.0 * math.pi * 2.0**3
    errors = []
    for voxel in (0.4, 0.2, 0.1):
        region = fill_region(ball(2.0), np.full(3, -2.5), np.full(3, 2.5), voxel)
        errors.append(abs(region.volume_m3 - exact) / exact)
    assert errors[-1] < 0.002
    assert errors[-1] < errors[0]


def test_refinement_equals_the_full_grid():
    low, high = np.full(3, -2.5), np.full(3, 2.5)
    refined = fill_region(ball(2.0, (0.3, -0.2, 0.1)), low, high, 0.1, levels=2)
    full = fill_region(ball(2.0, (0.3, -0.2, 0.1)), low, high, 0.1, levels=0)
    shape = full.inside.shape
    np.testing.assert_array_equal(refined.inside[: shape[0], : shape[1], : shape[2]], full.inside)
    assert refined.evaluations < 0.5 * full.inside.size


def test_cone_and_containment():
    height, half = 6.0, math.radians(20.0)

    def cone(points):
        return (points[:, 0] <= height) & (np.hypot(points[:, 1], points[:, 2]) <= points[:, 0] * math.tan(half))

    region = fill_region(cone, np.array([0.0, -2.5, -2.5]), np.array([6.5, 2.5, 2.5]), 0.06)
    exact = math.pi * (height * math.tan(half)) ** 2 * height / 3.0
    assert region.volume_m3 == pytest.approx(exact, rel=0.01)
    assert region.contains(np.array([[3.0, 0.0, 0.0], [3.0, 2.0, 0.0], [-9.0, 0.0, 0.0]])).tolist() == [
        True,
        False,
        False,
    ]
    assert region.discretisation_error_m3 < 0.03 * exact
    surface = region.surface_m()
    assert len(surface) == region.surface_voxels
    assert cone(surface).all()


def test_empty_region_has_no_volume():
    region = fill_region(lambda points: np.zeros(len(points), dtype=bool), np.zeros(3), np.ones(3), 0.1)
    assert region.volume_m3 == 0.0
    assert len(region.surface_m()) == 0


@pytest.mark.parametrize("voxel", [0.0, -1.0, float("nan"), 1e-4])
def test_refuses_voxels_that_cannot_be(voxel):
    with pytest.raises(ConfigError, match="voxel_m"):
        fill_region(ball(1.0), np.full(3, -2.0), np.full(3, 2.0), voxel)
