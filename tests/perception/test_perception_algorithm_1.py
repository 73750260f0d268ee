"""Paper A's association as printed: what its steps keep, drop and name, and what predicted lights are good for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from perception_scenes import (
    ARRAY,
    CAMERA,
    LAYOUT,
    Motion,
    blue_detections,
    labels_by_detection,
    pixels_of,
    proprioception,
)

from auvdock.core.arrays import Array
from auvdock.core.contracts import Percept
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg

RING = LAYOUT.positions_m[ARRAY]
CFG = PerceptionCfg(association="algorithm_1")


class Approach:
    """A straight approach, rolled by so much, shown frame by frame."""

    def __init__(self, roll_rad: float = 0.1, seed: int = 0) -> None:
        self.rng = np.random.default_rng(seed)
        self.perception = BeaconPerception(CFG, CAMERA, LAYOUT)
        start, attitude = np.array([6.0, 0.6, 0.3]), np.array([roll_rad, 0.03, np.pi + 0.05])
        self.motion = Motion(start, attitude, np.array([-0.5, 0.0, 0.0]), np.zeros(3))
        self.frame = 0
        self.truth = np.eye(4)

    def show(
        self, frames: int = 1, hidden: tuple[int, ...] = (), extra: Array | None = None
    ) -> tuple[Percept, dict[int, int]]:
        """The last of so many frames, and {true beacon, -1 for a stray: identity} in it."""
        percept, named = None, {}
        for _ in range(frames):
            time_s = self.frame / 30.0
            self.frame += 1
            self.truth, euler = self.motion.at(time_s)
            visible = [index for index in range(6) if index not in hidden]
            centres = pixels_of(self.truth, RING[visible]) if visible else np.zeros((0, 2))
            if extra is not None:
                centres = np.vstack([centres, extra.reshape(-1, 2)])
            detections, order = blue_detections(self.rng, centres, 0.3)
            percept = self.perception.update(detections, proprioception(self.rng, euler, time_s))
            true = [visible[row] if row < len(visible) else -1 for row in order.tolist()]
            named = {true[row]: name for row, name in labels_by_detection(percept, detections).items()}
        assert percept is not None
        return percept, named

    def error_m(self, percept: Percept) -> float:
        assert percept.pose is not None
        return float(np.linalg.norm(percept.pose.T_station_camera[:3, 3] - self.truth[:3, 3]))


@settings(max_examples=20, deadline=None)
@given(roll_deg=st.floats(-25.0, 25.0))
def test_six_lights_are_named_rightly_up_to_half_of_their_spacing(roll_deg: float) -> None:
    _, named = Approach(np.radians(roll_deg)).show(6)
    assert named == {index: index for index in range(6)}


def test_beyond_half_of_their_spacing_every_name_is_the_neighbours() -> None:
    """No attitude enters: a ring of six turned by 45° looks like one turned by -15°. That is the price of step 3."""
    percept, named = Approach(np.radians(45.0)).show(6)
    assert sorted(named) == sorted(named.values()) == list(range(6))
    assert all(name != beacon for beacon, name in named.items())
    assert percept.pose is not None  # and its reprojection is as good as the right one's


@pytest.mark.parametrize("missing", range(6))
def test_a_light_without_its_partner_is_not_named(missing: int) -> None:
    """Five of six: their centroid moves by a fifth of the radius; only pairs that stay symmetric about it are named."""
    _, named = Approach().show(6, hidden=(missing,))
    assert (missing + 3) % 6 not in named
    assert all(named[beacon] == beacon for beacon in named)


def test_two_strays_off_the_ring_displace_the_centroid() -> None:
    """What our proposals by pairs are for: as printed, two far strays on one side cost all names."""
    far_off = np.array([[20.0, 20.0], [40.0, 60.0]])
    percept, named = Approach().show(10, extra=far_off)
    assert percept.pose is None or len(named) < 6


def test_hidden_lights_go_on_as_predicted_ones_for_ten_frames() -> None:
    approach = Approach()
    percept, _ = approach.show(10)
    assert percept.pose is not None
    assert percept.pose.measured
    for frame in range(10):
        percept, _ = approach.show(hidden=(0, 1, 2, 3, 4, 5))
        assert percept.pose is not None, frame
        assert not percept.pose.measured
        assert approach.error_m(percept) < 1.0  # by light alone
    percept, _ = approach.show(hidden=(0, 1, 2, 3, 4, 5))
    assert percept.pose is None


@pytest.mark.parametrize(("hidden", "solver"), [((), "sqpnp"), ((0, 3), "sqpnp")])
def test_predicted_lights_count_for_the_choice_of_the_solver(hidden: tuple[int, ...], solver: str) -> None:
    approach = Approach()
    approach.show(10)
    percept, _ = approach.show(3, hidden=hidden)
    assert percept.pose is not None
    assert percept.pose.measured
    assert percept.pose.solver == solver
    assert len(percept.pose.beacon_ids) == 6


def test_names_that_reproject_badly_are_cleared_and_given_anew() -> None:
    approach = Approach()
    approach.show(10)
    tracks = approach.perception.tracks
    carried = tracks.beacon_id >= 0
    tracks.beacon_id[carried] = np.roll(tracks.beacon_id[carried], 1)[::-1]
    _, named = approach.show()
    assert named == {index: index for index in range(6)}
