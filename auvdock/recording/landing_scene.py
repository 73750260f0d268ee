"""What does not change during a landing: platform, guides, tag, and the names of its plots."""

from __future__ import annotations

import math

import numpy as np
import rerun as rr

from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.stations import StationCfg
from auvdock.recording import paths
from auvdock.recording.modes import LEVEL_COLOURS, LEVELS
from auvdock.recording.palette import rgba

__all__ = ["log_landing", "plots_of"]

_PLATE_M = 0.02
_AXES = (("ξ, m", rgba(255, 120, 90)), ("η, m", rgba(110, 220, 130)), ("ζ, m", rgba(110, 170, 255)))
_PALE = (
    ("ξ estimated, m", rgba(255, 190, 170)),
    ("η estimated, m", rgba(190, 245, 200)),
    ("ζ estimated, m", rgba(190, 215, 255)),
)
_LANDING_PLOTS: dict[str, tuple[tuple[str, int], ...]] = {
    paths.PLACE: (*_AXES, *_PALE),
    paths.PLACE_ANGLE: (("ψ, deg", rgba(240, 200, 90)), ("ψ estimated, deg", rgba(250, 235, 190))),
    paths.RANGE: (("seat to its place, m", rgba(110, 200, 255)),),
}


def plots_of(station: StationCfg) -> dict[str, tuple[tuple[str, int], ...]]:
    """Series of the plots that only this kind of station has, or names differently."""
    return _LANDING_PLOTS if isinstance(station, LandingStationCfg) else {}


def log_landing(stream: rr.RecordingStream, station: LandingStationCfg) -> None:
    """Log platform, guides and tag, in the station frame."""
    size = (station.length_m, station.width_m, station.height_m)
    boxes = {"slab": ((0.0, 0.0, -0.5 * station.height_m), size, 0.0)}
    guide = station.guide
    angle = math.radians(guide.opening_half_angle_deg)
    apex_m = guide.seat_height_m - guide.seat_radius_m / math.sin(angle)
    length = guide.mouth_half_width_m / math.sin(angle)
    for name, x in zip(("head", "tail"), guide.x_m, strict=True):
        for side, sign in (("port", 1.0), ("starboard", -1.0)):
            y = sign * 0.5 * (length * math.sin(angle) + _PLATE_M * math.cos(angle))
            z = apex_m + 0.5 * (length * math.cos(angle) - _PLATE_M * math.sin(angle))
            boxes[f"guide_{name}_{side}"] = ((x, y, z), (guide.thickness_m, _PLATE_M, length), -sign * angle)
    for name, (centre, extent, turn) in boxes.items():
        quaternion = rr.Quaternion(xyzw=[math.sin(0.5 * turn), 0.0, 0.0, math.cos(0.5 * turn)])
        shape = rr.Boxes3D(
            half_sizes=[[0.5 * part for part in extent]],
            centers=[centre],
            quaternions=[quaternion],
            colors=[rgba(150, 158, 165)],
            fill_mode=rr.components.FillMode.Solid,
        )
        stream.log(f"{paths.PLATFORM}/{name}", shape, static=True, strict=True)
    x, y, z = station.tag.position_m
    half = 0.5 * station.tag.size_m
    outline = [[(x + half * a, y + half * b, z + 0.002) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))]]
    tag = rr.LineStrips3D(outline, colors=[rgba(255, 255, 255)], radii=[0.006], labels=[f"tag {station.tag.tag_id}"])
    stream.log(f"{paths.PLATFORM}/tag", tag, static=True, strict=True)
    lines = rr.LineStrips2D.from_fields(colors=[rgba(255, 240, 90)], radii=[-2.0])
    stream.log(paths.TAG_OUTLINE, lines, static=True, strict=True)
    levels = rr.StateConfiguration(values=list(LEVELS), colors=np.array(LEVEL_COLOURS, dtype=np.uint32))
    stream.log(paths.LEVEL_STATE, levels, static=True, strict=True)
