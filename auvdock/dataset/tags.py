"""The label of a tag: its black square's box and corners; small, faint and cut ones are ignored."""

from __future__ import annotations

import numpy as np

from auvdock.dataset.labels import TAG, Label, Reason, clipped, shown_share
from auvdock.dataset.rules import LabelRules
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.tag_model import tag_sight
from auvdock.optics.view import View

__all__ = ["label_tag"]


def label_tag(
    imager: UnderwaterCamera, view: View, exposure_s: float, gain: float, rules: LabelRules
) -> tuple[Label, ...]:
    """Its label, if there is a tag whose face the camera can see; no cap bounds its box.

    The signal is the contrast of white over black in grey codes. Below `dim_sigma` noises there is no label.
    """
    if imager.tag is None:
        return ()
    scene, lit = imager.tag.scene, imager.lit
    seen = scene.look(view)
    if seen is None:
        return ()
    low, high = seen.corners_px.min(axis=0), seen.corners_px.max(axis=0)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 0.5 * rules.floor_px)
    box = np.concatenate([middle - half, middle + half])
    width, height = lit.camera.width_px, lit.camera.height_px
    share = shown_share(box, width, height)
    if share <= 0.0:
        return ()
    sight = tag_sight(seen, lit, exposure_s, gain)
    snr = 0.0 if sight is None else sight.contrast_snr
    if sight is not None and snr < rules.dim_sigma:
        return ()
    reason: Reason = ""
    if sight is None or share < rules.edge_share:
        reason = "edge"
    elif snr < rules.seen_sigma or seen.cell_px < rules.least_cell_px:
        reason = "dim"
    range_m = float(np.linalg.norm(scene.centre_world - view.T_world_camera[:3, 3]))
    left, top, right, bottom = clipped(box, width, height).tolist()
    x, y = clipped(np.tile(middle, 2), width, height)[:2].tolist()
    return (
        Label(
            class_id=TAG,
            xyxy=(left, top, right, bottom),
            centre_px=(x, y),
            ignored=reason,
            lamps=("tag",),
            range_m=range_m,
            c_range=float(lit.water.attenuation[0]) * range_m,
            snr=float(snr),
            side_px=float((high - low).max()),
            corners_px=tuple((float(u), float(v)) for u, v in seen.corners_px),
        ),
    )
