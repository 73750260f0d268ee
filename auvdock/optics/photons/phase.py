"""Phase functions by name: as curves, and as quantiles to draw scattering angles from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import root_scalar

from auvdock.assets import asset, asset_names
from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.strict import load_toml
from auvdock.optics.phase_function import fournier_forand
from auvdock.optics.photons.mixture import shares_of

__all__ = ["FOURNIER_FORAND", "MeasuredPhase", "PhaseFunction", "load_phase", "phase_names"]

FOURNIER_FORAND = "fournier-forand-"
"""Beginning of the names of Fournier and Forand's functions; the share of backscattering follows."""

_FIRST_RAD, _ANGLES, _STEPS = 1e-7, 8001, 16384


@dataclass(frozen=True)
class MeasuredPhase:
    """A volume scattering function as measured."""

    name: str
    """Name of the preset."""
    source: str
    """Author, report, station."""
    scattering_per_m: float
    """Scattering coefficient b in 1/m, as printed."""
    backscatter_ratio: float
    """b_b / b, as printed."""
    slope_below: float
    """Power of the angle with which the function goes on below the first one."""
    share_below: float
    """Share of b that lies there, as printed."""
    angle_deg: tuple[float, ...]
    """(n,) scattering angles, ascending to 180°."""
    function_per_m_sr: tuple[float, ...]
    """(n,) volume scattering function in 1/(m sr)."""


@dataclass(frozen=True, eq=False)
class PhaseFunction:
    """A phase function p with ∫ p dω = 1, a power law between the angles at which it is given and below the first."""

    name: str
    """As in `load_phase`."""
    angle_rad: Array
    """(n,) scattering angles, ascending to π."""
    density_sr: Array
    """(n,) p in 1/sr."""
    cumulative: Array
    """(n,) share that is scattered by less than the angle; ends at 1."""
    quantiles: Array
    """(16385,) 1 - cos Θ below which 0, 1/16384, … 1 of all scatterings lie."""
    power: float
    """Of the share in 1 - cos Θ below the first angles: 1 - cos Θ ∝ share^power."""

    def density(self, angle_rad: Array) -> Array:
        """(m,) p in 1/sr at scattering angles (m,) above 0."""
        log_angle, log_density = np.log(self.angle_rad), np.log(self.density_sr)
        slope = (log_density[1] - log_density[0]) / (log_angle[1] - log_angle[0])
        at = np.log(angle_rad)
        below = np.minimum(at - log_angle[0], 0.0)
        return np.exp(np.interp(at, log_angle, log_density) + slope * below)

    def share_within(self, angle_rad: float) -> float:
        """Share that is scattered by less than an angle of at least the first."""
        return float(np.exp(np.interp(math.log(angle_rad), np.log(self.angle_rad), np.log(self.cumulative))))

    @property
    def mean_cosine(self) -> float:
        """∫ p cos Θ dω."""
        return float(1.0 - np.sum(np.diff(self.cumulative) * _midpoints(1.0 - np.cos(self.angle_rad))))

    @property
    def backscatter_ratio(self) -> float:
        """b_b / b: share that is scattered by more than 90°."""
        return 1.0 - self.share_within(math.pi / 2.0)


@lru_cache(maxsize=8)
def load_phase(name: str) -> PhaseFunction:
    """A phase function by name.

    `fournier-forand-R` is Fournier and Forand's with a share R of backscattering: n = 1.10 and μ = 3.5835 for 0.018,
    which is Petzold's average; any other on the line n = 1.01 + 0.1542 (μ - 3) on which that pair lies (Mobley et al.
    2002, equation 7). The others are Petzold's (1972) as measured: clear ocean, coastal ocean, turbid harbour. A
    mixture is the sum of its parts, each with its share of scattering (`shares_of`).

    Raises:
        ConfigError: no such name.
    """
    grid, shares = np.geomspace(_FIRST_RAD, math.pi, _ANGLES), shares_of(name)
    if len(shares) > 1:
        parts = [share * load_phase(part).density_sr for part, share in shares.items()]
        return _tabulated(name, grid, np.sum(parts, axis=0))
    if name.startswith(FOURNIER_FORAND):
        # Its removable pole at δ = 1 would have to fall on an angle of the grid to 1e-8, which it does not.
        index, slope = _particles(name)
        return _tabulated(name, grid, fournier_forand(grid, index, slope))
    if name not in asset_names("phases"):
        raise ConfigError("phase", name, f"one of {', '.join(phase_names())}")
    measured = load_toml(MeasuredPhase, asset("phases", name))
    angle, density = np.radians(measured.angle_deg), np.array(measured.function_per_m_sr)
    log_density = np.interp(np.log(grid), np.log(angle), np.log(density))
    log_density += measured.slope_below * np.minimum(np.log(grid / angle[0]), 0.0)
    return _tabulated(name, grid, np.exp(log_density))


def phase_names() -> tuple[str, ...]:
    """Names that `load_phase` takes, with one of Fournier and Forand's family."""
    return (f"{FOURNIER_FORAND}0.018", *asset_names("phases"))


def _particles(name: str) -> tuple[float, float]:
    """Refractive index and Junge slope of the particles."""
    try:
        ratio = float(name.removeprefix(FOURNIER_FORAND))
    except ValueError:
        ratio = math.nan
    if not 0.002 <= ratio <= 0.1:
        raise ConfigError("phase", name, f"{FOURNIER_FORAND}R with a backscatter ratio R of 0.002 to 0.1")
    if ratio == 0.018:
        return 1.10, 3.5835

    def excess(slope: float) -> float:
        return _backscatter_ratio(_index(slope), slope) - ratio

    slope = float(root_scalar(excess, bracket=(3.05, 4.9)).root)
    return _index(slope), slope


def _index(slope: float) -> float:
    return 1.01 + 0.1542 * (slope - 3.0)


def _backscatter_ratio(index: float, slope: float) -> float:
    """b_b / b of Fournier and Forand's function in closed form (Mobley et al. 2002, equation 6)."""
    nu = (3.0 - slope) / 2.0
    delta = 4.0 / (3.0 * (index - 1.0) ** 2) * 0.5
    return 1.0 - (1.0 - delta ** (nu + 1.0) - 0.5 * (1.0 - delta**nu)) / ((1.0 - delta) * delta**nu)


def _tabulated(name: str, angle: Array, density: Array) -> PhaseFunction:
    """Scale to ∫ p dω = 1 and invert."""
    fall = math.log(density[0] / density[1]) / math.log(angle[1] / angle[0])
    first = 2.0 * math.pi * density[0] * angle[0] ** 2 / (2.0 - fall)
    per_log = 2.0 * math.pi * np.sin(angle) * density * angle
    cumulative = first + np.concatenate([[0.0], np.cumsum(_midpoints(per_log) * np.diff(np.log(angle)))])
    total = float(cumulative[-1])
    cumulative /= total
    share = np.arange(_STEPS + 1) / _STEPS
    at = np.exp(np.interp(np.log(share[1:]), np.log(cumulative), np.log(angle)))
    quantiles = np.concatenate([[0.0], 2.0 * np.sin(0.5 * at) ** 2])
    return PhaseFunction(name, angle, density / total, cumulative, quantiles, 2.0 / (2.0 - fall))


def _midpoints(values: Array) -> Array:
    return 0.5 * (values[1:] + values[:-1])
