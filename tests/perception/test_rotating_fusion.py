"""Several turns together, and the camera's own motion between them."""

import math

import numpy as np
import pytest
from rotating_scenes import CAMERA

from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx, wrap_angle
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.fusion import Sweep, fuse
from auvdock.perception.rotating.motion import CameraMotion

CFG = ForwardBeaconCfg()


def _sweeps(places_m: Array, beacon_m: Array, axis_rad: float, noise: Array, sigma_rad: float = 0.004) -> list[Sweep]:
    """Sweeps of a beacon from places (n, 2); `noise` (n, 2) in standard deviations of bearing and azimuth."""
    found: list[Sweep] = []
    for k, place in enumerate(places_m):
        east, north = (beacon_m - place).tolist()
        bearing = math.atan2(north, east)
        azimuth = wrap_angle(bearing + math.pi - axis_rad + sigma_rad * float(noise[k, 1]))
        seen = wrap_angle(bearing + CFG.bearing_sigma_rad * float(noise[k, 0]))
        found.append(Sweep(2.0 * k, azimuth, sigma_rad, seen, place))
    return found


@pytest.mark.parametrize("axis_rad", [-3.0, 0.0, 1.0])
def test_exact_sights_give_the_exact_place(axis_rad: float) -> None:
    """20 m of way across a beacon 30 m off: range, bearing and axis, up to what the prior on the range weighs."""
    places = np.column_stack([np.zeros(11), np.linspace(-10.0, 10.0, 11)])
    estimate = fuse(_sweeps(places, np.array([30.0, 4.0]), axis_rad, np.zeros((11, 2))), CFG)
    assert estimate.range_m == pytest.approx(math.hypot(30.0, 6.0), rel=0.01)
    assert estimate.bearing_rad == pytest.approx(math.atan2(-6.0, 30.0), abs=1e-3)
    assert abs(wrap_angle(estimate.axis_yaw_rad - axis_rad)) < 1e-3
    np.testing.assert_allclose(estimate.beacon_m, [30.0, 4.0], atol=0.3)


def test_stated_deviations_are_honest() -> None:
    """200 noisy runs: range, axis and azimuth scatter as stated, within 25 %."""
    rng = np.random.default_rng(0)
    places = np.column_stack([np.linspace(0.0, 3.0, 10), np.linspace(0.0, 9.0, 10)])
    beacon, axis = np.array([28.0, 0.0]), 0.4
    true_range = float(np.hypot(*(beacon - places[-1])))
    true_azimuth = math.atan2(-9.0, 25.0) + math.pi - axis
    scores: list[tuple[float, float, float]] = []
    for _ in range(200):
        estimate = fuse(_sweeps(places, beacon, axis, rng.standard_normal((10, 2))), CFG)
        scores.append(
            (
                (estimate.range_m - true_range) / estimate.sigma_range_m,
                wrap_angle(estimate.axis_yaw_rad - axis) / estimate.sigma_axis_rad,
                wrap_angle(estimate.azimuth_rad - true_azimuth) / estimate.sigma_azimuth_rad,
            )
        )
    spread = np.sqrt(np.mean(np.square(scores), axis=0))
    assert (spread > 0.65).all()
    assert (spread < 1.25).all()


@pytest.mark.parametrize("count", [1, 2, 8])
def test_the_same_sweep_again_and_again_still_gives_numbers(count: int) -> None:
    """No parallax, and sights that contradict one another by half a turn: finite numbers."""
    sweep = Sweep(0.0, 1.0, 0.0, 2.0, np.zeros(2))
    for sweeps in ([sweep] * count, [sweep, sweep._replace(bearing_rad=2.0 - math.pi)] * count):
        estimate = fuse(sweeps, ForwardBeaconCfg())
        assert np.isfinite(np.concatenate([np.atleast_1d(part) for part in estimate])).all()


def test_without_parallax_the_range_is_the_priors() -> None:
    """At rest, and with one sight alone, the range is unknown and says so; no sight is an error."""
    still = fuse(_sweeps(np.zeros((6, 2)), np.array([40.0, 0.0]), 0.0, np.zeros((6, 2))), CFG)
    assert still.sigma_range_m > CFG.range_share * still.range_m
    assert still.turns == 6
    one = fuse(_sweeps(np.zeros((1, 2)), np.array([40.0, 0.0]), 0.0, np.zeros((1, 2))), CFG)
    assert one.sigma_range_m > CFG.range_share * one.range_m
    with pytest.raises(ValueError, match="nothing"):
        fuse([], CFG)


def test_one_wild_azimuth_does_little_harm() -> None:
    """A pass that is 5° off among twelve moves the axis by less than 0.3°."""
    places = np.column_stack([np.zeros(12), np.linspace(0.0, 11.0, 12)])
    noise = np.zeros((12, 2))
    noise[6, 1] = math.radians(5.0) / 0.004
    estimate = fuse(_sweeps(places, np.array([30.0, 0.0]), 0.2, noise), CFG)
    assert abs(wrap_angle(estimate.axis_yaw_rad - 0.2)) < math.radians(0.3)


def test_dead_reckoning_of_the_camera() -> None:
    """A circle flown at 0.5 m/s and 0.1 rad/s with the sensors' noise: the camera's place within 0.15 m after 40 s."""
    rng = np.random.default_rng(3)
    motion, dt = CameraMotion(CAMERA), 1.0 / 30.0
    lever = CAMERA.T_body_camera[:3, 3]
    place = np.zeros(3)
    start = camera = place + lever
    for k in range(1200):
        yaw = 0.1 * k * dt
        rotation = rotation_from_euler_zyx(0.0, 0.0, yaw)
        camera = place + rotation @ lever
        euler = np.array([0.0, 0.0, wrap_angle(yaw + 1.0)]) + 0.0035 * rng.standard_normal(3)
        gyro = np.array([0.0, 0.0, 0.1]) + 0.0005 * rng.standard_normal(3)
        velocity = np.array([0.5, 0.0, 0.0]) + 0.003 * rng.standard_normal(3)
        motion.update(Proprioception(k * dt, 5.0, euler, gyro, velocity, np.zeros(3)))
        place = place + dt * (rotation @ np.array([0.5, 0.0, 0.0]))
    turned = rotation_from_euler_zyx(0.0, 0.0, 1.0) @ (camera - start)
    np.testing.assert_allclose(motion.now.place_m, turned[:2], atol=0.15)
    between = motion.at(motion.now.time_s - 0.5 * dt)
    np.testing.assert_allclose(between.R_compass_camera.T @ between.R_compass_camera, np.eye(3), atol=1e-9)


def test_attitude_noise_is_steadied() -> None:
    """Compass noise of 0.2° a frame leaves less than 0.05° after ten seconds."""
    rng = np.random.default_rng(4)
    motion, yaws = CameraMotion(CAMERA), []
    for k in range(600):
        euler = np.array([0.0, 0.0, 0.7]) + 0.0035 * rng.standard_normal(3)
        gyro = 0.0005 * rng.standard_normal(3)
        now = motion.update(Proprioception(k / 30.0, 5.0, euler, gyro, np.zeros(3), np.zeros(3)))
        forward = now.R_compass_camera[:, 2]
        yaws.append(math.atan2(float(forward[1]), float(forward[0])))
    assert np.std(yaws[300:]) < math.radians(0.05)
    assert np.mean(yaws[300:]) == pytest.approx(0.7, abs=math.radians(0.05))
