"""Turning circle and zig-zag against Prestero's planar equations, integrated independently.

No measured turning diameter of a REMUS 100 with rudder angle was at hand. The reference is Prestero's published model
itself, in the combined coefficients that he prints, with the crossflow drag of both of his tables: Y_vv = −131 (strip
theory; his Z_ww) and Y_vv = −1310 (his fit to sea runs). The package must reproduce the first, and lie in the range
that the two span.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sim_bench import command, run, simulator, start, trimmed

from auvdock.core.arrays import Array
from auvdock.sim.simulator import Simulator

THRUST_N = 3.84
"""Balances the drag at 1.54 m/s (Prestero 2001: 3.86 N)."""
MASS = np.array([[30.48 + 0.93, 0.0, 0.0], [0.0, 30.48 + 35.5, -1.93], [0.0, -1.93, 3.45 + 4.88]])


def derivative(nu: Array, rudder_rad: float, y_vv: float) -> Array:
    """(u̇, v̇, ṙ) in marine axes, neither roll nor pitch."""
    u, v, r = nu
    x = -1.62 * u * abs(u) + (35.5 + 30.48) * v * r - 1.93 * r * r + THRUST_N
    y = y_vv * v * abs(v) + 0.632 * r * abs(r) - 28.6 * u * v + (5.22 - 30.48) * u * r + 9.64 * u * u * rudder_rad
    n = -3.18 * v * abs(v) - 94.0 * r * abs(r) - 2.0 * u * r - 24.0 * u * v - 6.15 * u * u * rudder_rad
    return np.linalg.solve(MASS, [x, y, n])


def reference_diameter_m(rudder_rad: float, y_vv: float) -> float:
    solution = solve_ivp(
        lambda _, nu: derivative(nu, rudder_rad, y_vv), (0.0, 80.0), [1.54, 0.0, 0.0], rtol=1e-8, atol=1e-10
    )
    u, v, r = solution.y[:, -1]
    return 2.0 * math.hypot(u, v) / abs(r)


def cruising() -> Simulator:
    sim = simulator(trimmed())
    start(sim, nu_relative=np.array([1.54, 0.0, 0.0, 0.0, 0.0, 0.0]))
    return sim


@pytest.mark.parametrize("rudder_deg", [4.0, 10.0, 13.6])
def test_turning_circle(rudder_deg: float) -> None:
    """Steady diameter within 2 % of the planar reference (the hull heels and pitches a little), in its range."""
    sim = cruising()
    run(sim, 80.0, command(sim, stern=THRUST_N / 10.0, rudder=-math.radians(rudder_deg) / 0.2374))
    u, v, _, _, _, r = sim.truth.nu_body
    diameter = 2.0 * math.hypot(u, v) / abs(r)
    tight = reference_diameter_m(-math.radians(rudder_deg), -131.0)
    wide = reference_diameter_m(-math.radians(rudder_deg), -1310.0)
    assert diameter == pytest.approx(tight, rel=0.02)
    assert 0.98 * tight <= diameter <= wide
    # Negative rudder turns to starboard: heading falls when seen with z up.
    assert r < 0.0


def reference_zig_zag(y_vv: float, angle: float, seconds: float) -> Array:
    """Headings (rad, marine) of a zig-zag sampled at 120 Hz, rudder lag 0.1 s."""
    nu, heading, fin, order = np.array([1.54, 0.0, 0.0]), 0.0, 0.0, -1.0
    headings: list[float] = []
    dt = 1.0 / 1200.0
    for index in range(round(seconds / dt)):
        if order * heading < -angle:
            order = -order
        fin += dt / 0.1 * (order * angle - fin)
        nu = nu + dt * derivative(nu, fin, y_vv)
        heading += dt * float(nu[2])
        if index % 10 == 9:
            headings.append(heading)
    return np.array(headings)


def overshoots_and_period(headings: Array, angle: float) -> tuple[float, float]:
    """Mean of the first three overshoots beyond `angle` (rad), and mean time between same-way extremes (s)."""
    change = np.sign(np.diff(headings))
    extremes = np.flatnonzero(change[1:] * change[:-1] < 0.0) + 1
    peaks = np.abs(headings[extremes[:3]])
    return float(np.mean(peaks)) - angle, float(extremes[2] - extremes[0]) / 120.0


def test_zig_zag_10_10() -> None:
    """Overshoot within 5 % or 0.3° and period within 3 % of the planar reference."""
    angle = math.radians(10.0)
    sim = cruising()
    order, heading, headings = -1.0, 0.0, []
    for _ in range(round(30.0 * 120.0)):
        if order * heading < -angle:
            order = -order
        sim.step(command(sim, stern=THRUST_N / 10.0, rudder=order * angle / 0.2374))
        forward = sim.truth.T_world_body[:3, 0]
        heading = -math.atan2(forward[1], forward[0])
        headings.append(heading)
    overshoot, period = overshoots_and_period(np.array(headings), angle)
    expected_overshoot, expected_period = overshoots_and_period(reference_zig_zag(-131.0, angle, 30.0), angle)
    assert overshoot == pytest.approx(expected_overshoot, rel=0.05, abs=math.radians(0.3))
    assert period == pytest.approx(expected_period, rel=0.03)
    fitted_overshoot, _ = overshoots_and_period(reference_zig_zag(-1310.0, angle, 30.0), angle)
    assert fitted_overshoot < overshoot
