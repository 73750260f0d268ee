"""A guidance space in Rerun: its surface, the station's lights and their beams."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from auvdock.core.beacons import BeaconLayout
from auvdock.core.errors import ConfigError
from auvdock.planning.region import GuidanceSpace

__all__ = ["record_region"]

_NEAR, _FAR = np.array([255.0, 214.0, 102.0]), np.array([31.0, 78.0, 121.0])
_BEAM_M = 1.0


def record_region(path: Path, layout: BeaconLayout, spaces: dict[str, GuidanceSpace]) -> None:
    """Write a recording with one region per name; x of the station frame points out of the mouth, z up.

    Raises:
        ConfigError: the file cannot be written.
    """
    recording = rr.RecordingStream("auvdock guidance space")
    written = recording.binary_stream()  # Rerun's own file sink would hang on a full disk
    recording.log("station", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    blue = np.array([70, 120, 255], dtype=np.uint8)
    red = np.array([255, 60, 40], dtype=np.uint8)
    colours = [red if beacon.wavelength_nm > 575.0 else blue for beacon in layout.beacons]
    names = [beacon.name for beacon in layout.beacons]
    lights = rr.Points3D(layout.positions_m, radii=0.04, colors=np.array(colours), labels=names, show_labels=False)
    recording.log("station/lights", lights, static=True)
    beams = rr.Arrows3D(origins=layout.positions_m, vectors=layout.axes * _BEAM_M, colors=np.array(colours))
    recording.log("station/beams", beams, static=True)
    for name, space in spaces.items():
        if space.region is None:
            continue
        surface = space.region.surface_m()
        distance = np.linalg.norm(surface, axis=1)
        share = (distance / max(float(distance.max()), 1e-9))[:, None]
        shade = (_NEAR * (1.0 - share) + _FAR * share).astype(np.uint8)
        half = np.full((len(surface), 3), 0.5 * space.region.voxel_m)
        voxels = rr.Boxes3D(centers=surface, half_sizes=half, colors=shade, fill_mode=rr.components.FillMode.Solid)
        recording.log(f"region/{name}", voxels, static=True)
    data = written.read()
    recording.disconnect()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data or b"")
    except OSError as error:
        raise ConfigError("out", str(path), f"a file that can be written ({error.strerror})") from error
