"""What does not change during an episode: station, lights, beams, hull, camera, names and colours of the plots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from auvdock.core.camera import Camera
from auvdock.recording import paths
from auvdock.recording.hull import hull_shapes
from auvdock.recording.meshes import beam_cone
from auvdock.recording.modes import KNOWN_MODES, MODE_COLOURS
from auvdock.recording.palette import rgba, wavelength_rgb

if TYPE_CHECKING:
    from auvdock.core.beacons import BeaconLayout
    from auvdock.episode.trace import EpisodeSetup
    from auvdock.recording.part import Series, StationPart

__all__ = ["log_scene", "log_surroundings"]

_BEAM_LENGTH_M = 3.0
_PLOTS: dict[str, Series] = {
    paths.POSE_ERROR: (
        ("lateral, m", rgba(255, 120, 90)),
        ("vertical, m", rgba(110, 220, 130)),
        ("along the axis, m", rgba(110, 170, 255)),
    ),
    paths.POSE_ANGLE: (("angle, deg", rgba(240, 200, 90)),),
    paths.REPROJECTION: (("reprojection error, px", rgba(220, 140, 255)),),
    paths.RANGE: (("nose to mouth, m", rgba(110, 200, 255)),),
    paths.SPEED: (
        ("over ground, m/s", rgba(255, 190, 90)),
        ("through water, m/s", rgba(90, 200, 220)),
    ),
    paths.LIGHT_COUNTS: (
        ("detected", rgba(150, 150, 150)),
        ("tracked", rgba(255, 220, 80)),
        ("identified", rgba(120, 255, 120)),
    ),
    paths.CURRENT: (
        ("east (x), m/s", rgba(255, 120, 90)),
        ("north (y), m/s", rgba(110, 220, 130)),
        ("up (z), m/s", rgba(110, 170, 255)),
    ),
    paths.CONTACT: (("contact force, N", rgba(255, 90, 90)),),
}


def log_scene(stream: rr.RecordingStream, setup: EpisodeSetup, part: StationPart) -> None:
    """Log everything static of an episode, once."""
    log_surroundings(stream, setup, part)
    for path, shape in hull_shapes(setup.vehicle).items():
        stream.log(path, shape, static=True, strict=True)
    # Actuators have no colours of their own: the viewer's palette tells any number of them apart.
    stream.log(paths.COMMANDS, rr.SeriesLines(names=list(setup.vehicle.actuator_names)), static=True, strict=True)


def log_surroundings(stream: rr.RecordingStream, setup: EpisodeSetup, part: StationPart) -> None:
    """Log what is static and no part of the vehicle's hull: station, camera, how marks and plots look."""

    def static(path: str, *what: rr.AsComponents) -> None:
        stream.log(path, *what, static=True, strict=True)

    static(paths.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    static(paths.STATION, _transform(setup.T_world_station))
    _log_lights(stream, setup.station.layout)
    part.log_scene(stream)
    static(paths.CAMERA, _transform(setup.camera.T_body_camera), _pinhole(setup.camera))
    static(paths.PATH, rr.LineStrips3D.from_fields(colors=[rgba(255, 220, 80)], radii=[-1.5]))
    static(paths.ESTIMATES, rr.Points3D.from_fields(colors=[rgba(255, 90, 200)], radii=[-1.5]))
    static(paths.CURRENT_ARROW, rr.Arrows3D.from_fields(colors=[rgba(90, 220, 230)], radii=[0.03]))
    static(paths.DETECTIONS, rr.Boxes2D.from_fields(radii=[-1.0]))
    static(paths.TRACKS, rr.Points2D.from_fields(radii=[-3.0], show_labels=True))
    static(
        paths.BEARINGS,
        rr.Points2D.from_fields(radii=[-5.0], colors=[rgba(255, 255, 255, 160)], show_labels=True),
    )
    for path, series in {**_PLOTS, **part.plots}.items():
        colours = np.array([colour for _, colour in series], dtype=np.uint32)
        static(path, rr.SeriesLines(names=[name for name, _ in series], colors=colours))
    static(
        paths.MODE_NUMBER, rr.SeriesLines(names=["mode"], interpolation_mode=rr.components.InterpolationMode.StepAfter)
    )
    static(
        paths.MODE_STATE,
        rr.StateConfiguration(
            values=[*KNOWN_MODES, *part.modes],
            colors=np.array([*MODE_COLOURS, *part.modes.values()], dtype=np.uint32),
        ),
    )


def _transform(transform: np.ndarray) -> rr.Transform3D:
    return rr.Transform3D(translation=transform[:3, 3], mat3x3=transform[:3, :3])


def _log_lights(stream: rr.RecordingStream, layout: BeaconLayout) -> None:
    colours = [wavelength_rgb(beacon.wavelength_nm) for beacon in layout.beacons]
    stream.log(
        paths.LIGHTS,
        rr.Points3D(
            layout.positions_m,
            colors=[rgba(*colour) for colour in colours],
            radii=0.05,
            labels=[beacon.name for beacon in layout.beacons],
            show_labels=False,
        ),
        static=True,
        strict=True,
    )
    for beacon, position_m, axis, colour in zip(layout.beacons, layout.positions_m, layout.axes, colours, strict=True):
        stream.log(
            f"{paths.BEAMS}/{rr.escape_entity_path_part(beacon.name)}",
            beam_cone(position_m, axis, beacon.beam_angle_deg, _BEAM_LENGTH_M).shown(rgba(*colour, 18)),
            static=True,
            strict=True,
        )


def _pinhole(camera: Camera) -> rr.Pinhole:
    """The undistorted camera: Rerun knows no lens distortion.

    Rerun counts pixels from the corner of the first one, this package from its centre.
    """
    matrix = camera.matrix.copy()
    matrix[:2, 2] += 0.5
    return rr.Pinhole(
        image_from_camera=matrix,
        resolution=[camera.width_px, camera.height_px],
        image_plane_distance=1.0,
    )
