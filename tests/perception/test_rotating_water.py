"""The pass profile against what the photons' halo makes of the beam."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.halo import halo_of
from auvdock.optics.water import load_water
from auvdock.perception.rotating.profile import beam_sigma_rad, pass_profile


@pytest.mark.parametrize("br", [1.0, 7.0, 16.0, 25.0])
@pytest.mark.parametrize("water", ["clear", "pool", "lake"])
def test_one_parameter_meets_the_beam_in_water(br: float, water: str) -> None:
    """Within 4.5 % of the peak out to 40°, for clear to murky water; more scattering, more widening."""
    angle = np.radians(np.linspace(0.01, 40.0, 81))
    light = beam_spread(halo_of(load_water(water)), 0, math.radians(5.0)).share(np.full(len(angle), br), angle)
    light /= light[0]
    beam = beam_sigma_rad(10.0)

    def misfit(log_excess: float) -> float:
        return float(np.sum((pass_profile(angle, beam, 1.0 + math.exp(log_excess)) - light) ** 2))

    best = minimize_scalar(misfit, bounds=(-5.0, 2.5), method="bounded")
    found = pass_profile(angle, beam, 1.0 + math.exp(best.x))
    assert np.abs(found - light).max() < 0.045
    if br >= 7.0:
        assert math.exp(best.x) > 0.15
