"""A lens with three radial and two tangential terms (Brown 1966, Conrady 1919), in OpenCV's form.

With x, y the tangents of a ray to the right and down and r² = x² + y², the distorted ones are

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y

and the pixel is u = fx x' + cx, v = fy y' + cy. A lens is an array that begins with the nine numbers named here.
"""

from __future__ import annotations

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["CX", "CY", "FX", "FY", "K1", "K2", "K3", "P1", "P2", "pixel_of", "radial_factor", "slopes", "tangents_of"]

FX, FY, CX, CY, K1, K2, P1, P2, K3 = range(9)
"""Places of the focal lengths and the principal point in px, and of the distortion's coefficients."""


@compiled
def radial_factor(r2: float, k1: float, k2: float, k3: float) -> float:
    """1 + k1 r² + k2 r⁴ + k3 r⁶."""
    return 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))


@compiled
def pixel_of(x: float, y: float, lens: Array) -> tuple[float, float]:
    """Pixel u, v of a ray with the tangents x, y."""
    p1, p2, r2 = lens[P1], lens[P2], x * x + y * y
    radial = radial_factor(r2, lens[K1], lens[K2], lens[K3])
    u = lens[FX] * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + lens[CX]
    v = lens[FY] * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + lens[CY]
    return u, v


@compiled
def slopes(x: float, y: float, lens: Array) -> tuple[float, float, float]:
    """∂x'/∂x, ∂y'/∂y, and ∂x'/∂y, which is ∂y'/∂x."""
    p1, p2, r2 = lens[P1], lens[P2], x * x + y * y
    radial = radial_factor(r2, lens[K1], lens[K2], lens[K3])
    rise = lens[K1] + r2 * (2.0 * lens[K2] + 3.0 * lens[K3] * r2)
    xx = radial + 2.0 * x * x * rise + 2.0 * p1 * y + 6.0 * p2 * x
    yy = radial + 2.0 * y * y * rise + 6.0 * p1 * y + 2.0 * p2 * x
    return xx, yy, 2.0 * x * y * rise + 2.0 * p1 * x + 2.0 * p2 * y


@compiled
def tangents_of(u: float, v: float, lens: Array) -> tuple[float, float]:
    """Tangents x, y of the ray through a pixel, by fixed-point iteration on the distortion (as OpenCV does it)."""
    p1, p2 = lens[P1], lens[P2]
    x0, y0 = (u - lens[CX]) / lens[FX], (v - lens[CY]) / lens[FY]
    x, y = x0, y0
    for _ in range(50):
        r2 = x * x + y * y
        radial = radial_factor(r2, lens[K1], lens[K2], lens[K3])
        x_new = (x0 - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial
        y_new = (y0 - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial
        done = abs(x_new - x) + abs(y_new - y) < 1e-10
        x, y = x_new, y_new
        if done:
            break
    return x, y
