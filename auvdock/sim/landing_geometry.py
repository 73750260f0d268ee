"""Collision and visual geometry of the landing station, as MJCF, in world coordinates.

Geom groups as in `auvdock.sim.station_geometry`. The plates of the guides touch with their inner faces at the stated
angle; a round of `seat_radius_m` lies on both at `seat_height_m`. Thicknesses are ours.
"""

from __future__ import annotations

import math

from auvdock.core.landing_station import GuideCfg, LandingStationCfg

__all__ = ["TAG_LIFT_M", "guide_apex_m", "landing_geoms"]

TAG_LIFT_M = 0.001
"""Height of the tag's plate above the platform."""
_PLATE_M = 0.02
_STATION = 'group="1" priority="1" condim="3" material="station"'


def guide_apex_m(guide: GuideCfg) -> float:
    """Height above the platform of the line in which the inner faces of a guide's plates would meet."""
    return guide.seat_height_m - guide.seat_radius_m / math.sin(math.radians(guide.opening_half_angle_deg))


def landing_geoms(station: LandingStationCfg) -> list[str]:
    """MJCF geom elements of platform, guides, tag plate, lamps and floor."""
    geoms = [*_platform(station), *_guides(station), *_lamps(station)]
    floor_z = -station.depth_m - station.floor_below_m
    geoms.append(
        f'<geom name="floor" type="plane" pos="0 0 {floor_z:.9g}" size="60 60 1" material="floor" group="0" '
        f'condim="3" friction="0.5 0.005 0.0001"/>'
    )
    return geoms


def _platform(station: LandingStationCfg) -> list[str]:
    half = f"{0.5 * station.length_m:.9g} {0.5 * station.width_m:.9g} {0.5 * station.height_m:.9g}"
    middle_z = -station.depth_m - 0.5 * station.height_m
    x, y, z = station.tag.position_m
    edge = 0.5 * station.tag.size_m
    return [
        f'<geom name="platform" type="box" pos="0 0 {middle_z:.9g}" size="{half}" {_friction(station)} {_STATION}/>',
        # The picture on it is painted by the optics: a texture would be too coarse for a tag's corners.
        f'<geom name="tag" type="box" pos="{x:.9g} {y:.9g} {z - station.depth_m + 0.5 * TAG_LIFT_M:.9g}" '
        f'size="{edge:.9g} {edge:.9g} {0.5 * TAG_LIFT_M}" rgba="0.85 0.85 0.85 1" group="1" contype="0" '
        f'conaffinity="0"/>',
    ]


def _guides(station: LandingStationCfg) -> list[str]:
    guide = station.guide
    angle = math.radians(guide.opening_half_angle_deg)
    sin_a, cos_a = math.sin(angle), math.cos(angle)
    apex = guide_apex_m(guide)
    length = guide.mouth_half_width_m / sin_a
    geoms: list[str] = []
    for name, x in zip(("head", "tail"), guide.x_m, strict=True):
        for side, sign in (("port", 1.0), ("starboard", -1.0)):
            # Middle of the inner face, then half a plate outwards along its normal (0, cos, -sin).
            y = sign * (0.5 * length * sin_a + 0.5 * _PLATE_M * cos_a)
            z = apex + 0.5 * length * cos_a - 0.5 * _PLATE_M * sin_a - station.depth_m
            axes = f"1 0 0 0 {sign * sin_a:.12g} {cos_a:.12g}"
            size = f"{0.5 * guide.thickness_m:.9g} {0.5 * length:.9g} {0.5 * _PLATE_M}"
            geoms.append(
                f'<geom name="guide_{name}_{side}" type="box" pos="{x:.9g} {y:.12g} {z:.12g}" xyaxes="{axes}" '
                f'size="{size}" {_friction(station)} {_STATION}/>'
            )
        if apex > 0.02:
            geoms.append(
                f'<geom name="post_{name}" type="box" pos="{x:.9g} 0 {0.5 * apex - station.depth_m:.9g}" '
                f'size="{0.5 * guide.thickness_m:.9g} {_PLATE_M} {0.5 * apex:.9g}" {_friction(station)} {_STATION}/>'
            )
    return geoms


def _friction(station: LandingStationCfg) -> str:
    return f'friction="{station.guide.friction} 0.005 0.0001"'


def _lamps(station: LandingStationCfg) -> list[str]:
    lamps: list[str] = []
    for beacon in station.beacons:
        x, y, z = beacon.position_m
        material = "lamp_red" if beacon.wavelength_nm > 570.0 else "lamp_blue"
        lamps.append(
            f'<geom name="lamp_{beacon.name}" type="sphere" pos="{x:.9g} {y:.9g} {z - station.depth_m:.9g}" '
            f'size="0.02" material="{material}" group="1" contype="0" conaffinity="0"/>'
        )
    return lamps
