"""The rotating beacon in the `beacons` fidelity against the renderer, and the exposure that meets its flashes."""

import dataclasses
import math

import numpy as np
import pytest
from optics_scene import DEPTH_M, T_WORLD_STATION, camera, imager

from auvdock.core.contracts import BLUE
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import make_transform
from auvdock.optics.detection_model import load_detection_model
from auvdock.optics.exposure import AutoExposure
from auvdock.optics.flash import FlashOptics
from auvdock.optics.imaging import ExposureCfg, ImagingCfg, UnderwaterCamera
from auvdock.optics.meeting import Candidate
from auvdock.optics.sensing import BeaconSensor, meet
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import load_water
from auvdock.perception.threshold import ThresholdCfg, ThresholdDetector

STATION = load_conical_station("rotating")
BEACON = STATION.rotating or RotatingBeaconCfg()
POOL = load_water("pool")
PLAIN = OpticalSetup(camera(), POOL, STATION.layout, T_WORLD_STATION, ImagingCfg(surfaces=False))
SCENE = dataclasses.replace(PLAIN, rotating=BEACON)
BEHIND = 2.4
"""A bearing from which no lamp but the rotating one is seen."""


def place(range_m, bearing_rad=BEHIND):
    """At the beacon's height, looking a little past it."""
    angle = bearing_rad + math.pi + 0.1
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = BEACON.position_m
    position = np.array([x + range_m * math.cos(bearing_rad), y + range_m * math.sin(bearing_rad), z - DEPTH_M])
    return make_transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), position)


def facing_s(bearing_rad=BEHIND):
    return bearing_rad / math.tau / BEACON.rate_rev_s


def sensor():
    unit = BeaconSensor(SCENE)
    unit.reset(np.random.default_rng(0))
    return unit


def seen_and_found(range_m, degrees, detector):
    """What the model says of the flash and what the detector finds in the frame; exposure settled on the flash."""
    unit = UnderwaterCamera(SCENE)
    unit.take(place(range_m), facing_s())
    shot = unit.take(place(range_m), facing_s() + degrees / 360.0 / BEACON.rate_rev_s)
    spots = FlashOptics(unit.lit).spots(shot.view)
    seen, _ = meet(unit.lit, shot.view, spots, shot.exposure_s, shot.gain)
    assert unit.lit.rotating is not None
    assert seen.flash is not None
    assert seen.measures_flux
    place_, half, shift = seen.flash
    light = Candidate.read(seen.lights, place_)
    said = (light.contrast_dn, light.light_e_s, half, shift)
    return said, detector.detect(shot.frame), shot.view.pixels[unit.lit.rotating.lamp]


@pytest.mark.parametrize(("range_m", "degrees"), [(12.0, 0.0), (20.0, 6.0), (20.0, -12.0), (30.0, 0.0), (40.0, 3.0)])
def test_flux_box_and_centre_are_the_renderer_s(range_m, degrees):
    """Flux within a factor of 1.7, centre and half box within 6 px or a third: what the model claims to be good for."""
    said, found, lamp_px = seen_and_found(range_m, degrees, ThresholdDetector(ThresholdCfg(flux=True)))
    ways = load_detection_model("threshold").flash
    best = int(np.argmin(np.linalg.norm(found.centre_px - lamp_px, axis=1)))
    contrast_dn, light_e_s, half, shift = said
    assert ways is not None
    assert found.flux is not None
    assert contrast_dn > ways.contrast_50_dn
    assert 1.0 / 1.7 < found.flux[best] / light_e_s < 1.7
    expected = lamp_px + ways.centre_shift * shift
    assert np.linalg.norm(found.centre_px[best] - expected) < 6.0
    size = found.xyxy[best, 2:] - found.xyxy[best, :2]
    assert np.all(np.abs(0.5 * size - ways.box_scale * half) < np.maximum(6.0, 0.5 * size / 3.0))


def test_flash_comes_and_goes_with_the_turn():
    unit = sensor()
    body, counts = place(20.0), {}
    for k in range(180):
        found = unit.detect(body, k / 30.0)
        degrees = math.degrees(math.remainder(BEACON.azimuth_rad(k / 30.0) - BEHIND, math.tau))
        if k >= 60:
            counts.setdefault(round(degrees), []).append(len(found))
            if len(found):
                assert found.flux is not None
                assert found.class_id[0] == BLUE
                assert np.all(found.flux > 0.0)
    assert all(min(n) >= 1 for degrees, n in counts.items() if abs(degrees) <= 9)
    assert all(max(n) == 0 for degrees, n in counts.items() if abs(degrees) > 60)


def test_flux_rises_to_the_facing_frame():
    unit = sensor()
    body, flux = place(20.0), {}
    for k in range(60, 180):
        degrees = math.degrees(math.remainder(BEACON.azimuth_rad(k / 30.0) - BEHIND, math.tau))
        found = unit.detect(body, k / 30.0)
        if found.flux is not None and len(found) and abs(degrees) < 22.0:
            flux.setdefault(round(degrees), []).append(float(found.flux[0]))
    order = sorted(flux, key=abs)
    means = [np.mean(flux[degrees]) for degrees in order]
    assert means[0] > 3.0 * means[-1]
    assert np.all(np.diff(means) < 0.1 * means[0])


def test_station_time_decides_in_the_beacons_fidelity():
    unit, other = sensor(), sensor()
    facing = unit.detect(place(20.0), 0.3, station_time_s=facing_s())
    # Looked at by an eye used to the dark, the beam that points away is still a glow.
    away = other.detect(place(20.0), facing_s(), station_time_s=facing_s() + 1.0)
    assert facing.flux is not None
    assert away.flux is not None
    flash = int(np.argmax(facing.flux))
    assert unit.lit.rotating is not None
    lamp_px = unit.lit.look(place(20.0), 0.3).pixels[unit.lit.rotating.lamp]
    assert np.linalg.norm(facing.centre_px[flash] - lamp_px) < 3.0
    assert np.all(away.flux < 0.01 * facing.flux[flash])


def test_without_a_rotating_beacon_no_flux():
    unit = BeaconSensor(PLAIN)
    unit.reset(np.random.default_rng(0))
    found = unit.detect(place(10.0, 0.2), 0.0)
    assert len(found) > 0
    assert found.flux is None


def test_both_fidelities_expose_alike():
    """Sensitivities over one and a half turns agree to a factor of 1.5 in the median."""
    unit, cam = sensor(), UnderwaterCamera(SCENE)
    ratios = []
    for k in range(90):
        unit.detect(place(25.0), k / 30.0)
        cam.take(place(25.0), k / 30.0)
        ratios.append(cam.exposure.sensitivity_s / unit.exposure.sensitivity_s)
    assert unit.exposure.sensitivity_s < 0.1 * 0.016 * 16.0
    assert 1.0 / 1.5 < np.median(ratios[30:]) < 1.5


def test_memory_holds_the_exposure_between_flashes():
    cfg = ExposureCfg()

    def share_at(sensitivity_s, flash):
        return min(0.5, (sensitivity_s / 1e-3) * cfg.saturated_share) if flash else 0.0

    with_memory, without = AutoExposure(cfg, 66), AutoExposure(cfg)
    for law in (with_memory, without):
        law.settle(lambda s: share_at(s, True))
    peaks = {with_memory: [], without: []}
    for k in range(600):
        for law, seen in peaks.items():
            share = share_at(law.sensitivity_s, k % 60 < 4)
            if k % 60 == 0:
                seen.append(share)
            law.update(share)
    # Without a memory each flash is met at full sensitivity; with one within the step that the law may rise by.
    assert min(peaks[without][1:]) > 30.0 * cfg.saturated_share
    assert max(peaks[with_memory]) < 2.1 * cfg.saturated_share


def test_memory_leaves_a_steady_scene_as_it_is():
    cfg = ExposureCfg()
    law = AutoExposure(cfg, 66)
    law.settle(lambda s: (s / 1e-3) * cfg.saturated_share)
    for _ in range(300):
        law.update((law.sensitivity_s / 1e-3) * cfg.saturated_share)
    assert law.sensitivity_s == pytest.approx(1e-3, rel=0.35)


def test_conical_frames_do_not_know_of_the_beacon():
    """A station without the beacon renders as it did before there were any: no memory, full saturation level."""
    unit = imager()
    assert unit.lit.rotating is None
    assert unit.exposure.metered == 1.0
    view = unit.lit.look(place(10.0, 0.1), 0.0, station_time_s=5.0)
    assert view.beam is None
