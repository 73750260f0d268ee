"""Perception of a whole station with a rotating beacon: azimuth in the percept, and the array left in peace."""

import math

import numpy as np
import pytest
from perception_scenes import ARRAY, CAMERA, FAR, LAYOUT, pixels_of

from auvdock.core.arrays import Array
from auvdock.core.contracts import BLUE, AzimuthFix, Detections, Percept, Proprioception
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx, wrap_angle
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg
from auvdock.perception.rotating.profile import beam_sigma_rad, pass_profile

BEACON = RotatingBeaconCfg()
LAMPS = np.vstack([LAYOUT.positions_m[ARRAY], LAYOUT.positions_m[[FAR]], [BEACON.position_m]])
LIGHT = np.array([4e4] * len(ARRAY) + [3e4])


def _fly(
    perception: BeaconPerception, body_m: Array, datum_rad: float, duration_s: float, beacon_on: bool = True
) -> list[Percept]:
    """A vehicle at rest that looks at the mouth; its compass reads `datum_rad` too much."""
    rng = np.random.default_rng(1)
    yaw = math.atan2(-body_m[1], -body_m[0])
    rotation = rotation_from_euler_zyx(0.0, 0.0, yaw)
    T_station_camera = make_transform(rotation @ CAMERA.T_body_camera[:3, :3], body_m + rotation @ [0.61, 0.0, 0.0])
    azimuth = math.atan2(T_station_camera[1, 3] - BEACON.position_m[1], T_station_camera[0, 3] - BEACON.position_m[0])
    pixels = pixels_of(T_station_camera, LAMPS)
    zero, percepts = np.zeros(3), []
    for k in range(round(30 * duration_s)):
        time_s = k / 30.0
        off = np.array([wrap_angle(BEACON.azimuth_rad(time_s) - azimuth)])
        flash = 2e5 * float(pass_profile(off, beam_sigma_rad(10.0), 1.2)[0]) if beacon_on else 0.0
        flux = np.append(LIGHT, flash) * (1.0 + 0.03 * rng.standard_normal(len(LAMPS)))
        seen = flux > 4e3
        n = int(seen.sum())
        centres = pixels[seen] + 0.2 * rng.standard_normal((n, 2))
        detections = Detections.from_points(centres, np.full(n, 0.9), np.full(n, BLUE, dtype=np.int64), flux=flux[seen])
        euler = np.array([0.0, 0.0, yaw + datum_rad]) + 0.0035 * rng.standard_normal(3)
        percepts.append(perception.update(detections, Proprioception(time_s, 8.0, euler, zero, zero, zero)))
    return percepts


@pytest.mark.parametrize("datum_rad", [0.0, 2.0])
def test_array_and_beacon_side_by_side(datum_rad: float) -> None:
    """The beacon gives azimuths, the array its poses on six beacons of its own, whatever the compass calls north."""
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT, BEACON, heading_surveyed=False)
    place = np.array([8.0, 1.5, 0.0])
    percepts = _fly(perception, place, datum_rad, 9.0)
    fixes: list[AzimuthFix] = [percept.azimuth for percept in percepts if percept.azimuth is not None]
    assert len(fixes) >= 2
    true = math.atan2(place[1] * (1 - 0.61 / np.hypot(*place[:2])), place[0] * (1 - 0.61 / np.hypot(*place[:2])) + 0.3)
    for fix in fixes:
        assert abs(wrap_angle(fix.azimuth_rad - true)) < math.radians(1.0)
    late = [percept for percept in percepts[-90:] if percept.pose is not None]
    assert len(late) > 80
    places = np.array([percept.pose.T_station_camera[:2, 3] for percept in late if percept.pose is not None])
    np.testing.assert_allclose(np.median(places, axis=0), place[:2] * (1 - 0.61 / 8.14), atol=0.15)
    # A weak array at 8 m leaves its heading to some 2° in single frames.
    assert np.abs(places - np.median(places, axis=0)).max() < 0.6


def test_without_a_beacon_the_lamps_tell_where_the_front_is() -> None:
    """Heading unknown and no beacon: poses from the facing assumption, 10° beside the axis."""
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT, None, heading_surveyed=False)
    place = np.array([8.0, 1.4, 0.0])
    percepts = _fly(perception, place, 1.0, 2.0, beacon_on=False)
    poses = [percept.pose for percept in percepts[-20:] if percept.pose is not None]
    assert len(poses) >= 18
    assert all(percept.azimuth is None for percept in percepts)
    for pose in poses:
        np.testing.assert_allclose(pose.T_station_camera[:2, 3], place[:2] * (1 - 0.61 / 8.12), atol=0.4)


def test_reset_forgets_the_beacon() -> None:
    """After a reset a few frames give no azimuth, as at the start."""
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT, BEACON)
    place = np.array([8.0, 1.5, 0.0])
    assert any(percept.azimuth is not None for percept in _fly(perception, place, 0.0, 8.0))
    perception.reset()
    assert all(percept.azimuth is None for percept in _fly(perception, place, 0.0, 3.0))
