"""Collision and visual geometry of the conical station, as MJCF.

Everything is static and written in world coordinates: station frame shifted down by the mouth's depth.
Geom groups: 0 floor, 1 station, 2 vehicle, 3 collision only (MuJoCo's renderers hide groups above 2).
"""

from __future__ import annotations

import math

from auvdock.core.station import ConicalStationCfg

__all__ = ["STAVES", "TUBE_STAVES", "inner_radius_m", "station_geoms"]

STAVES = 24
"""Flat staves of the funnel; each touches the stated cone along its middle line, the seams stand 0.9 % further out."""
TUBE_STAVES = 16
"""Flat staves of the tube; the seams stand 2 % further out."""
_WALL_M = 0.04
_STATION = 'group="1" priority="1" condim="3" material="station"'


def inner_radius_m(station: ConicalStationCfg, x_m: float) -> float:
    """Radius of the free space at x of the station frame: the stated cone, then the tube; infinite outside."""
    funnel = station.funnel
    if x_m > 0.0:
        return math.inf
    share = min(1.0, -x_m / funnel.length_m)
    return funnel.mouth_radius_m + share * (funnel.tube_radius_m - funnel.mouth_radius_m)


def station_geoms(station: ConicalStationCfg) -> list[str]:
    """MJCF geom elements of funnel, tube, end stop, posts, lamps and floor."""
    geoms = [*_funnel(station), *_tube(station), *_posts(station), *_lamps(station), *_rotating(station)]
    floor_z = -station.depth_m - station.floor_below_m
    geoms.append(
        f'<geom name="floor" type="plane" pos="0 0 {floor_z:.9g}" size="60 60 1" material="floor" group="0" '
        f'condim="3" friction="0.5 0.005 0.0001"/>'
    )
    return geoms


def _funnel(station: ConicalStationCfg) -> list[str]:
    funnel = station.funnel
    drop = funnel.mouth_radius_m - funnel.tube_radius_m
    slant = math.hypot(funnel.length_m, drop)
    sin_a, cos_a = drop / slant, funnel.length_m / slant
    # Centre of the inner face, then half a wall outwards along the cone's normal.
    x = -0.5 * funnel.length_m - 0.5 * _WALL_M * sin_a
    radius = 0.5 * (funnel.mouth_radius_m + funnel.tube_radius_m) + 0.5 * _WALL_M * cos_a
    half_width = funnel.mouth_radius_m * math.tan(math.pi / STAVES) * 1.02
    return [
        _stave(
            f"funnel{index}",
            station,
            (x, radius, 2.0 * math.pi * index / STAVES),
            (cos_a, sin_a),
            (0.5 * slant, half_width, 0.5 * _WALL_M),
        )
        for index in range(STAVES)
    ]


def _tube(station: ConicalStationCfg) -> list[str]:
    funnel = station.funnel
    x = -funnel.length_m - 0.5 * funnel.tube_length_m
    radius = funnel.tube_radius_m + 0.5 * _WALL_M
    half_width = (funnel.tube_radius_m + _WALL_M) * math.tan(math.pi / TUBE_STAVES)
    staves = [
        _stave(
            f"tube{index}",
            station,
            (x, radius, 2.0 * math.pi * index / TUBE_STAVES),
            (1.0, 0.0),
            (0.5 * funnel.tube_length_m, half_width, 0.5 * _WALL_M),
        )
        for index in range(TUBE_STAVES)
    ]
    stop_x = -funnel.length_m - funnel.tube_length_m - 0.5 * _WALL_M
    side = funnel.tube_radius_m + _WALL_M
    staves.append(
        f'<geom name="end_stop" type="box" pos="{stop_x:.9g} 0 {-station.depth_m:.9g}" '
        f'size="{0.5 * _WALL_M} {side:.9g} {side:.9g}" friction="{funnel.friction} 0.005 0.0001" {_STATION}/>'
    )
    return staves


def _stave(
    name: str,
    station: ConicalStationCfg,
    centre: tuple[float, float, float],
    along_xr: tuple[float, float],
    half: tuple[float, float, float],
) -> str:
    """A box along a meridian: centre (x, radius, azimuth), direction (x, radial) of its length."""
    x, radius, azimuth = centre
    lx, lr = along_xr
    cos_a, sin_a = math.cos(azimuth), math.sin(azimuth)
    along = (lx, lr * cos_a, lr * sin_a)
    tangential = (0.0, -sin_a, cos_a)
    xyaxes = " ".join(f"{part:.12g}" for part in (*along, *tangential))
    pos = f"{x:.12g} {radius * cos_a:.12g} {radius * sin_a - station.depth_m:.12g}"
    size = " ".join(f"{part:.9g}" for part in half)
    return (
        f'<geom name="{name}" type="box" pos="{pos}" xyaxes="{xyaxes}" size="{size}" '
        f'friction="{station.funnel.friction} 0.005 0.0001" {_STATION}/>'
    )


def _posts(station: ConicalStationCfg) -> list[str]:
    funnel = station.funnel
    floor_z = -station.depth_m - station.floor_below_m
    posts: list[str] = []
    feet = {
        "post_front": (-0.25 * funnel.length_m, inner_radius_m(station, -0.25 * funnel.length_m) + 2.0 * _WALL_M),
        "post_back": (-funnel.length_m - 0.6 * funnel.tube_length_m, funnel.tube_radius_m + _WALL_M),
    }
    for name, (x, below) in feet.items():
        top = -station.depth_m - below
        if top - floor_z > 0.05:
            posts.append(_rod(name, (x, 0.0, floor_z), (x, 0.0, top), 0.04))
    for beacon in station.beacons:
        if beacon.role == "long_range":
            x, y, z = beacon.position_m
            reach = math.hypot(y, z)
            if reach > funnel.mouth_radius_m + 0.1:
                foot = (funnel.mouth_radius_m + 0.02) / reach
                posts.append(
                    _rod(
                        f"post_{beacon.name}",
                        (x - 0.05, y * foot, z * foot - station.depth_m),
                        (x - 0.05, y, z - station.depth_m),
                        0.02,
                    )
                )
    return posts


def _rod(name: str, start: tuple[float, float, float], end: tuple[float, float, float], radius_m: float) -> str:
    ends = " ".join(f"{part:.9g}" for part in (*start, *end))
    return f'<geom name="{name}" type="cylinder" fromto="{ends}" size="{radius_m}" {_STATION}/>'


def _lamps(station: ConicalStationCfg) -> list[str]:
    lamps: list[str] = []
    for beacon in station.layout.beacons:
        x, y, z = beacon.position_m
        material = "lamp_red" if beacon.wavelength_nm > 570.0 else "lamp_blue"
        size = 0.04 if beacon.role == "long_range" else 0.02
        lamps.append(
            f'<geom name="lamp_{beacon.name}" type="sphere" pos="{x:.9g} {y:.9g} {z - station.depth_m:.9g}" '
            f'size="{size}" material="{material}" group="1" contype="0" conaffinity="0"/>'
        )
    return lamps


def _rotating(station: ConicalStationCfg) -> list[str]:
    """The rotating beacon's lantern (a clear cylinder of 12 cm, 16 cm high) and the post that carries it."""
    if station.rotating is None:
        return []
    x, y, z = station.rotating.position_m
    lantern = (
        f'<geom name="lamp_rotating" type="cylinder" pos="{x:.9g} {y:.9g} {z - station.depth_m:.9g}" '
        f'size="0.06 0.08" material="lamp_blue" group="1" contype="0" conaffinity="0"/>'
    )
    reach = math.hypot(y, z)
    # Behind the tube there is no wall to stand on: the post starts at the axis' own height above the tube.
    wall = inner_radius_m(station, min(x, 0.0)) + _WALL_M
    if reach <= wall + 0.1:
        return [lantern]
    foot = wall / reach
    start = (x, y * foot, z * foot - station.depth_m)
    return [_rod("post_rotating", start, (x, y, z - 0.08 - station.depth_m), 0.02), lantern]
