"""The pass of a beam: profile, peak between frames, bound."""

import math

import numpy as np
import pytest

from auvdock.perception.rotating.bound import PassSignal, mean_bound, peak_bound
from auvdock.perception.rotating.pass_fit import fit_pass
from auvdock.perception.rotating.profile import beam_sigma_rad, pass_profile

BEAM = beam_sigma_rad(10.0)
STEP = math.tau * 0.5 / 30.0


def test_profile_is_half_at_half_the_divergence_without_scattering() -> None:
    """A 10° beam is halved 5° off its axis; widening only raises it."""
    narrow = pass_profile(np.radians([0.0, 5.0, 10.0]), BEAM, 1.0)
    np.testing.assert_allclose(narrow, [1.0, 0.5, 0.0625], atol=0.01)
    wide = pass_profile(np.radians([0.0, 5.0, 10.0]), BEAM, 1.6)
    assert wide[0] == 1.0
    assert (wide[1:] > narrow[1:]).all()


@pytest.mark.parametrize("frames", [2, 3, 5])
@pytest.mark.parametrize("widening", [1.05, 1.5])
def test_peak_between_frames_without_noise(frames: int, widening: float) -> None:
    """Any phase, even from two visible frames: within 1° where frames lie 6° apart, 0.15° from three on."""
    for phase in np.linspace(-0.5, 0.5, 9):
        angle = STEP * np.arange(-4.0, 5.0)
        light = pass_profile(angle - phase * STEP, BEAM, widening)
        order = np.sort(light)[::-1]
        limit = math.sqrt(order[frames - 1] * order[frames])
        seen = light > limit
        fit = fit_pass(
            angle, np.where(seen, light, limit), 0.02 * np.maximum(light, limit), seen, BEAM, (math.log(0.25), 1.0)
        )
        assert fit is not None
        error = abs(fit.offset_rad - phase * STEP)
        assert error < math.radians(1.0 if frames == 2 else 0.15)


def test_a_single_sample_gives_its_own_time_with_a_wide_sigma() -> None:
    """One visible frame tells the peak to some frames' half, and says so."""
    angle = 0.3 + STEP * np.arange(-2.0, 3.0)
    seen = np.array([False, False, True, False, False])
    fit = fit_pass(angle, np.ones(5), np.full(5, 0.05), seen, BEAM)
    assert fit is not None
    assert abs(fit.offset_rad - 0.3) < math.radians(3.0)
    assert fit.sigma_rad > math.radians(1.0)
    with pytest.raises(ValueError, match="sample"):
        fit_pass(np.zeros(1), np.zeros(1), np.ones(1), np.array([False]), BEAM)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e110])
@pytest.mark.parametrize("where", ["angle", "flux"])
def test_what_is_no_number_is_no_pass(value: float, where: str) -> None:
    angle, flux = STEP * np.arange(-3.0, 4.0), np.exp(-(np.arange(-3.0, 4.0) ** 2))
    (angle if where == "angle" else flux)[2] = value
    fit = fit_pass(angle, flux, np.full(7, 0.02), np.ones(7, dtype=np.bool_), BEAM)
    assert fit is None or (math.isfinite(value) and np.isfinite(fit).all())


def test_samples_at_one_angle_or_without_light_still_give_numbers() -> None:
    for angle, flux in ((np.zeros(5), np.ones(5)), (STEP * np.arange(5.0), np.zeros(5))):
        fit = fit_pass(angle, flux, np.full(5, 0.02), np.ones(5, dtype=np.bool_), BEAM)
        assert fit is not None
        assert np.isfinite(fit).all()


def _monte_carlo(signal: PassSignal, n: int, seed: int) -> tuple[float, float]:
    """(rms error in rad, rms of error over stated sigma) of the fit with photon noise, peak at a random phase."""
    rng = np.random.default_rng(seed)
    error, told = [], []
    for _ in range(n):
        phase = rng.uniform(-0.5, 0.5)
        angle = STEP * np.arange(-7.0, 8.0)
        mean = signal.peak_e * pass_profile(angle - phase * STEP, BEAM, signal.widening)
        noise = np.sqrt(mean + signal.background_e + signal.read_variance_e2)
        flux = mean + noise * rng.standard_normal(len(angle))
        sigma = np.sqrt(np.maximum(flux, 0.0) + signal.background_e + signal.read_variance_e2)
        fit = fit_pass(angle, flux, sigma, np.ones(len(angle), dtype=np.bool_), BEAM, (math.log(0.25), 2.0))
        assert fit is not None
        error.append(fit.offset_rad - phase * STEP)
        told.append(error[-1] / fit.sigma_rad)
    return float(np.sqrt(np.mean(np.square(error)))), float(np.sqrt(np.mean(np.square(told))))


@pytest.mark.parametrize(
    "signal", [PassSignal(1e5, 1e6, 1e4, 1.6), PassSignal(2e4, 1e4, 0.0, 1.1)], ids=["day at range", "night"]
)
def test_the_fit_reaches_the_cramer_rao_bound(signal: PassSignal) -> None:
    """Root mean square error within 15 % of the bound (n = 150: ± 12 % at 95 %), stated sigma within 25 %."""
    rms, told = _monte_carlo(signal, 150, 1)
    bound = mean_bound(signal, BEAM, 0.5, 30.0).angle_rad
    assert 0.82 < rms / bound < 1.18
    assert 0.7 < told < 1.2


def test_the_bound_scales_as_it_must() -> None:
    """Without background it falls with the root of the light; time is angle over rate; more frames, less error."""
    bright, dim = PassSignal(4e6, 0.0, 0.0, 1.3), PassSignal(1e6, 0.0, 0.0, 1.3)
    at = [peak_bound(signal, BEAM, 0.5, 30.0, 0.3) for signal in (bright, dim)]
    assert at[1].angle_rad == pytest.approx(2.0 * at[0].angle_rad, rel=1e-6)
    assert at[0].time_s == pytest.approx(at[0].angle_rad / math.pi, rel=1e-12)
    assert mean_bound(dim, BEAM, 0.5, 60.0).angle_rad < mean_bound(dim, BEAM, 0.5, 30.0).angle_rad


def test_the_bound_of_a_densely_sampled_gaussian_is_the_closed_form() -> None:
    """Constant variance v, amplitude a, width σ, sampled every h: σ_δ² = 2 v σ h / (a² √π)."""
    signal = PassSignal(1.0, 0.0, 1e6, 1.0 + 1e-5)
    rate = 0.5
    frame_rate = 3000.0
    h = math.tau * rate / frame_rate
    sigma = BEAM * 1.01  # MIN_WIDENING
    expected = math.sqrt(2.0 * 1e6 * sigma * h / math.sqrt(math.pi))
    assert peak_bound(signal, BEAM, rate, frame_rate, 0.0).angle_rad == pytest.approx(expected, rel=0.02)
