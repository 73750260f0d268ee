"""Flux: the light of a spot, whatever the exposure, the gain and the encoding."""

import math

import numpy as np
import pytest
from perception_scenes import CAMERA

from auvdock.core.contracts import Detections, Frame
from auvdock.core.errors import ConfigError
from auvdock.core.response import CameraResponse
from auvdock.perception.blob import BlobCfg, BlobDetector
from auvdock.perception.flux import spot_flux
from auvdock.perception.threshold import ThresholdCfg, ThresholdDetector

WIDTH_PX = 2.2
LIGHT_E_S = 3e6


def _frame(exposure_s: float, gain: float, response: CameraResponse, background_e_s: float = 2e4) -> Frame:
    """A spot with exponential wings of `LIGHT_E_S` electrons per second in all, encoded without noise."""
    v, u = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px]
    r = np.hypot(u - 300.3, v - 140.8)
    light = background_e_s + LIGHT_E_S * np.exp(-r / WIDTH_PX) / (2.0 * math.pi * WIDTH_PX**2)
    electrons = light * exposure_s
    full_e, read_e = response.full_well_e / gain, response.read_noise_e
    if response.encoding == "linear":
        codes = electrons / full_e * 255.0
    else:
        codes = 255.0 * (np.sqrt(electrons + read_e**2) - read_e) / (math.sqrt(full_e + read_e**2) - read_e)
    image = np.zeros((CAMERA.height_px, CAMERA.width_px, 3), dtype=np.uint8)
    image[:, :, 2] = np.clip(np.rint(codes), 0, 255)
    return Frame(image, 0.0, CAMERA, exposure_s, gain, response)


@pytest.mark.parametrize("encoding", ["sqrt", "linear"])
@pytest.mark.parametrize("gain", [1.0, 4.0])
def test_flux_does_not_depend_on_exposure_and_gain(encoding: str, gain: float) -> None:
    """An order of magnitude in exposure, unsaturated: the same flux within 3 %."""
    response = CameraResponse(encoding)
    centre = np.array([[300.3, 140.8]])
    fluxes = [float(spot_flux(_frame(s / gain, gain, response), centre)[0]) for s in (0.03, 0.1, 0.3)]
    assert max(fluxes) / min(fluxes) < 1.03


def test_flux_survives_a_saturated_core() -> None:
    """Up to four times overexposed: within 25 %, where cutting the core off would cost more than half."""
    response, centre = CameraResponse(), np.array([[300.3, 140.8]])
    true = float(spot_flux(_frame(0.1, 1.0, response, 2e3), centre)[0])
    for exposure_s in (0.8, 1.2, 1.6):
        frame = _frame(exposure_s, 1.0, response, 2e3)
        assert (frame.image >= 250).any()
        assert float(spot_flux(frame, centre)[0]) == pytest.approx(true, rel=0.25)


def test_flux_is_proportional_to_light() -> None:
    """Twice the light (and surroundings), twice the flux."""
    response, centre = CameraResponse("linear"), np.array([[300.3, 140.8]])
    one = spot_flux(_frame(0.1, 1.0, response), centre)
    twice = _frame(0.2, 1.0, response)
    two = spot_flux(Frame(twice.image, 0.0, CAMERA, 0.1, 1.0, response), centre)
    np.testing.assert_allclose(two, 2.0 * one, rtol=0.03)


def test_no_spots_no_flux_and_borders_are_safe() -> None:
    """No centre gives an empty array; a centre in the corner or off the image gives a finite number of 0 or more."""
    frame = _frame(0.1, 1.0, CameraResponse())
    assert spot_flux(frame, np.zeros((0, 2))).shape == (0,)
    corner = spot_flux(frame, np.array([[0.0, 0.0], [639.0, 359.0], [2000.0, -50.0]]))
    assert np.isfinite(corner).all()
    assert (corner >= 0.0).all()


@pytest.mark.parametrize(
    ("with_flux", "without"),
    [
        (ThresholdDetector(ThresholdCfg(flux=True)), ThresholdDetector()),
        (BlobDetector(BlobCfg(flux=True)), BlobDetector()),
    ],
)
def test_detectors_measure_flux_only_when_asked(
    with_flux: ThresholdDetector | BlobDetector, without: ThresholdDetector | BlobDetector
) -> None:
    """The same detections either way; flux comes on top."""
    frame = _frame(0.3, 1.0, CameraResponse(), background_e_s=0.0)
    plain, measured = without.detect(frame), with_flux.detect(frame)
    assert plain.flux is None
    assert measured.flux is not None
    assert len(measured) > 0
    assert float(measured.flux[0]) > 0.0
    np.testing.assert_array_equal(plain.centre_px, measured.centre_px)
    np.testing.assert_array_equal(plain.score, measured.score)
    dark = Frame(np.zeros_like(frame.image), 0.0, CAMERA)
    empty = with_flux.detect(dark)
    assert len(empty) == 0
    assert empty.flux is not None
    assert empty.flux.shape == (0,)


def test_detections_carry_flux_through_selection() -> None:
    """`select` keeps each light's flux; without flux there is none to keep."""
    found = Detections.from_points(np.zeros((3, 2)), np.ones(3), np.zeros(3, dtype=np.int64), flux=np.arange(3.0))
    kept = found.select(np.array([2, 0])).flux
    assert kept is not None
    assert kept.tolist() == [2.0, 0.0]
    assert Detections.empty().flux is None
    with pytest.raises(ValueError, match="flux"):
        Detections.from_points(np.zeros((3, 2)), np.ones(3), np.zeros(3, dtype=np.int64), flux=np.zeros(2))


def test_a_larger_disc_takes_in_all_of_a_broad_light() -> None:
    """Of wings e^(-r/w) a disc of R holds 1 - (1 + R/w) e^(-R/w), less its area times the light at 1.7 R."""
    frame, centre = _frame(0.1, 1.0, CameraResponse("sqrt")), np.array([[300.3, 140.8]])
    focal_px = float(CAMERA.matrix[0, 0])
    for disc_rad in (0.012, 0.018, 0.025):
        x = disc_rad * focal_px / WIDTH_PX
        share = float(spot_flux(frame, centre, disc_rad)[0]) / LIGHT_E_S
        assert share == pytest.approx(1.0 - (1.0 + x) * math.exp(-x) - 0.5 * x * x * math.exp(-1.7 * x), abs=0.02)


def test_flux_disc_must_be_a_radius() -> None:
    """Zero and less are refused by name."""
    with pytest.raises(ConfigError, match="flux_disc_rad"):
        ThresholdCfg(flux_disc_rad=0.0)
