"""Detectors of square tags on frames, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
from auvdock.core.contracts import Frame, RegionOfInterest, TagDetection
from auvdock.core.errors import ConfigError
from auvdock.perception.landing.tag_edges import corners_from_lines, lines_through, refined_corners
from auvdock.perception.landing.tag_families import TagCodes, TagFamily, equalised
from auvdock.perception.solvers import homography

__all__ = ["TAG_DETECTORS", "AprilTagDetector", "ContourTagDetector", "TagDetector", "make_tag_detector"]

TAG_DETECTORS = ("apriltag", "contour")
"""Names of the tag detectors."""
_MIN_REGION_PX = 12
_SMALL_PX = 120
"""A region below this is enlarged twice before it is searched: cells of two pixels are not read reliably."""
_READ_PX = 200.0
"""Side of a region that is enough to read the tag in it: cells of some 15 pixels."""


class TagDetector(Protocol):
    """Finds tags in a frame."""

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> tuple[TagDetection, ...]:
        """Detect in the whole frame, or only in the given regions when there are any."""
        ...


def make_tag_detector(
    name: str, numbers: tuple[int, ...] | None = None, family: TagFamily = "36h11", clahe: bool = False
) -> TagDetector:
    """A tag detector by name.

    Args:
        name: one of `TAG_DETECTORS`.
        numbers: the tags of the family that are looked for; None for all. To compare a square that is no tag with the
            587 of 36h11 takes OpenCV 2.4 ms, more than everything else that it does with a region.
        family: of the tags.
        clahe: equalise contrast before looking; corners are measured in the frame as it is all the same.

    Raises:
        ConfigError: no detector or family of that name, or a number that the family does not have.
    """
    if name == "apriltag":
        return AprilTagDetector(numbers, family, clahe)
    if name == "contour":
        return ContourTagDetector(numbers, family, clahe)
    raise ConfigError("tag_detector", name, f"one of {', '.join(TAG_DETECTORS)}")


class AprilTagDetector:
    """OpenCV's detector of the family, with corners from lines through sub-pixel edges."""

    def __init__(
        self, numbers: tuple[int, ...] | None = None, family: TagFamily = "36h11", clahe: bool = False
    ) -> None:
        """Set OpenCV's detector up for the tags of these numbers, None for the whole family."""
        self._made_of = numbers, family, clahe
        self._clahe = clahe
        self._codes = TagCodes(family, numbers)
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        settings.adaptiveThreshWinSizeMin, settings.adaptiveThreshWinSizeMax = 9, 29
        settings.adaptiveThreshWinSizeStep = 20
        # A tag in haze has little contrast: OpenCV's 7 levels would drown it.
        settings.adaptiveThreshConstant = 3
        settings.minMarkerPerimeterRate = 0.05
        # The white margin's outline runs one cell outside the black square, its corners 0.35 / cells of the perimeter
        # away (0.044 for the eight cells of 36h11). At OpenCV's 0.125 the two count as one candidate, and of a tag
        # turned by some 30° the outer one is often kept, which holds no code. Far below, the inner side of the black
        # border is taken for a square of its own.
        settings.minMarkerDistanceRate = 0.32 / self._codes.cells
        self._detector = cv2.aruco.ArucoDetector(self._codes.dictionary, settings)

    def __reduce__(self) -> tuple[type[AprilTagDetector], tuple[tuple[int, ...] | None, TagFamily, bool]]:
        """OpenCV's parts cannot be pickled: they are made anew."""
        return AprilTagDetector, self._made_of

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> tuple[TagDetection, ...]:
        """Detect in the whole frame, or only in the given regions when there are any."""
        found: list[TagDetection] = []
        for patch, origin in _patches(frame, regions):
            for scale in _scales(min(patch.shape), bool(regions)):
                tags = self._search(frame, patch, origin, scale)
                if tags:
                    found.extend(tags)
                    break
        return tuple(found)

    def _search(self, frame: Frame, patch: Image, origin: Array, scale: float) -> list[TagDetection]:
        """Tags of one patch, searched at a scale; their corners are of the full resolution all the same."""
        method = cv2.INTER_CUBIC if scale > 1.0 else cv2.INTER_AREA
        scaled = patch if scale == 1.0 else cv2.resize(patch, None, fx=scale, fy=scale, interpolation=method)
        searched = equalised(np.asarray(scaled, dtype=np.uint8)) if self._clahe else scaled
        corners, ids, _ = self._detector.detectMarkers(searched)
        # Without a tag `ids` may be None, which OpenCV's stubs do not say; `corners` is then empty.
        places = np.asarray(ids).ravel()
        found: list[TagDetection] = []
        for index, quad in enumerate(corners):
            # Pixel centres have integer coordinates; those of another scale lie between.
            rough = (np.asarray(quad, dtype=np.float64).reshape(4, 2) + 0.5) / scale - 0.5 + origin
            refined = refined_corners(frame, rough, self._codes.cells)
            if refined is not None:
                found.append(TagDetection(self._codes.numbers[int(places[index])], *refined))
        return found


class ContourTagDetector:
    """Paper C's way: smoothing, Canny, contours, quadrilaterals, code; corners from lines through the contour."""

    def __init__(
        self, numbers: tuple[int, ...] | None = None, family: TagFamily = "36h11", clahe: bool = False
    ) -> None:
        """Take the codes of the tags of these numbers, None for the whole family."""
        self._made_of = numbers, family, clahe
        self._clahe = clahe
        self._codes = TagCodes(family, numbers)

    def __reduce__(self) -> tuple[type[ContourTagDetector], tuple[tuple[int, ...] | None, TagFamily, bool]]:
        """OpenCV's parts cannot be pickled: they are made anew."""
        return ContourTagDetector, self._made_of

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> tuple[TagDetection, ...]:
        """Detect in the whole frame, or only in the given regions when there are any."""
        found: dict[int, TagDetection] = {}
        for patch, origin in _patches(frame, regions):
            smooth = np.asarray(cv2.medianBlur(cv2.GaussianBlur(patch, (3, 3), 0.0), 3), dtype=np.uint8)
            if self._clahe:  # noise is smoothed first: raised, it breaks the contours
                smooth = equalised(smooth)
            high, _ = cv2.threshold(smooth, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
            edges = cv2.Canny(smooth, 0.4 * high, 0.8 * high)
            contours, _ = cv2.findContours(edges, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            for contour in contours:
                quad = _quadrilateral(np.asarray(contour, dtype=np.int32), self._codes.cells)
                if quad is None:
                    continue
                number = self._read(smooth, quad)
                if number is None:
                    continue
                fitted = _fit(np.asarray(contour).reshape(-1, 2) + origin, quad + origin, frame)
                if fitted is not None:
                    tag_id, turns = number
                    found[tag_id] = TagDetection(tag_id, np.roll(fitted[0], turns, axis=0), fitted[1])
        return tuple(found.values())

    def _read(self, grey: Image, quad: Array) -> tuple[int, int] | None:
        """(number, quarter turns) of the code within a quadrilateral, None if it is none of the family's."""
        edge = self._codes.cells
        side = 6 * edge
        target = np.array([[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]]) - 0.5
        warp = homography(quad, target)
        if warp is None:
            return None
        flat = cv2.warpPerspective(grey, warp, (side, side))
        level, _ = cv2.threshold(flat, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
        cells = np.asarray(flat, dtype=np.float64).reshape(edge, 6, edge, 6)
        cells = cells[:, 1:5, :, 1:5].mean(axis=(1, 3))
        bits = (cells > level).astype(np.uint8)
        border = np.concatenate([bits[0], bits[-1], bits[1:-1, 0], bits[1:-1, -1]])
        if int(border.sum()) > 2:
            return None
        code = np.ascontiguousarray(bits[1:-1, 1:-1])
        read, place, turns = self._codes.dictionary.identify(code, 0.6)
        return (self._codes.numbers[int(place)], int(turns)) if read else None


def _scales(side_px: int, is_region: bool) -> tuple[float, ...]:
    """Scales at which to search a patch, one after the other until a tag is found.

    A region holds a tag of about half its side, and some 120 pixels of it are enough to read; a whole frame may hold
    one of any size.
    """
    if side_px < _SMALL_PX:
        return (2.0, 1.0) if is_region else (2.0,)
    if not is_region:
        return (0.5, 1.0)
    return (_READ_PX / side_px, 1.0) if side_px > 1.5 * _READ_PX else (1.0,)


def _patches(frame: Frame, regions: Sequence[RegionOfInterest]) -> list[tuple[Image, Array]]:
    """(grey patch, (2,) its origin in the image) of each region."""
    if not regions:
        return [(_grey(frame.image), np.zeros(2))]
    return [
        (_grey(frame.image[r.y0 : r.y1, r.x0 : r.x1]), np.array([float(r.x0), float(r.y0)]))
        for r in regions
        if r.x1 - r.x0 >= _MIN_REGION_PX and r.y1 - r.y0 >= _MIN_REGION_PX
    ]


def _grey(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _quadrilateral(contour: NDArray[np.int32], cells: int) -> Array | None:
    """(4, 2) corners of a contour that is a convex quadrilateral, clockwise in the image; None if it is none.

    A square whose cells, so many along an edge, are less than a pixel wide holds no code.
    """
    length = cv2.arcLength(contour, True)
    if length < 4 * cells:
        return None
    quad = cv2.approxPolyDP(contour, 0.04 * length, True)
    if len(quad) != 4 or not cv2.isContourConvex(quad) or abs(cv2.contourArea(quad)) < cells**2:
        return None
    corners = np.asarray(quad, dtype=np.float64).reshape(4, 2)
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    return corners if a[0] * b[1] - a[1] * b[0] > 0.0 else corners[::-1].copy()


def _fit(contour: Array, quad: Array, frame: Frame) -> tuple[Array, float] | None:
    """Corners where lines through the contour's sides meet, and their standard deviation; sides without their ends."""
    sides: list[Array] = []
    for side in range(4):
        start, way = quad[side], quad[(side + 1) % 4] - quad[side]
        square = float(way @ way)
        share = (contour - start) @ way / square
        gap = np.abs((contour - start) @ np.array([-way[1], way[0]])) / np.sqrt(square)
        sides.append(contour[(share > 0.1) & (share < 0.9) & (gap < 0.1 * np.sqrt(square) + 1.0)])
    points = np.zeros((4, max(map(len, sides)), 2))
    good = np.zeros(points.shape[:2], dtype=np.bool_)
    for row, near in enumerate(sides):
        points[row, : len(near)] = near
        good[row, : len(near)] = True
    lines = lines_through(frame.camera.normalise(points.reshape(-1, 2)).reshape(points.shape), good)
    corners = corners_from_lines(lines, frame.camera) if lines is not None else None
    if lines is None or corners is None:
        return None
    # A contour runs through whole pixels: its lines are no better than a third of one.
    focal = float(frame.camera.matrix[0, 0])
    return corners, float(np.hypot(0.3, focal * np.sqrt(lines.variance_at_ends())))
