"""Authentication on 10,000 synthetic scenes, in seeded chunks.

A scene is an approach in the mid range: 2.5 to 12 m, up to 20° off the axis, roll within ±20°, every light in view,
0.3 to 0.7 m/s with up to 4 °/s of turning; detections with 0.5 px of noise in shuffled order; inclinometer wrong by
0.5° and compass by 2° (standard deviations, constant in a scene). In every other scene the far lamp, a seventh blue
light, is seen above the ring. Right means: every beacon detected in the last frame carries its own identity, and no
other light carries any.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from perception_scenes import (
    ARRAY,
    CAMERA,
    FAR,
    LAYOUT,
    Motion,
    attitude_bias,
    blue_detections,
    labels_by_detection,
    pixels_of,
    proprioception,
    random_motion,
)

from auvdock.core.arrays import Array, IntArray
from auvdock.core.contracts import Detections, Percept
from auvdock.core.errors import ConfigError
from auvdock.perception.authentication import AuthenticationCfg, Authenticator, symmetric_pairs
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg

CHUNK = 2500
CHUNKS = 4
RING = LAYOUT.positions_m[ARRAY]
RING_AND_FAR = LAYOUT.positions_m[[*ARRAY, FAR]]
SPURIOUS = 99


def spurious_lights(rng: np.random.Generator, lights_px: Array, count: int) -> Array:
    """Positions anywhere in the image, 6 px or more from the station's lights (nearer ones would merge)."""
    found: list[Array] = []
    while len(found) < count:
        place = rng.uniform([0.0, 0.0], [CAMERA.width_px, CAMERA.height_px])
        if np.linalg.norm(lights_px - place, axis=1).min() > 6.0:
            found.append(place)
    return np.array(found).reshape(-1, 2)


class Scene:
    """One approach, frame by frame."""

    def __init__(self, rng: np.random.Generator, with_far: bool, spurious: int) -> None:
        self.rng = rng
        self.points = RING_AND_FAR if with_far else RING
        self.motion: Motion = random_motion(rng, self.points)
        self.bias = attitude_bias(rng)
        self.stray = spurious_lights(rng, pixels_of(self.motion.at(0.0)[0], self.points), spurious)
        self.drift = rng.uniform(-10.0, 10.0, (spurious, 2))
        self.identity: IntArray = np.concatenate([np.arange(len(self.points)), np.full(spurious, SPURIOUS)])
        self.frame = 0

    def show(
        self, perception: BeaconPerception, frames: int, hidden: frozenset[int] = frozenset()
    ) -> tuple[bool, bool]:
        """Process frames; of the last: (all right behind a measured pose, any wrong behind a pose)."""
        visible = np.array([index for index, name in enumerate(self.identity.tolist()) if name not in hidden])
        for _ in range(frames - 1):
            self._step(perception, visible)
        percept, detections, order = self._step(perception, visible)
        truth = self.identity[visible][order].tolist()
        named = labels_by_detection(percept, detections)
        wanted = {row: name for row, name in enumerate(truth) if name < len(ARRAY)}
        wrong = any(wanted.get(row) != name for row, name in named.items())
        pose = percept.pose
        return named == wanted and pose is not None and pose.measured, wrong and pose is not None

    def _step(self, perception: BeaconPerception, visible: IntArray) -> tuple[Percept, Detections, IntArray]:
        time_s = self.frame / 30.0
        self.frame += 1
        T_station_camera, euler = self.motion.at(time_s)
        centres = np.vstack([pixels_of(T_station_camera, self.points), self.stray + self.drift * time_s])
        detections, order = blue_detections(self.rng, centres[visible])
        percept = perception.update(detections, proprioception(self.rng, euler, time_s, self.bias))
        return percept, detections, order


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_all_lights_then_three_of_six_missing(chunk: int):
    """10,000 scenes: right in ≥ 99.9 % after 4 frames with all lights, in ≥ 99 % 3 frames after losing 3 of 6.

    Published for a comparable array with 3 missing: 90.3 %. A wrong identity behind a pose: < 0.1 %. Held per chunk of
    2,500.
    """
    rng = np.random.default_rng([20240, chunk])
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT)
    right = right_missing = surviving = 0
    for index in range(CHUNK):
        scene = Scene(rng, with_far=index % 2 == 1, spurious=0)
        perception.reset()
        good, wrong = scene.show(perception, 4)
        right += good
        surviving += wrong
        hidden = frozenset(rng.permutation(6)[:3].tolist())
        good, wrong = scene.show(perception, 3, hidden)
        right_missing += good
        surviving += wrong
    assert right >= 0.999 * CHUNK
    assert right_missing >= 0.99 * CHUNK
    assert surviving < 0.001 * CHUNK


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_two_spurious_lights(chunk: int):
    """10,000 scenes with 2 lasting spurious lights: right in ≥ 99.9 % after 4 frames (published: 99.6 %).

    A wrong identity behind a pose: < 0.1 %. Held per chunk of 2,500.
    """
    rng = np.random.default_rng([20241, chunk])
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT)
    right = surviving = 0
    for index in range(CHUNK):
        scene = Scene(rng, with_far=index % 2 == 1, spurious=2)
        perception.reset()
        good, wrong = scene.show(perception, 4)
        right += good
        surviving += wrong
    assert right >= 0.999 * CHUNK
    assert surviving < 0.001 * CHUNK


def test_three_lights_last_beyond_the_prediction():
    """100 scenes, 3 of 6 hidden for 14 frames, longer than any prediction: identities and measured pose hold in 99."""
    rng = np.random.default_rng(20242)
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT)
    right = 0
    for _ in range(100):
        scene = Scene(rng, with_far=True, spurious=0)
        perception.reset()
        scene.show(perception, 4)
        good, _ = scene.show(perception, 14, frozenset(rng.permutation(6)[:3].tolist()))
        right += good
    assert right >= 99


def test_first_sight_with_a_beacon_missing():
    """300 scenes in which one beacon is never seen, with the far lamp and a spurious light: right in ≥ 99 %."""
    rng = np.random.default_rng(20243)
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT)
    right = 0
    for _ in range(300):
        scene = Scene(rng, with_far=True, spurious=1)
        perception.reset()
        hidden = frozenset([int(rng.integers(6))])
        good, _ = scene.show(perception, 4, hidden)
        right += good
    assert right >= 297


def test_wrong_compass_is_forgiven():
    """300 scenes with the compass 8° off (4 σ): identities right in ≥ 99 %."""
    rng = np.random.default_rng(20244)
    perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT)
    right = 0
    for _ in range(300):
        scene = Scene(rng, with_far=True, spurious=1)
        scene.bias = np.radians([0.5, 0.5, 8.0 * rng.choice([-1.0, 1.0])])
        perception.reset()
        good, _ = scene.show(perception, 4)
        right += good
    assert right >= 297


def test_opposite_pairs_of_the_ring():
    """Paper A's opposite pairs are (0, 3), (1, 4), (2, 5); an array without any gets all pairs."""
    assert symmetric_pairs(RING).tolist() == [[0, 3], [1, 4], [2, 5]]
    assert len(symmetric_pairs(RING[:5])) == 10


@pytest.mark.parametrize(
    ("field", "value"),
    [("min_beacons", 3), ("max_angle_deg", 0.0), ("min_confidence", 1.5), ("min_occurrences", 0), ("tolerance", 0.0)],
)
def test_bad_setting_is_refused(field: str, value: Any):
    with pytest.raises(ConfigError, match=field):
        AuthenticationCfg(**{field: value})


@pytest.mark.parametrize("roll_deg", [-13.0, 0.0, 7.0])
def test_identities_from_an_arc(roll_deg: float):
    """Four lamps side by side, no two opposite, of a ring of eight: named from every pair, not from opposite ones.

    The vehicle takes itself as upright and is rolled; each lamp is off by 0.3 px.
    """
    angle = np.radians(np.arange(64.0, -296.0, -45.0))
    ring = np.column_stack([np.zeros(8), np.cos(angle), np.sin(angle)])
    upright = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    c, s = np.cos(np.radians(roll_deg)), np.sin(np.radians(roll_deg))
    rolled = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ upright
    points = ring @ rolled.T + np.array([0.4, 1.0, 4.5])
    rng = np.random.default_rng(0)
    seen = np.array([7, 0, 1, 6])
    xy = points[seen, :2] / points[seen, 2:] + rng.normal(0.0, 0.3 / 600.0, (4, 2))
    every = Authenticator(AuthenticationCfg(pairs="every"), ring, 600.0).propose(xy, upright)
    expected = np.full(8, -1)
    expected[seen] = np.arange(4)
    np.testing.assert_array_equal(every[0], expected)
    assert len(Authenticator(AuthenticationCfg(), ring, 600.0).propose(xy, upright)) == 0
