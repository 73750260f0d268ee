"""Paper A's light model (its section 3.3) as its tables 4 and 5 were computed. It serves their reproduction only.

For a lamp at l with azimuth φ and tilt β and a point P at distance d (equations (1) to (8) of the paper; what its text
leaves open is settled by the authors' published simulator, whose default parameters these are):

    Ω = 2π (1 - cos α),  I₀ = I / Ω                                        α is half of the table's "Angle"
    f_a = e^{-a (1 + 0.3 C) d},  f_s = e^{-b (1 + C) d} (1 + g) / 2,  C = 0.05 + 0.008 depth
    axis = (sin β' cos φ', sin β' sin φ', cos β'),  β' = β + t(P),  φ' = φ + t(P)
    α_s = min(α + 0.01 C d, 60°),  σ = (α_s / 2)(1 + C / 2),  f_ang = e^{-θ² / 2σ²} where θ ≤ α_s, else 0
    f_d = 1 / (1 + (α_s d / d₀)^n)
    I_P = max(0, I₀ f_a f_s f_ang f_d - 0.02 C), within 0.1 m I_P = I
    G = {P: at least four lamps with I_P ≥ I_min},  V = volume of the convex hull of G's grid points

Since I_P ≥ I_min for four lamps implies ΣI_P ≥ I_min, the paper's second condition never decides. The frozen field t
stands for turbulence. The frame is the paper's: z along the approach axis out of the mouth. What in this is no physics
is told in docs/guidance_space.md; the physical model is `auvdock.planning.region`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial import ConvexHull, QhullError

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive

__all__ = [
    "PaperAGrid",
    "PaperALamp",
    "PaperALightCfg",
    "count_visible",
    "hull_volume_m3",
    "lamp_visible",
    "paper_a_ring",
]

_TURBULENCE_CELLS = 100
_TURBULENCE_SPAN_M = 8.0


@dataclass(frozen=True)
class PaperALightCfg(Checked):
    """Parameters of the model: the defaults of the authors' published simulator, and the readings that were tried."""

    intensity: Positive = 10.0
    """I, radiant intensity before it is spread over the beam; no unit is given."""
    absorption_per_m: NotNegative = 0.18
    """a at 450 nm."""
    scattering_per_m: NotNegative = 0.10
    """b at 450 nm."""
    asymmetry: float = 0.95
    """g of the phase function."""
    concentration_kg_m3: NotNegative = 0.13
    """C, of particles, at 10 m depth."""
    reference_distance_m: Positive = 1.0
    """d₀ of the diffusion term."""
    diffusion_exponent: Positive = 1.2
    """n of the diffusion term."""
    threshold: Positive = 0.02
    """I_min."""
    turbulence: bool = True
    """Tilt the beams by the frozen field."""
    cut: bool = True
    """No light outside the cone θ ≤ α_s."""
    half_angle: bool = True
    """The table's "Angle" is the full angle; False takes it for α itself."""
    angle_from_station: bool = False
    """Measure θ from the station's origin, as the text says, instead of from the lamp."""
    power_law_diffusion: bool = False
    """f_d = (d₀ / d)^n, another reading of the lost equation."""


@dataclass(frozen=True)
class PaperAGrid:
    """A regular grid, bounds included; the default is the paper's."""

    x_m: tuple[float, float] = (-8.0, 8.0)
    y_m: tuple[float, float] = (-8.0, 8.0)
    z_m: tuple[float, float] = (-2.0, 40.0)
    counts: tuple[int, int, int] = (60, 60, 50)

    def axes(self) -> tuple[Array, Array, Array]:
        """Coordinates along x, y and z."""
        spans = (self.x_m, self.y_m, self.z_m)
        x, y, z = (np.linspace(low, high, n) for (low, high), n in zip(spans, self.counts, strict=True))
        return x, y, z

    @property
    def cell_m3(self) -> float:
        """Volume that belongs to one point."""
        steps = (span[1] - span[0] for span in (self.x_m, self.y_m, self.z_m))
        return math.prod(step / (n - 1) for step, n in zip(steps, self.counts, strict=True))


@dataclass(frozen=True)
class PaperALamp:
    """One lamp in the paper's frame."""

    position_m: tuple[float, float, float]
    azimuth_rad: float
    """Direction, seen along z, in which a positive tilt leans."""
    tilt_deg: float
    """β, positive outwards; the paper's positive "deviation angle" is inwards, -β."""
    angle_deg: float
    """The table's "Angle"."""
    relative_intensity: float = 1.0
    """Share of `PaperALightCfg.intensity`."""


def paper_a_ring(count: int, angle_deg: float, inward_tilt_deg: float = 0.0, radius_m: float = 1.0) -> list[PaperALamp]:
    """The paper's ring of lamps, the first at azimuth 0."""
    lamps: list[PaperALamp] = []
    for phi in np.linspace(0.0, 2.0 * math.pi, count, endpoint=False).tolist():
        place = (radius_m * math.cos(phi), radius_m * math.sin(phi), 0.0)
        lamps.append(PaperALamp(place, phi, -inward_tilt_deg, angle_deg))
    return lamps


def count_visible(
    lamps: Sequence[PaperALamp],
    cfg: PaperALightCfg,
    grid: PaperAGrid,
    tick: Callable[[], object] | None = None,
) -> IntArray:
    """Number of lamps visible at each grid point, (nx, ny, nz).

    Args:
        lamps: the lamps.
        cfg: the model.
        grid: the grid.
        tick: called after each lamp, for a progress bar.
    """
    total = np.zeros(grid.counts, dtype=np.int64)
    for lamp in lamps:
        total += lamp_visible(lamp, cfg, grid)
        if tick is not None:
            tick()
    return total


def lamp_visible(lamp: PaperALamp, cfg: PaperALightCfg, grid: PaperAGrid) -> BoolArray:
    """Where I_P ≥ I_min for one lamp, (nx, ny, nz)."""
    x, y, z = grid.axes()
    t = _turbulence(x, y) if cfg.turbulence else np.zeros((len(x), len(y)))
    tilt, azimuth = math.radians(lamp.tilt_deg) + t, lamp.azimuth_rad + t
    axis = [(np.sin(tilt) * np.cos(azimuth))[:, :, None], (np.sin(tilt) * np.sin(azimuth))[:, :, None]]
    axis.append(np.cos(tilt)[:, :, None])
    dx, dy, dz = x - lamp.position_m[0], y - lamp.position_m[1], z - lamp.position_m[2]
    d = np.sqrt((dx**2)[:, None, None] + (dy**2)[None, :, None] + (dz**2)[None, None, :])
    if cfg.angle_from_station:
        along = x[:, None, None] * axis[0] + y[None, :, None] * axis[1] + z[None, None, :] * axis[2]
        norm = np.sqrt((x**2)[:, None, None] + (y**2)[None, :, None] + (z**2)[None, None, :])
    else:
        along = dx[:, None, None] * axis[0] + dy[None, :, None] * axis[1] + dz[None, None, :] * axis[2]
        norm = d
    cosine = np.clip(along / np.maximum(norm, 1e-9), -1.0, 1.0)
    # Only points that the cone can reach are worth an exponential.
    alpha = math.radians(lamp.angle_deg / 2.0 if cfg.half_angle else lamp.angle_deg)
    spread = np.minimum(alpha + 0.01 * cfg.concentration_kg_m3 * d, math.radians(60.0))
    reached = cosine >= np.cos(spread) - 1e-9 if cfg.cut else np.ones(d.shape, dtype=np.bool_)
    visible = np.zeros(d.shape, dtype=np.bool_)
    theta = np.arccos(cosine[reached])
    received = _received(d[reached], theta, spread[reached], alpha, lamp.relative_intensity, cfg)
    visible[reached] = received >= cfg.threshold
    near = d < 0.1
    visible[near] = cfg.intensity * lamp.relative_intensity >= cfg.threshold
    return visible


def hull_volume_m3(mask: BoolArray, grid: PaperAGrid) -> float:
    """Volume of the convex hull of the grid points in `mask` (nx, ny, nz); 0 if they span none."""
    x, y, z = grid.axes()
    # Along each line only the ends can be corners of the hull.
    ends = mask & ~(np.roll(mask, 1, axis=2) & np.roll(mask, -1, axis=2))
    ends[:, :, [0, -1]] = mask[:, :, [0, -1]]
    i, j, k = np.nonzero(ends)
    if len(i) < 4:
        return 0.0
    try:
        return float(ConvexHull(np.column_stack([x[i], y[j], z[k]])).volume)
    except QhullError:
        return 0.0


def _received(d: Array, theta: Array, spread: Array, alpha: float, share: float, cfg: PaperALightCfg) -> Array:
    c = cfg.concentration_kg_m3
    start = cfg.intensity * share / (2.0 * math.pi * (1.0 - math.cos(alpha)))
    absorbed = np.exp(-cfg.absorption_per_m * (1.0 + 0.3 * c) * d)
    scattered = np.exp(-cfg.scattering_per_m * (1.0 + c) * d) * (1.0 + cfg.asymmetry) / 2.0
    sigma = spread / 2.0 * (1.0 + 0.5 * c)
    beam = np.exp(-(theta**2) / 2.0 / sigma**2)
    if cfg.cut:
        beam = np.where(theta <= spread, beam, 0.0)
    if cfg.power_law_diffusion:
        diffused = (cfg.reference_distance_m / np.maximum(d, 1e-9)) ** cfg.diffusion_exponent
    else:
        diffused = 1.0 / (1.0 + (spread * d / cfg.reference_distance_m) ** cfg.diffusion_exponent)
    return np.maximum(0.0, start * absorbed * scattered * beam * diffused - 0.02 * c)


def _turbulence(x: Array, y: Array) -> Array:
    """(nx, ny) tilt in rad at points: the field's cell below, the field spread over [-8, 8] m."""
    places = [((values + _TURBULENCE_SPAN_M) / (2.0 * _TURBULENCE_SPAN_M) * 99.0).astype(np.int64) for values in (x, y)]
    i, j = (np.clip(place, 0, _TURBULENCE_CELLS - 1) for place in places)
    return _turbulence_field()[i[:, None], j[None, :]]


@lru_cache(maxsize=1)
def _turbulence_field() -> Array:
    """(100, 100) rad. The paper's tables rest on the numbers that NumPy's legacy generator gives for seed 42."""
    # The new generators cannot produce that stream; the instance is local, so no global state is touched.
    legacy = np.random.RandomState(42)
    return 0.01 * gaussian_filter(legacy.randn(_TURBULENCE_CELLS, _TURBULENCE_CELLS), sigma=1)
