"""Passes that tell less than they seem to: wandering spots, peaks out of view, dim lights in the beacon's place."""

import math

import numpy as np
import pytest
from rotating_scenes import CAMERA, Scene, azimuth_errors_rad

from auvdock.core.contracts import Proprioception
from auvdock.perception.rotating.candidates import Candidate, Spot
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.motion import CameraMotion
from auvdock.perception.rotating.passes import PassFinder
from auvdock.perception.rotating.profile import beam_sigma_rad, pass_profile

FRAME_DEG = 6.0
RAY = np.array([1.0, 0.0, 0.0])


@pytest.mark.parametrize(("wander", "widening", "faint"), [(0.25, 2.2, 0.005), (0.3, 1.6, 0.003)])
def test_a_spot_that_wanders_along_the_beam_is_one_light(wander, widening, faint):
    """Seen from the side a beam's spot lies off the lamp, towards the beam: here by 4 to 5° with the beam 16° off."""
    scene = Scene(wander=wander, widening=widening, faint=faint)
    errors = [azimuth_errors_rad(scene.run(16.0, np.random.default_rng(seed))[0]) for seed in range(6)]
    assert min(len(row) for row in errors) >= 5
    assert np.degrees(np.abs(np.concatenate(errors))).max() < 4.0


def test_a_dim_light_in_its_place_is_not_the_beacon():
    """The beacon goes out; something near flashes 5° later, at a twentieth of its light."""
    found = 0
    for seed in range(6):
        scene = Scene(beacon_until_s=12.0)
        start = float(np.random.default_rng(seed).uniform(0.0, 10.0))

        def dim(time_s: float, scene: Scene = scene, start: float = start) -> float:
            angle = math.degrees(scene.beam_rad(start + time_s, time_s)) - 5.0
            return 5e3 * math.exp(-0.5 * (angle / 5.0) ** 2) if time_s > 12.0 else 0.0

        scene.others[0.0, 0.1, 0.0] = dim
        fixes, _ = scene.run(17.0, np.random.default_rng(seed))
        found += len(fixes)
        assert np.degrees(np.abs(azimuth_errors_rad(fixes))).max() < 2.0
    assert found >= 12


def judged(angles_deg, peak_deg=1.0):
    """The pass that a finder sees in frames with the beam at these angles, and none elsewhere."""
    finder = PassFinder(ForwardBeaconCfg(), 0.5, beam_sigma_rad(10.0), CAMERA.rate_hz)
    motion = CameraMotion(CAMERA)
    zero = np.zeros(3)
    candidate, per_deg = Candidate(RAY, 0.0), 1.0 / 180.0
    for angle in np.arange(-180.0, 61.0, FRAME_DEG):
        time_s = 10.0 + angle * per_deg
        motion.update(Proprioception(time_s, 8.0, zero, zero, zero, zero))
        if -60.0 <= angle and angle not in angles_deg:
            continue
        flux = float(pass_profile(np.radians([angle - peak_deg]), beam_sigma_rad(10.0), 1.3)[0])
        spot = Spot(RAY, 1e5 * flux, 0.9, (0,))
        if flux > 0.01:
            candidate.add(time_s, spot, RAY, 5.0)
        else:
            candidate.share(time_s, None, None, 5.0)
    return finder.judge(candidate, 10.0 + 60.0 * per_deg, motion)


ALL = set(np.arange(-60.0, 61.0, FRAME_DEG).tolist())


def test_a_whole_pass_is_timed():
    found = judged(ALL)
    assert found is not None
    assert (found.time_s - 10.0) * 180.0 == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize(
    "missing",
    [
        {angle for angle in ALL if angle < 0.0},
        {angle for angle in ALL if angle > 0.0},
        {0.0, 6.0, 12.0},
    ],
)
def test_a_pass_without_a_flank_or_without_its_middle_is_not(missing):
    """Where the light came into view, went out of it, or was hidden by more than two frames, the peak is unknown."""
    assert judged(ALL - missing) is None


def test_one_frame_that_is_missing_beside_the_peak_costs_certainty():
    whole, lacking = judged(ALL), judged(ALL - {6.0})
    assert whole is not None
    assert lacking is not None
    assert lacking.sigma_rad > math.radians(1.7) > whole.sigma_rad
