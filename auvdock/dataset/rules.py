"""The rules of the labels: when lights are one box, how large a box is, and what is too dim to count.

All are decided on the frame's expected image, which has no noise. `docs/dataset.md` tells the rules in full.

1. A light's signal is its contrast: how much the code at its centre rises above the picture on a ring about it by the
   light that it sends there, in the channel where this is most of the noise of a code. The ring's radius is half of
   `cap_px`, or two radii of the saturated disc if that is more. Below `dim_sigma` noises nothing is labelled, below
   `seen_sigma` it is ignored.
2. A light stands by itself if its peak rises by `part_sigma` noises above the saddle towards every brighter light, in
   any channel (its topographic prominence). Else it belongs to the brighter light behind the highest saddle, and the
   brightest of a group owns their box.
3. A light's box goes as far as its own light has half of its contrast. The owner's box grows to hold those of its group
   that overlap it; others of the group show no peak and have no label. No side is less than `floor_px`, nor more than
   `cap_px` about the owner's centre; the side before that is told.
4. Mirror images, lamps of strangers with the station's colours, and boxes of which less than `edge_share` lies in the
   picture are ignored. Strangers of other colours are no lights: negatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, IntArray
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative, Positive, Share, at_least
from auvdock.dataset.labels import Label, Reason, clipped, shown_share
from auvdock.dataset.saddles import saddles
from auvdock.numeric.constants import SATURATED_CODE
from auvdock.optics.sensor import SensorScale

__all__ = ["Foreign", "LabelRules", "Light", "label_lights", "owners"]

Foreign = Literal["", "mirror", "stranger", "negative"]
"""Whose a lamp is: the station's own, its image in the surface, a stranger's of like colour, or of another."""

_HALF = 0.5
_RING_DISCS = 2.0
_RING = np.array([np.cos(np.arange(24) * (math.tau / 24)), np.sin(np.arange(24) * (math.tau / 24))])
_TOP_DN = 255.0


@dataclass(frozen=True)
class LabelRules(Checked):
    """Numbers of the rules above."""

    dim_sigma: NotNegative = 1.2
    """Contrast over noise below which a light is not there."""
    seen_sigma: NotNegative = 3.0
    """Contrast over noise from which it counts."""
    part_sigma: Positive = 2.0
    """Prominence over noise from which two lights are two."""
    floor_px: Annotated[float, at_least(1.0)] = 10.0
    """Least side of a box."""
    cap_px: Annotated[float, at_least(1.0)] = 32.0
    """Greatest side of a light's box."""
    edge_share: Share = 0.75
    """Share of a box that must lie in the picture."""
    least_cell_px: Positive = 1.5
    """Edge of a tag's cell below which the tag is ignored."""

    def __post_init__(self) -> None:
        """Refuse limits that cross."""
        if self.dim_sigma > self.seen_sigma:
            raise ConfigError("dim_sigma", self.dim_sigma, "at most seen_sigma")
        if self.floor_px > self.cap_px:
            raise ConfigError("floor_px", self.floor_px, "at most cap_px")


@dataclass(frozen=True, eq=False)
class Light:
    """A lamp on the sensor, by itself.

    Attributes:
        name: of the lamp.
        class_id: of its colour.
        pixel: (2,) where its light is centred.
        profile_e: (k, 3) electrons per pixel at `radii_px`, red, green, blue.
        range_m: distance.
        c_range: attenuation lengths at its wavelength.
        foreign: whose it is.
    """

    name: str
    class_id: int
    pixel: Array
    profile_e: Array
    range_m: float
    c_range: float
    foreign: Foreign = ""


def label_lights(
    electrons: NDArray[np.float32],
    scale: SensorScale,
    lights: Sequence[Light],
    radii_px: Array,
    rules: LabelRules,
) -> list[Label]:
    """Labels of the lights in a frame.

    Args:
        electrons: (H, W, 3) the frame's expected image.
        scale: its codes.
        lights: all lamps whose light may show, those just outside the image too.
        radii_px: (k,) radii of their profiles.
        rules: the rules.
    """
    height, width = electrons.shape[:2]
    shown: list[Light] = []
    facts: list[tuple[float, float]] = []
    for light in lights:
        snr, half_px = _contrast(electrons, scale, light, radii_px, rules)
        if snr >= rules.dim_sigma:
            shown.append(light)
            facts.append((snr, half_px))
    labels: list[Label] = []
    if not shown:
        return labels
    owner = owners(electrons, scale, shown, rules.part_sigma)
    for k in np.unique(owner):
        lead = shown[int(k)]
        joined = np.flatnonzero(owner == k)
        boxes = np.array([[*(shown[i].pixel - facts[i][1]), *(shown[i].pixel + facts[i][1])] for i in joined])
        own = boxes[joined == k][0]
        # A light on a brighter one's slope has no peak to show; only what overlaps the owner makes one spot with it.
        touching = np.all((boxes[:, :2] <= own[2:]) & (boxes[:, 2:] >= own[:2]), axis=1)
        members = [int(k), *(int(i) for i in joined[touching] if i != k)]
        boxes = boxes[touching]
        whole = np.concatenate([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])
        box = _bounded(whole, lead.pixel, rules)
        snr = max(facts[i][0] for i in members)
        share = shown_share(box, width, height)
        if share <= 0.0:
            continue
        inside = _inside(lead.pixel, width, height)
        if lead.foreign == "negative":
            if all(shown[i].foreign == "negative" for i in members):
                continue
            reason: Reason = "stranger"
        else:
            reason = lead.foreign
        if not reason and (share < rules.edge_share or not inside):
            reason = "edge"
        if not reason and snr < rules.seen_sigma:
            reason = "dim"
        left, top, right, bottom = clipped(box, width, height).tolist()
        x, y = clipped(np.tile(lead.pixel, 2), width, height)[:2].tolist()
        labels.append(
            Label(
                class_id=lead.class_id,
                xyxy=(left, top, right, bottom),
                centre_px=(x, y),
                ignored=reason,
                lamps=tuple(shown[i].name for i in members),
                range_m=lead.range_m,
                c_range=lead.c_range,
                snr=snr,
                side_px=float(max(whole[2] - whole[0], whole[3] - whole[1])),
            )
        )
    return labels


def owners(electrons: NDArray[np.float32], scale: SensorScale, lights: Sequence[Light], part_sigma: float) -> IntArray:
    """(n,) for each light (n,) the one that owns its box: itself, or a brighter one that it does not stand out from."""
    brightness = np.array([float(light.profile_e[0].max()) for light in lights])
    order = np.argsort(-brightness, kind="stable")
    pixels = np.array([light.pixel for light in lights])[order]
    level_e = saddles(np.ascontiguousarray(electrons), pixels)
    level_dn = np.minimum(scale.codes(level_e.astype(np.float64)), _TOP_DN)
    peak_dn = np.einsum("iic->ic", level_dn)
    noise_dn = scale.noise_dn(np.einsum("iic->ic", level_e).astype(np.float64))
    root = np.arange(len(lights))
    for i in range(1, len(lights)):
        saddle_dn = level_dn[i, :i]
        prominence = (peak_dn[i] - saddle_dn.max(axis=0)) / noise_dn[i]
        if prominence.max() < part_sigma:
            root[i] = root[int(np.argmax(saddle_dn.sum(axis=1)))]
    owner = np.empty(len(lights), dtype=np.int64)
    owner[order] = order[root]
    return owner


def _contrast(
    electrons: NDArray[np.float32], scale: SensorScale, light: Light, radii_px: Array, rules: LabelRules
) -> tuple[float, float]:
    """Contrast of a light over the noise of a code, and the radius at which half of the contrast is left."""
    burnt = np.flatnonzero(scale.codes(light.profile_e).max(axis=1) >= SATURATED_CODE)
    ring_px = max(0.5 * rules.cap_px, _RING_DISCS * float(radii_px[burnt[-1]]) if len(burnt) else 0.0)
    around_e = _around(electrons, light.pixel, ring_px)
    at_ring_e = np.array([np.interp(ring_px, radii_px, light.profile_e[:, c]) for c in range(3)])
    rise_e = np.maximum(light.profile_e - at_ring_e, 0.0)
    rise_dn = np.minimum(scale.codes(around_e + rise_e), _TOP_DN) - np.minimum(scale.codes(around_e), _TOP_DN)
    ratio = rise_dn[0] / scale.noise_dn(around_e + rise_e[0])
    best = int(np.argmax(ratio))
    below = rise_dn[:, best] < _HALF * rise_dn[0, best]
    return float(ratio[best]), float(radii_px[np.argmax(below)]) if below.any() else ring_px


def _around(electrons: NDArray[np.float32], pixel: Array, radius_px: float) -> Array:
    """(3,) median of the picture on a ring about a pixel, as far as the ring lies within it."""
    height, width = electrons.shape[:2]
    x, y = np.rint(pixel[0] + radius_px * _RING[0]), np.rint(pixel[1] + radius_px * _RING[1])
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    if not inside.any():
        return np.zeros(3)
    ring = electrons[y[inside].astype(np.int64), x[inside].astype(np.int64)]
    return np.asarray(np.median(ring, axis=0), dtype=np.float64)


def _bounded(whole: Array, centre_px: Array, rules: LabelRules) -> Array:
    """A box (4,) with the least and greatest sides: too small it grows about its middle, too large it is cut."""
    box = whole.copy()
    for axis in range(2):
        low, high = whole[axis], whole[axis + 2]
        if high - low > rules.cap_px:
            middle, side = centre_px[axis], rules.cap_px
        else:
            middle, side = 0.5 * (low + high), max(high - low, rules.floor_px)
        box[axis], box[axis + 2] = middle - 0.5 * side, middle + 0.5 * side
    return box


def _inside(pixel: Array, width: int, height: int) -> bool:
    x, y = pixel.tolist()
    return math.isfinite(x + y) and -0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5
