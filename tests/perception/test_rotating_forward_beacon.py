"""The rotating beacon among other lights: named by its rhythm alone, timed between frames."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from rotating_scenes import CAMERA, Scene, azimuth_errors_rad

from auvdock.core.contracts import Detections, Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.forward_beacon import ForwardBeacon

FAR_LAMP = {(0.3, 0.0, -0.25): lambda _: 3e4}
ARRAY = {(0.3, math.cos(a), -1.6 + math.sin(a)): (lambda _: 4e4) for a in np.arange(6) * math.pi / 3 + 0.5}
FEW = settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    phases=(Phase.generate,),
    suppress_health_check=[HealthCheck.too_slow],
)

SCENES = {
    "static": Scene(),
    "behind, unknown datum": Scene(position_m=(-30.0, 5.0, 0.0), datum_rad=2.0),
    "narrow beam, three frames": Scene(widening=1.02, faint=0.15),
    "wide beam": Scene(widening=2.2, faint=0.05),
    "moving": Scene(velocity_m_s=(0.0, 0.5)),
    "turning": Scene(turn_rad_s=0.05, yaw_rad=math.pi - 0.4),
    "one frame in five dropped": Scene(drop_every=5),
    "far lamp just below": Scene(others=FAR_LAMP),
    "all lamps, near": Scene(position_m=(9.0, 0.0, -1.6), others={**FAR_LAMP, **ARRAY}),
    "second steady light": Scene(others={(0.0, 6.0, 0.0): lambda _: 9e4}),
}


@pytest.mark.parametrize("name", SCENES)
def test_azimuth_of_single_passes(name: str) -> None:
    """A fix for nearly every turn from the third on, each within 1°, with a sigma that covers it."""
    fixes, _ = SCENES[name].run(14.0, np.random.default_rng(3))
    assert len(fixes) >= 3
    errors = np.degrees(np.abs(azimuth_errors_rad(fixes)))
    assert errors.max() < 1.0
    assert errors.mean() < 0.35
    for (fix, _), error in zip(fixes, errors, strict=True):
        assert error < 4.5 * math.degrees(fix.sigma_rad)


def test_a_clock_error_goes_straight_into_the_azimuth() -> None:
    """50 ms at 0.5 rev/s are 9°, and nothing in the fix can tell."""
    fixes, _ = Scene(clock_offset_s=0.05).run(10.0, np.random.default_rng(4))
    assert np.degrees(azimuth_errors_rad(fixes)) == pytest.approx(np.full(len(fixes), 9.0), abs=0.5)


def test_the_deviation_angle_is_the_ray_to_the_beacon() -> None:
    """Within 0.1° of the true direction in the camera frame at the time of the pass, while the vehicle turns."""
    scene = Scene(position_m=(20.0, 8.0, -1.0), yaw_rad=math.pi, turn_rad_s=0.04)
    rng = np.random.default_rng(5)
    start = float(np.random.default_rng(5).uniform(0.0, 10.0))
    fixes, _ = scene.run(12.0, rng)
    assert len(fixes) >= 2
    for fix, _ in fixes:
        rotation, place, _ = scene.camera_at(fix.time_s - start)
        ray = rotation.T @ (-place / np.linalg.norm(place))
        assert math.degrees(math.acos(min(1.0, float(ray @ fix.bearing.ray_camera)))) < 0.1


def test_range_from_own_motion_and_none_without() -> None:
    """Twelve metres across the line of sight give the range within 5 %; a vehicle at rest has none."""
    scene = Scene(position_m=(35.0, -6.0, 0.0), velocity_m_s=(0.0, 0.6), datum_rad=-1.0)
    fixes, forward = scene.run(20.0, np.random.default_rng(6))
    estimate = forward.estimate
    assert estimate is not None
    assert fixes[-1][0].bearing.range_m == pytest.approx(35.0, rel=0.05)
    assert estimate.sigma_range_m < 2.0
    still, _ = Scene().run(10.0, np.random.default_rng(6))
    assert all(fix.bearing.range_m is None for fix, _ in still)


def test_the_stations_heading_follows_from_bearing_and_azimuth() -> None:
    """ψ_s = compass bearing + π - azimuth: the datum of the compass, for the station's axis is the world's x."""
    for datum in (-2.5, 0.3, 3.0):
        _, forward = Scene(position_m=(5.0, 22.0, 0.0), datum_rad=datum).run(12.0, np.random.default_rng(7))
        estimate = forward.estimate
        assert estimate is not None
        assert abs(math.remainder(estimate.axis_yaw_rad - datum, math.tau)) < math.radians(0.6)
        assert estimate.turns >= 3


@FEW
@given(
    st.floats(1e3, 3e5),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 0.3),
    st.floats(0.1, 7.0),
    st.integers(0, 10_000),
)
def test_steady_and_swelling_lights_are_never_the_beacon(
    flux: float, turn: float, depth: float, frequency: float, seed: int
) -> None:
    """Steady lamps, lamps that swell at any frequency by up to 30 %, while the vehicle turns: no fix."""
    scene = Scene(
        beacon_on=False,
        turn_rad_s=0.05 * turn,
        others={
            (0.0, 6.0, 0.0): lambda t: flux * (1.0 + depth * math.sin(math.tau * frequency * t)),
            **FAR_LAMP,
        },
    )
    fixes, _ = scene.run(12.0, np.random.default_rng(seed))
    assert fixes == []


@FEW
@given(st.floats(0.2, 0.8), st.integers(0, 10_000))
def test_flickering_and_flashing_lights_are_never_the_beacon(sigma: float, seed: int) -> None:
    """Log-normal flicker from frame to frame, and flashes of the beam's own form at random times: no fix in 20 s."""
    rng = np.random.default_rng(seed)
    flicker = np.exp(sigma * rng.standard_normal(1300))
    flashes = np.cumsum(rng.exponential(2.0, 60))
    scene = Scene(
        beacon_on=False,
        others={
            (0.0, 6.0, 0.0): lambda t: 8e4 * float(flicker[int(t * 30.0)]),
            (0.0, -6.0, 0.0): lambda t: 8e4 * float(np.exp(-0.5 * ((t - flashes) / 0.04) ** 2).sum()),
        },
    )
    fixes, _ = scene.run(20.0, np.random.default_rng(seed))
    assert fixes == []


@pytest.mark.parametrize("rate", [0.37, 0.66, 1.0])
def test_a_beacon_of_another_rate_is_not_ours(rate: float) -> None:
    """A second rotating beacon at another rate is passed over, whether ours is on or not."""
    period = 1.0 / rate

    def other(t: float) -> float:
        return 2e5 * math.exp(-0.5 * (math.remainder(t, period) / 0.04) ** 2)

    alone = Scene(beacon_on=False, others={(0.0, 7.0, 0.0): other})
    assert alone.run(14.0, np.random.default_rng(8))[0] == []
    both = dataclasses.replace(alone, beacon_on=True)
    fixes, _ = both.run(14.0, np.random.default_rng(8))
    assert len(fixes) >= 3
    assert np.degrees(np.abs(azimuth_errors_rad(fixes))).max() < 1.0


def test_the_beacons_detections_are_masked_while_it_is_lit() -> None:
    """Once known, its detections are marked; lamps metres away never are."""
    scene = Scene(position_m=(12.0, 0.0, 0.0), others=ARRAY)
    forward = ForwardBeacon(ForwardBeaconCfg(), CAMERA, scene.beacon)
    marked, known = 0, False
    for detections, sample in scene.frames(12.0, np.random.default_rng(9)):
        known = forward.update(detections, sample) is not None or known
        assert forward.mask.shape == (len(detections),)
        if forward.mask.any():
            assert known
            assert forward.mask.sum() == 1
            row = int(forward.mask.argmax())
            assert abs(float(detections.centre_px[row, 1]) - (CAMERA.height_px - 1) / 2) < 4.0
            marked += 1
    assert marked >= 10


def test_nothing_seen_nothing_said() -> None:
    """Frames without a light, before and after reset."""
    forward = ForwardBeacon(ForwardBeaconCfg(), CAMERA, RotatingBeaconCfg())
    zero = np.zeros(3)
    for k in range(5):
        assert forward.update(Detections.empty(), Proprioception(k / 30.0, 8.0, zero, zero, zero, zero)) is None
    forward.reset()
    assert forward.estimate is None
    assert forward.update(Detections.empty(), Proprioception(0.0, 8.0, zero, zero, zero, zero)) is None


def test_the_same_sight_gives_the_same_bits() -> None:
    """Nothing is drawn in perception."""
    one, two = (Scene().run(9.0, np.random.default_rng(2))[0] for _ in range(2))
    assert [fix.azimuth_rad for fix, _ in one] == [fix.azimuth_rad for fix, _ in two]


def test_senseless_settings_are_refused() -> None:
    """One flash is no rotation."""
    with pytest.raises(ConfigError, match="min_turns"):
        ForwardBeaconCfg(min_turns=1)
    with pytest.raises(ConfigError, match="gate_deg"):
        ForwardBeaconCfg(gate_deg=0.0)
