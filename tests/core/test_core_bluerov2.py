"""BlueROV2 Heavy's data: published figures arrive in the matrices, thrusters span all axes, damping takes energy."""

from __future__ import annotations

import numpy as np
import pytest

from auvdock.core.marine import flip_matrix, flip_twist
from auvdock.core.vehicle import load_vehicle

VEHICLE = load_vehicle("bluerov2_heavy")


def test_mass_matrix_is_von_benzons_moved_to_the_centre_of_buoyancy() -> None:
    """Table A1: m = 13.5, I = (0.26, 0.23, 0.37) about the centre of gravity, added mass (6.36 … 0.222)."""
    mass = flip_matrix(VEHICLE.rigid_body_mass_body + VEHICLE.added_mass_body)
    shift = 13.5 * 0.01**2
    expected = [13.5 + 6.36, 13.5 + 7.12, 13.5 + 18.68, 0.26 + shift + 0.189, 0.23 + shift + 0.135, 0.37 + 0.222]
    np.testing.assert_allclose(np.diag(mass), expected, rtol=1e-12)
    assert np.linalg.eigvalsh(mass).min() > 0.0
    assert mass[0, 4] == pytest.approx(13.5 * 0.01)


def test_damping_only_takes_energy() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        nu = rng.normal(size=6)
        drag = VEHICLE.linear_damping_body @ nu + VEHICLE.quadratic_damping_body @ (np.abs(nu) * nu)
        assert float(nu @ drag) < 0.0


def test_eight_thrusters_span_all_six_axes_and_mirror_each_other() -> None:
    wrenches = VEHICLE.thruster_wrenches_body
    assert np.linalg.matrix_rank(wrenches) == 6
    # The vehicle is its own mirror image: port and starboard thrusters pair up (x, z, pitch equal; y, roll, yaw not).
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(wrenches[:, 0::2] * mirror[:, None], wrenches[:, 1::2], atol=1e-12)
    for actuator in VEHICLE.actuators[:4]:
        assert abs(actuator.direction[0]) == pytest.approx(np.sqrt(0.5), abs=1e-5)
        assert actuator.direction[2] == 0.0


def test_slightly_buoyant_and_stable() -> None:
    """2 N to 3 N light, restoring moment m g BG sin φ with BG = 0.01 m."""
    assert 2.0 < VEHICLE.buoyancy_n - VEHICLE.mass_kg * 9.81 < 3.0
    assert VEHICLE.centre_of_gravity_body_m[2] == pytest.approx(-0.01)


def test_seat_is_below_the_frame_and_the_hull_axis_of_the_torpedo() -> None:
    assert load_vehicle("remus_hybrid").seat_m == (0.0, 0.0, 0.0)
    below = VEHICLE.seat_m[2] - 0.0955
    assert below > VEHICLE.radius_m
    assert flip_twist(np.array([*VEHICLE.seat_m, 0.0, 0.0, 0.0]))[2] == -0.28
