"""How a tag detector answers to a tag: found or not, and how precisely its corners.

The parameters are fitted on rendered frames (`optics.tag_fit`), one file per detector in `assets/tag_detection`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from auvdock.assets import asset, asset_names
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import TagDetection
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative, Positive, Share
from auvdock.core.strict import load_toml
from auvdock.optics.scene import LitScene
from auvdock.optics.tag_scene import TagView

__all__ = [
    "TagModelCfg",
    "TagSight",
    "corner_sigma_px",
    "draw_tag",
    "inward",
    "load_tag_model",
    "tag_chance",
    "tag_sight",
]

_LUMA = np.array([0.299, 0.587, 0.114])
"""Weights of red, green and blue codes in a grey image (ITU-R BT.601), which tag detectors work on."""
_SHARES = np.linspace(0.0, 1.0, 33) ** 2


@dataclass(frozen=True)
class TagModelCfg(Checked):
    """Behaviour of one tag detector.

    A tag that lies with its white margin in the image is found with probability

        ceiling × 1 / (1 + (s_50 / s)^n) × 1 / (1 + (q_50 / q)^m)

    with s the edge of a cell in pixels and q the contrast of white over black in grey codes over the noise of a code.
    Saturation and glare act through q: codes end at 255, and light on top of both brings them together there.
    """

    name: str
    """The detector."""
    source: str
    """What it was fitted on."""
    cell_50_px: Positive
    """Cell at which half of the tags of good contrast are found."""
    cell_slope: Positive
    """Steepness in ln(cell)."""
    snr_50: Positive
    """Contrast over noise at which half of the tags of good size are found."""
    snr_slope: Positive
    """Steepness in ln(contrast over noise)."""
    ceiling: Share
    """Probability of finding a large tag of good contrast."""
    cut_share: Share
    """In place of `ceiling` when the white margin, but not the black square, leaves the image."""
    corner_floor_px: NotNegative
    """Standard deviation of a corner of a tag of good contrast, per axis."""
    corner_noise_px: NotNegative
    """In addition this over q, per axis."""
    corner_inward: float
    """Share of `TagSight.spread_px` by which the corners are found too far inside: 1 for a detector that seeks edges
    half way between the codes of black and white, 0 for one that undoes the sensor's response first."""


class TagSight(NamedTuple):
    """A tag on the sensor as a detector meets it.

    Attributes:
        corners_px: (4, 2) true corners of the black square.
        cell_px: edge of a cell.
        contrast_snr: contrast of white over black in grey codes, over the noise of a code.
        spread_px: how far the code half way between black and white lies inside the true edge of a black square. Codes
            follow the root of light and end at 255, so white seems to spread.
        whole: whether the white margin lies in the image too.
    """

    corners_px: Array
    cell_px: float
    contrast_snr: float
    spread_px: float
    whole: bool


def load_tag_model(name: str) -> TagModelCfg:
    """The fitted model of a tag detector.

    Raises:
        ConfigError: no model was fitted for a detector of that name.
    """
    known = asset_names("tag_detection")
    if name not in known:
        remedy = f"one of {', '.join(known)}: the beacons fidelity knows only fitted detectors"
        raise ConfigError("tag_detector", name, remedy)
    return load_toml(TagModelCfg, asset("tag_detection", name))


def tag_sight(view: TagView, lit: LitScene, exposure_s: float, gain: float) -> TagSight | None:
    """The tag at an exposure; None if its black square leaves the image."""
    corners, scale = view.corners_px, lit.scale(gain)
    size = np.array([lit.camera.width_px, lit.camera.height_px])
    if not view.inside and (np.any(corners < 1.0) or np.any(corners > size - 2.0)):
        return None
    levels = np.array([view.white_e_s + view.around_e_s, view.black_e_s + view.around_e_s]) * exposure_s
    # Grey codes from black to white, through what the blurred edge shows in between.
    between = levels[1] + _SHARES[:, None] * (levels[0] - levels[1])
    codes = np.minimum(scale.codes(between), 255.0) @ _LUMA
    noise = float(np.linalg.norm(scale.noise_dn(levels.mean(axis=0)) * _LUMA))
    share = float(np.interp(0.5 * (codes[0] + codes[-1]), codes, _SHARES))
    # A pixel averages over its own width: variance 1/12.
    blur = math.sqrt(lit.setup.imaging.lens_sigma_px**2 + 1.0 / 12.0)
    spread = -blur * float(ndtri(min(max(share, 1e-3), 1.0 - 1e-3)))
    return TagSight(corners, view.cell_px, float(codes[-1] - codes[0]) / noise, spread, view.inside)


def tag_chance(sight: TagSight, model: TagModelCfg) -> float:
    """Probability that the tag is found."""
    if sight.contrast_snr <= 0.0:
        return 0.0
    size = 1.0 / (1.0 + (model.cell_50_px / sight.cell_px) ** model.cell_slope)
    contrast = 1.0 / (1.0 + (model.snr_50 / sight.contrast_snr) ** model.snr_slope)
    return (model.ceiling if sight.whole else model.cut_share) * size * contrast


def corner_sigma_px(sight: TagSight, model: TagModelCfg) -> float:
    """Standard deviation of a corner per axis."""
    return math.hypot(model.corner_floor_px, model.corner_noise_px / max(sight.contrast_snr, 1e-3))


def draw_tag(
    sight: TagSight | None, tag_id: int, model: TagModelCfg, rng: np.random.Generator
) -> tuple[TagDetection, ...]:
    """What the detector gives for one frame; a frame costs the same draws whether or not it shows the tag."""
    chance, noise = float(rng.random()), rng.standard_normal((4, 2))
    if sight is None or chance >= tag_chance(sight, model):
        return ()
    sigma = corner_sigma_px(sight, model)
    corners = sight.corners_px + sigma * noise
    corners += model.corner_inward * sight.spread_px * inward(sight.corners_px)
    return (TagDetection(tag_id, corners, sigma),)


def inward(corners_px: Array) -> Array:
    """(4, 2) displacement of corners (4, 2) when both of a corner's edges move by one pixel towards the centre."""
    forward = np.roll(corners_px, -1, axis=0) - corners_px
    backward = np.roll(corners_px, 1, axis=0) - corners_px
    forward /= np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-9)
    backward /= np.maximum(np.linalg.norm(backward, axis=1, keepdims=True), 1e-9)
    sine = np.abs(forward[:, 0] * backward[:, 1] - forward[:, 1] * backward[:, 0])
    return (forward + backward) / np.maximum(sine, 0.2)[:, None]
