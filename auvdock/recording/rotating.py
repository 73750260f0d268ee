"""The rotating beacon in a recording: where its beam points, azimuths measured, where the pilot believes to be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from auvdock.core.arrays import Array
from auvdock.core.station import ConicalStationCfg
from auvdock.recording import paths
from auvdock.recording.batch import Batch
from auvdock.recording.conical import ConicalPart
from auvdock.recording.meshes import beam_cone
from auvdock.recording.palette import rgba, wavelength_rgb
from auvdock.recording.part import plot

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup
    from auvdock.metrics.tick import Tick

__all__ = ["RotatingPart"]

_BEAM_M = 20.0
_SHOWN_SIGMAS = 2.0
_SERIES = {
    paths.AZIMUTH_TRUE: ("true, deg", rgba(150, 150, 150)),
    paths.AZIMUTH_BELIEVED: ("believed, deg", rgba(110, 200, 255)),
    paths.AZIMUTH_FIX: ("measured, deg", rgba(255, 220, 80)),
    paths.RANGE_SIGMA: ("standard deviation of the range, m", rgba(255, 120, 90)),
}


class RotatingPart(ConicalPart):
    """A conical station with a beam that turns above it."""

    def __init__(self, setup: EpisodeSetup, station: ConicalStationCfg) -> None:
        """Begin an episode.

        Raises:
            ValueError: the station carries no rotating beacon.
        """
        super().__init__(setup, station)
        if station.rotating is None:
            raise ValueError("a station without a rotating beacon")
        self._beacon = station.rotating

    def log_scene(self, stream: rr.RecordingStream) -> None:
        """Log funnel and tube, the beam's cone in the beam's own frame, names and colours of the plots."""
        super().log_scene(stream)
        beacon = self._beacon
        elevation = math.radians(beacon.elevation_deg)
        axis = np.array([math.cos(elevation), 0.0, math.sin(elevation)])
        cone = beam_cone(np.zeros(3), axis, beacon.divergence_deg, _BEAM_M)
        mesh = cone.shown(rgba(*wavelength_rgb(beacon.wavelength_nm), 40))
        stream.log(f"{paths.ROTATING_BEAM}/cone", mesh, static=True, strict=True)
        stream.log(
            paths.BELIEVED,
            rr.Ellipsoids3D.from_fields(colors=[rgba(255, 220, 80, 90)], fill_mode=rr.components.FillMode.Solid),
            static=True,
            strict=True,
        )
        for path, (name, line) in _SERIES.items():
            look = (
                rr.SeriesPoints(names=[name], colors=[line], marker_sizes=[4.0])
                if path == paths.AZIMUTH_FIX
                else rr.SeriesLines(names=[name], colors=[line])
            )
            stream.log(path, look, static=True, strict=True)

    def views(self) -> list[rrb.Vertical]:
        """Azimuth and range."""
        azimuth, sigma = plot("Azimuth", paths.AZIMUTH), plot("Range uncertainty", paths.RANGE_SIGMA)
        return [rrb.Vertical(azimuth, sigma, name="Rotating beacon")]

    def write(self, batch: Batch, ticks: Sequence[Tick], T_station_camera: Array) -> None:
        """Write the beam by the vehicle's clock, true, believed and measured azimuth, the believed place."""
        beacon = self._beacon
        x, y, _ = beacon.position_m
        turned = np.array([beacon.azimuth_rad(tick.truth.time_s) for tick in ticks])
        place = np.broadcast_to(np.array(beacon.position_m), (len(ticks), 3))
        batch.send(paths.ROTATING_BEAM, rr.Transform3D.columns(translation=place, mat3x3=_about_z(turned)))
        camera = T_station_camera[:, :3, 3]
        batch.scalars(paths.AZIMUTH_TRUE, np.degrees(np.arctan2(camera[:, 1] - y, camera[:, 0] - x)))
        fixes = [(row, tick.percept.azimuth) for row, tick in enumerate(ticks) if tick.percept and tick.percept.azimuth]
        if fixes:
            at = batch.select(np.array([row for row, _ in fixes]))
            at.scalars(paths.AZIMUTH_FIX, np.degrees([fix.azimuth_rad for _, fix in fixes]))
        _write_believed(batch, ticks, self._setup, camera)


def _write_believed(batch: Batch, ticks: Sequence[Tick], setup: EpisodeSetup, camera: Array) -> None:
    """The believed place as an ellipsoid of two standard deviations along and across the line of sight."""
    rows = [row for row, tick in enumerate(ticks) if "range_sigma_m" in tick.command.setpoint]
    if not rows:
        return
    points = [ticks[row].command.setpoint for row in rows]
    at = batch.select(np.array(rows))
    azimuth = np.array([point["azimuth_rad"] for point in points])
    along = np.array([point["range_sigma_m"] for point in points])
    across = np.array([point["cross_sigma_m"] for point in points])
    centre = np.array([[point["station_x_m"], point["station_y_m"], 0.0] for point in points])
    centre[:, 2] = camera[rows, 2]
    world = centre @ setup.T_world_station[:3, :3].T + setup.T_world_station[:3, 3]
    half = _SHOWN_SIGMAS * np.column_stack([along, across, np.full(len(rows), 0.05)])
    turns = [rr.Quaternion(xyzw=[0.0, 0.0, math.sin(0.5 * a), math.cos(0.5 * a)]) for a in azimuth.tolist()]
    at.send(paths.BELIEVED, rr.Ellipsoids3D.columns(centers=world, half_sizes=half, quaternions=turns))
    at.scalars(paths.AZIMUTH_BELIEVED, np.degrees(azimuth))
    at.scalars(paths.RANGE_SIGMA, along)


def _about_z(angle_rad: Array) -> Array:
    """(n, 3, 3) rotations about the vertical."""
    turned = np.zeros((len(angle_rad), 3, 3))
    turned[:, 0, 0] = turned[:, 1, 1] = np.cos(angle_rad)
    turned[:, 1, 0] = np.sin(angle_rad)
    turned[:, 0, 1] = -turned[:, 1, 0]
    turned[:, 2, 2] = 1.0
    return turned
