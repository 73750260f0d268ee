"""The halo as a camera resolves it, against a convolution in the plane of the sensor."""

import math

import numpy as np
import pytest

from auvdock.optics.blur import blurred_halo
from auvdock.optics.halo import halo_of
from auvdock.optics.water import load_water

RAD_PER_PX = 1.0 / 349.0
RADII_PX = np.geomspace(0.35, 288.0, 32)


@pytest.mark.parametrize("name", ["clear", "pool", "lake"])
@pytest.mark.parametrize("sigma_px", [0.8, 1.7])
def test_is_the_halo_folded_with_a_gaussian(name, sigma_px):
    """Points of the halo, as many in each ring as it holds light, thrown by a Gaussian: what falls on a small disc."""
    table = halo_of(load_water(name))
    row = 40
    blurred = blurred_halo(table, RADII_PX, RAD_PER_PX, np.array([sigma_px**2]))[0, row]
    edges_rad = np.geomspace(1e-7, 40.0 * RAD_PER_PX, 3000)
    within = table.encircled_rows(edges_rad)[row]
    light, radius = np.diff(within, prepend=0.0), np.append(0.0, np.sqrt(edges_rad[1:] * edges_rad[:-1])) / RAD_PER_PX
    way = (np.arange(256) + 0.5) / 256.0 * math.tau
    for k in range(0, 17, 2):
        apart2 = RADII_PX[k] ** 2 + radius[:, None] ** 2 - 2.0 * RADII_PX[k] * radius[:, None] * np.cos(way)
        gauss = (np.exp(-0.5 * apart2 / sigma_px**2) / (math.tau * sigma_px**2)).mean(axis=1)
        assert blurred[k] == pytest.approx(float(light @ gauss), rel=0.03)


def test_blur_moves_light_and_loses_none():
    table = halo_of(load_water("lake"))
    sizes = np.array([0.8, 1.6, 3.2]) ** 2
    edges = np.concatenate([[0.0], np.sqrt(RADII_PX[1:] * RADII_PX[:-1]), RADII_PX[-1:]])
    rings = math.pi * np.diff(edges**2)
    for level in blurred_halo(table, RADII_PX, RAD_PER_PX, sizes):
        whole = table.encircled_rows(edges[-1:] * RAD_PER_PX)[:, 0]
        assert level @ rings == pytest.approx(whole, rel=0.06)


def test_more_blur_lowers_the_middle_and_leaves_what_is_far():
    levels = blurred_halo(halo_of(load_water("pool")), RADII_PX, RAD_PER_PX, np.array([0.64, 2.0, 6.0]))
    # Up to b r = 8; the halo is flat in its middle where light was scattered many times.
    assert np.all(np.diff(levels[:, :53, 0], axis=0) < 0.0)
    assert levels[2, :, 25:] == pytest.approx(levels[0, :, 25:], rel=0.02)
