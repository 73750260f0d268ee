"""Frames with what perception made of them drawn in, and the video of them."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from auvdock.core.arrays import Array, Image
from auvdock.core.camera import Camera
from auvdock.core.errors import AuvdockError, ConfigError
from auvdock.footage.perceiving import Seen

__all__ = ["CODECS", "AnnotatedVideo", "annotated"]

CODECS = {".mp4": "mp4v", ".avi": "MJPG"}
"""Codec by the ending of a video's name."""
_LIGHT, _NAMED, _EXPECTED, _TAG = (90, 170, 255), (120, 255, 120), (255, 90, 200), (255, 240, 90)
_RADIUS_PX = 9
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def annotated(seen: Seen, camera: Camera, array_m: Array) -> Image:
    """(H, W, 3) the frame with rings about lights, their beacons' numbers, tags, crosses where the pose puts lights.

    Args:
        seen: the frame and what was made of it.
        camera: that took it.
        array_m: (k, 3) array beacons in the station frame.
    """
    if seen.shot.image is None:
        raise ValueError("a frame without an image cannot be drawn on")
    image, row = seen.shot.image.copy(), seen.row
    for (x, y), beacon in zip(row.lights, row.beacon_ids, strict=True):
        colour = _LIGHT if beacon is None else _NAMED
        cv2.circle(image, (round(x), round(y)), _RADIUS_PX, colour, 1, cv2.LINE_AA)
        if beacon is not None:
            place = (round(x) + _RADIUS_PX + 2, round(y) + 4)
            cv2.putText(image, f"B{beacon}", place, _FONT, 0.45, colour, 1, cv2.LINE_AA)
    for corners in row.tag_corners:
        cv2.polylines(image, [np.round(corners).astype(np.int32)], True, _TAG, 1, cv2.LINE_AA)
    words = f"{row.frame}  {len(row.lights)} lights"
    pose = seen.percept.pose
    if pose is not None:
        T = pose.T_station_camera
        points = (array_m - T[:3, 3]) @ T[:3, :3]
        points = points[camera.in_view(points)]
        for x, y in np.round(camera.project(points)).astype(int).tolist() if len(points) else []:
            cv2.drawMarker(image, (x, y), _EXPECTED, cv2.MARKER_CROSS, 9, 1, cv2.LINE_AA)
        away_m = float(np.linalg.norm(T[:3, 3]))
        words += f"  {away_m:.2f} m  {pose.reprojection_error_px:.2f} px{'' if pose.measured else '  carried on'}"
    (width, height), _ = cv2.getTextSize(words, _FONT, 0.45, 1)
    cv2.rectangle(image, (4, 4), (width + 12, height + 16), (0, 0, 0), cv2.FILLED)
    cv2.putText(image, words, (8, height + 10), _FONT, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
    return image


class AnnotatedVideo:
    """A video file of annotated frames."""

    def __init__(self, path: Path, camera: Camera, array_m: Array) -> None:
        """Open the file.

        Raises:
            ConfigError: an ending of no known kind of video, or a file that cannot be written.
        """
        if path.suffix not in CODECS:
            raise ConfigError("video", str(path), f"a file name that ends in {' or '.join(CODECS)}")
        codec = cv2.VideoWriter.fourcc(*CODECS[path.suffix])
        self._path, self._camera, self._array_m = path, camera, array_m
        self._writer = cv2.VideoWriter(
            str(path), cv2.CAP_FFMPEG, codec, camera.rate_hz, (camera.width_px, camera.height_px)
        )
        if not self._writer.isOpened():
            raise ConfigError("video", str(path), "a file that can be written")

    def add(self, seen: Seen) -> None:
        """Draw a frame and append it."""
        self._writer.write(cv2.cvtColor(annotated(seen, self._camera, self._array_m), cv2.COLOR_RGB2BGR))

    def close(self) -> None:
        """Finish the file.

        Raises:
            AuvdockError: nothing was written.
        """
        self._writer.release()
        if not self._path.is_file() or self._path.stat().st_size == 0:
            raise AuvdockError(f"{self._path} could not be written")
