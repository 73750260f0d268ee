"""Allocation: exact within reach, along the direction beyond it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from auvdock.controllers.allocation import AllocationCfg, ThrustAllocator
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import load_vehicle

PUBLISHED = load_vehicle("remus_hybrid")
VEHICLE = dataclasses.replace(
    PUBLISHED, actuators=tuple(dataclasses.replace(actuator, dead_band=0.0) for actuator in PUBLISHED.actuators)
)
COUNT = len(VEHICLE.actuators)
ALLOCATOR = ThrustAllocator(VEHICLE)
commands = st.lists(st.floats(-1.0, 1.0), min_size=COUNT, max_size=COUNT).map(np.array)
speeds = st.floats(-1.5, 2.5)
wrenches = st.lists(st.floats(-80.0, 80.0), min_size=6, max_size=6).map(np.array)
GROUPS = ([0], [1, 5], [2, 4])


@given(command=commands, surge=speeds)
@settings(max_examples=300, deadline=None)
def test_every_feasible_wrench_is_reproduced(command, surge):
    wrench = ALLOCATOR.effectiveness(surge) @ command
    given_command, achieved = ALLOCATOR.solve(wrench, surge)
    assert np.abs(given_command).max() <= 1.0
    np.testing.assert_allclose(ALLOCATOR.effectiveness(surge) @ given_command, wrench, atol=1e-6)
    np.testing.assert_allclose(achieved, wrench, atol=1e-6)


@given(wrench=wrenches, surge=speeds)
@settings(max_examples=100, deadline=None)
def test_beyond_reach_each_plane_keeps_its_direction_and_its_greatest_length(wrench, surge):
    command = ALLOCATOR.allocate(wrench, surge)
    effect = ALLOCATOR.effectiveness(surge)
    achieved = effect @ command
    assert np.abs(command).max() <= 1.0
    for rows in GROUPS:
        # Outside reference: the greatest λ with B c = λ τ and |c| <= 1, by SciPy's linear programming.
        columns = [index for index in range(COUNT) if np.abs(VEHICLE.thruster_wrenches_body[rows, index]).max() > 0]
        equality = np.hstack([effect[np.ix_(rows, columns)], -wrench[rows, None]])
        best = linprog(
            [0.0] * len(columns) + [-1.0],
            A_eq=equality,
            b_eq=np.zeros(len(rows)),
            bounds=[(-1.0, 1.0)] * len(columns) + [(0.0, 1.0)],
        )
        np.testing.assert_allclose(achieved[rows], best.x[-1] * wrench[rows], atol=1e-4)


@given(wrench=wrenches, surge=speeds)
@settings(max_examples=100, deadline=None)
def test_moments_first_gives_the_whole_moment_when_it_can(wrench, surge):
    wrench = wrench * np.array([1.0, 1.0, 1.0, 0.0, 0.08, 0.08])
    command, _ = ALLOCATOR.solve(wrench, surge, moments_first=True)
    achieved = ALLOCATOR.effectiveness(surge) @ command
    assert np.abs(command).max() <= 1.0 + 1e-9
    moment_only, _ = ALLOCATOR.solve(wrench * np.array([0, 0, 0, 0, 1, 1]), surge)
    if np.abs(moment_only).max() < 1.0:
        np.testing.assert_allclose(achieved[4:], wrench[4:], atol=1e-6)
        assert achieved[1] * wrench[1] >= -1e-6
        assert abs(achieved[1]) <= abs(wrench[1]) + 1e-6


def test_commands_are_of_least_weighted_effort():
    """Any other solution, along the null space, costs more."""
    wrench, surge = np.array([3.0, 5.0, -4.0, 0.0, 0.5, 0.8]), 1.2
    command = ALLOCATOR.allocate(wrench, surge)
    weight = np.array([0.1 if actuator.kind == "fin" else 1.0 for actuator in VEHICLE.actuators])
    cost = float(weight @ command**2)
    _, _, rows = np.linalg.svd(ALLOCATOR.effectiveness(surge)[[0, 1, 2, 4, 5]])
    for null in rows[5:]:
        for step in (-0.05, 0.05):
            assert float(weight @ (command + step * null) ** 2) > cost


def test_fins_take_over_as_speed_grows():
    wrench = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    rudder = VEHICLE.actuator_names.index("rudder")
    slow, fast = (
        ALLOCATOR.allocate(wrench, speed)[rudder] * ALLOCATOR.effectiveness(speed)[5, rudder] for speed in (0.2, 2.0)
    )
    assert ALLOCATOR.allocate(wrench, 0.0)[rudder] == 0.0
    assert 0.0 < 10.0 * slow < fast
    # Going astern the rudder works the other way.
    assert ALLOCATOR.allocate(wrench, 1.0)[rudder] * ALLOCATOR.allocate(wrench, -1.0)[rudder] < 0.0


def test_dead_band_is_never_commanded_into():
    allocator = ThrustAllocator(PUBLISHED)
    band = np.array([actuator.dead_band for actuator in PUBLISHED.actuators])
    rng = np.random.default_rng(1)
    for _ in range(200):
        wrench = rng.normal(size=6) * rng.choice([0.05, 0.5, 5.0])
        command = allocator.allocate(wrench, 0.5)
        assert np.all((command == 0.0) | (np.abs(command) >= band))
        exact = ThrustAllocator(VEHICLE).allocate(wrench, 0.5)
        assert np.all(np.abs(command - exact) <= 0.5 * band + 1e-9)


def test_general_thruster_layouts_go_through_the_pseudo_inverse():
    """Four vectored thrusters share surge, sway and yaw: a group of three axes."""
    base = VEHICLE.actuators[0]
    corner = [
        dataclasses.replace(base, name=f"t{i}", position_m=(x, y, 0.0), direction=(0.7071, s * 0.7071, 0.0))
        for i, (x, y, s) in enumerate([(0.2, 0.1, -1.0), (0.2, -0.1, 1.0), (-0.2, 0.1, 1.0), (-0.2, -0.1, -1.0)])
    ]
    vehicle = dataclasses.replace(VEHICLE, actuators=tuple(corner))
    allocator = ThrustAllocator(vehicle)
    command = np.array([0.3, -0.2, 0.4, 0.1])
    wrench = vehicle.thruster_wrenches_body @ command
    np.testing.assert_allclose(vehicle.thruster_wrenches_body @ allocator.allocate(wrench, 0.0), wrench, atol=1e-6)
    beyond = vehicle.thruster_wrenches_body @ allocator.allocate(10.0 * wrench, 0.0)
    assert float(beyond @ wrench) / np.linalg.norm(beyond) / np.linalg.norm(wrench) == pytest.approx(1.0, abs=1e-9)


def test_wrong_shape_and_weight_are_refused():
    with pytest.raises(ValueError, match="wrench_body"):
        ALLOCATOR.allocate(np.zeros(5), 0.0)
    with pytest.raises(ConfigError, match="fin_weight"):
        AllocationCfg(fin_weight=0.0)
