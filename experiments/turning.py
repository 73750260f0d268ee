"""The hybrid AUV's course and pitch stability and its turning beside published models of REMUS 100.

Prestero (2001) and Sgarioto (2006, after Fodrea 2002; printed by Hall and Anstee 2011) fitted their sets to sea runs of
the vehicle at 1.54 m/s; both are integrated here at that speed as they are printed. Fossen's remus100 (Python Vehicle
Simulator) is built from formulas for a 1.6 m hull whose Munk moment is set to 0; its radius is a figure of its own code
at 900 rpm, 1.5 m/s. The measured turns themselves are not at hand: what two fits of them agree on stands for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from auvdock.controllers.linear_model import hydrodynamic_wrench, linearise
from auvdock.core.arrays import Array
from auvdock.core.marine import flip_twist
from auvdock.core.vehicle import VehicleCfg

__all__ = [
    "FOSSEN",
    "PRESTERO",
    "SGARIOTO",
    "SPEED_M_S",
    "PlanarSet",
    "Turn",
    "course_eigenvalues",
    "pitch_eigenvalues",
    "turn",
]

SPEED_M_S = 1.54
"""Of both fits' sea runs."""
FOSSEN = {2.0: 97.3, 4.0: 56.3, 13.6: 22.4}
"""Radius in m by rudder angle in degrees of Fossen's remus100 at 900 rpm, steady after 400 s (1.50 m/s)."""
_LATERAL, _PITCHING = (1, 5), (2, 4, 7)
"""Sway and yaw; heave, pitch rate and pitch: rows of the linearised state."""
_SETTLED_S = 200.0


@dataclass(frozen=True)
class PlanarSet:
    """A published horizontal model, marine axes: (Y, N) by v, r and rudder angle at the speed u, added mass included.

    Y = Y_uv u v + (Y_ur - m) u r + Y_vv v|v| + Y_rr r|r| + Y_uudr u² δ, N likewise without m.
    """

    name: str
    y_uv: float
    y_ur: float
    n_uv: float
    n_ur: float
    y_uudr: float
    n_uudr: float
    y_vv: float = 0.0
    y_rr: float = 0.0
    n_vv: float = 0.0
    n_rr: float = 0.0

    def forces(self, speed_m_s: float, sway_m_s: float, yaw_rad_s: float, rudder_rad: float) -> Array:
        """(2,) Y and N."""
        u, v, r = speed_m_s, sway_m_s, yaw_rad_s
        y = self.y_uv * u * v + (self.y_ur - _MASS_KG) * u * r + self.y_vv * v * abs(v) + self.y_rr * r * abs(r)
        n = self.n_uv * u * v + self.n_ur * u * r + self.n_vv * v * abs(v) + self.n_rr * r * abs(r)
        return np.array([y + self.y_uudr * u * u * rudder_rad, n + self.n_uudr * u * u * rudder_rad])


_MASS_KG = 30.48
_INERTIA = np.array([[_MASS_KG + 35.5, -1.93], [-1.93, 3.45 + 4.88]])
"""Of sway and yaw with added mass; both sets have Prestero's."""
PRESTERO = PlanarSet(
    "Prestero 2001", -28.6, 5.22, -24.0, -2.0, 9.64, -6.15, y_vv=-1310.0, y_rr=0.632, n_vv=-3.18, n_rr=-94.0
)
"""Combined non-linear coefficients as he fitted them to sea runs."""
SGARIOTO = PlanarSet(
    "Sgarioto 2006",
    *(value / SPEED_M_S for value in (-66.6, 2.2, -4.47, -6.87)),
    *(value / 3.5 / SPEED_M_S**2 for value in (50.6, -34.6)),
)
"""Linear coefficients after Fodrea at 1.54 m/s, the rudder's divided by 3.5 as they are printed."""


@dataclass(frozen=True)
class Turn:
    """A steady turn at a speed ahead that is held."""

    rudder_deg: float
    yaw_rate_deg_s: float
    """Magnitude."""
    radius_m: float
    drift_deg: float
    """Angle between hull and path."""


def turn(model: PlanarSet | VehicleCfg, rudder_deg: float, speed_m_s: float = SPEED_M_S) -> Turn:
    """The turn in which a model ends, from straight flight, roll and pitch held at 0."""
    force, inertia = _planar(model, speed_m_s, math.radians(rudder_deg))

    def rate(_: float, state: Array) -> Array:
        return np.asarray(np.linalg.solve(inertia, force(float(state[0]), float(state[1]))), dtype=np.float64)

    solution = solve_ivp(rate, (0.0, _SETTLED_S), [0.0, 0.0], rtol=1e-8, atol=1e-10)
    v, r = (float(part) for part in solution.y[:, -1])
    radius_m = math.hypot(speed_m_s, v) / abs(r) if r else math.inf
    return Turn(rudder_deg, abs(math.degrees(r)), radius_m, abs(math.degrees(math.atan2(v, speed_m_s))))


def course_eigenvalues(model: PlanarSet | VehicleCfg, speed_m_s: float = SPEED_M_S) -> list[complex]:
    """Eigenvalues in 1/s of sway and yaw in straight flight with the rudder amidships, the greatest real part first."""
    if isinstance(model, VehicleCfg):
        return _eigenvalues(_block(model, speed_m_s, _LATERAL))
    lever = speed_m_s * np.array([[model.y_uv, model.y_ur - _MASS_KG], [model.n_uv, model.n_ur]])
    return _eigenvalues(np.asarray(np.linalg.solve(_INERTIA, lever), dtype=np.float64))


def pitch_eigenvalues(vehicle: VehicleCfg, speed_m_s: float = SPEED_M_S) -> list[complex]:
    """Eigenvalues in 1/s of heave, pitch rate and pitch in level flight, the greatest real part first."""
    return _eigenvalues(_block(vehicle, speed_m_s, _PITCHING))


def _planar(
    model: PlanarSet | VehicleCfg, speed_m_s: float, rudder_rad: float
) -> tuple[Callable[[float, float], Array], Array]:
    """(Y, N) as a function of sway and yaw rate, marine axes, and the (2, 2) inertia."""
    if isinstance(model, PlanarSet):
        return lambda v, r: model.forces(speed_m_s, v, r, rudder_rad), _INERTIA
    rows = list(_LATERAL)
    fin = next(actuator for actuator in model.actuators if actuator.name == "rudder")
    rudder = np.array(fin.fin_wrench)[rows] * speed_m_s**2 * rudder_rad

    def force(v: float, r: float) -> Array:
        body = hydrodynamic_wrench(model, flip_twist(np.array([speed_m_s, v, 0.0, 0.0, 0.0, r])))
        return flip_twist(body)[rows] + rudder

    # Two flips of sign cancel in a block of sway and yaw.
    return force, (model.rigid_body_mass_body + model.added_mass_body)[np.ix_(rows, rows)]


def _block(vehicle: VehicleCfg, speed_m_s: float, rows: tuple[int, ...]) -> Array:
    """Rows and columns of the state matrix in straight, level flight."""
    state_matrix, _ = linearise(vehicle, np.array([speed_m_s, 0.0, 0.0, 0.0, 0.0, 0.0]))
    return state_matrix[np.ix_(rows, rows)]


def _eigenvalues(matrix: Array) -> list[complex]:
    values: list[complex] = np.linalg.eigvals(matrix).astype(np.complex128).tolist()
    return sorted(values, key=lambda value: -value.real)
