"""Lights found by a trained network through ONNX Runtime, on the CPU."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import onnxruntime

from auvdock.core.arrays import Array, Image, IntArray
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections, Frame, RegionOfInterest
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, Positive, PositiveShare
from auvdock.perception.flux import DISC_RAD, spot_flux
from auvdock.perception.network_file import NetworkFile, read_network
from auvdock.perception.network_pictures import network_input, network_objects
from auvdock.perception.spots import crop_of, inside, light_class
from auvdock.perception.suppression import SuppressionCfg

__all__ = ["NetworkDetector", "NetworkDetectorCfg"]

_STRIDE_KEY = "stride_px"
_BOX_NUMBERS, _POINT_NUMBERS = 4, 3


@dataclass(frozen=True)
class NetworkDetectorCfg(Checked):
    """Settings of a network that detects."""

    min_score: PositiveShare | None = None
    """Less sure detections are dropped; None: what the network's card says."""
    max_lights: Count = 32
    """Only the surest are kept."""
    threads: Count = 1
    """That compute a picture; with one, the same picture gives the same bits."""
    flux: bool = False
    """Measure each light's flux as well."""
    flux_disc_rad: Positive = DISC_RAD
    """Radius of the disc in which it is measured."""


class NetworkDetector:
    """Finds lights by a network of one class and one keypoint.

    A picture goes in at its own size, its border repeated up to a multiple of the network's stride. Of cells that speak
    of one light the surest stays (paper B, algorithm 1). The network knows no colours: the light's own is read from the
    picture about it, as by the classical detectors.
    """

    def __init__(self, name: str, cfg: NetworkDetectorCfg | None = None) -> None:
        """Load a network.

        Args:
            name: of one that is shipped, or a file "mine.onnx" with its card "mine.toml".
            cfg: settings.

        Raises:
            ConfigError: no such network, or a file that is damaged or holds something else.
        """
        self._file, self._cfg = read_network(name), cfg or NetworkDetectorCfg()
        least = self._cfg.min_score
        self._suppression = SuppressionCfg(min_score=self._file.card.min_score if least is None else least)
        self._session = _session(self._file, self._cfg.threads)
        self._stride_px = _stride(self._session, self._file)

    def __reduce__(self) -> tuple[type[NetworkDetector], tuple[str, NetworkDetectorCfg]]:
        """A session of ONNX Runtime can be neither copied nor pickled: a copy loads the network anew."""
        return type(self), (self._file.name, self._cfg)

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame, or only in the given regions when there are any.

        Centres are the network's keypoints, scores its own.
        """
        image = frame.image
        if not regions:
            found = self._find(image, 0, 0)
        else:
            parts = [self._find_in(image, region) for region in regions]
            found = inside(_joined([part for part in parts if len(part)]), regions)
        if not self._cfg.flux:
            return found
        return dataclasses.replace(found, flux=spot_flux(frame, found.centre_px, self._cfg.flux_disc_rad))

    def _find_in(self, image: Image, region: RegionOfInterest) -> Detections:
        height, width = image.shape[:2]
        left, top, right, bottom = crop_of(region, height, width)
        if right <= left or bottom <= top:
            return Detections.empty()
        found = self._find(np.ascontiguousarray(image[top:bottom, left:right]), left, top)
        return inside(found, (region,))

    def _find(self, image: Image, left: int, top: int) -> Detections:
        height, width = image.shape[:2]
        (name,) = (given.name for given in self._session.get_inputs())
        said: Any = self._session.run(None, {name: network_input(image, self._stride_px)})[0]
        found: Array = np.asarray(said[0], dtype=np.float64)
        objects = network_objects(found, 1, (width, height), self._suppression, self._cfg.max_lights)
        corner = np.array([left, top], dtype=np.float64)
        return Detections(
            objects.xyxy + np.tile(corner, 2),
            objects.keypoints_px[:, 0] + corner,
            np.clip(objects.scores, 0.0, 1.0),
            _colours(image, objects.xyxy),
        )


def _session(file: NetworkFile, threads: int) -> onnxruntime.InferenceSession:
    options: Any = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(file.model, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # what ONNX Runtime raises has no class of its own below it
        reason = str(error).partition("\n")[0]
        raise ConfigError("detector", file.name, f"an ONNX file that ONNX Runtime can load ({reason})") from error


def _stride(session: onnxruntime.InferenceSession, file: NetworkFile) -> int:
    """The network's stride; refuses what is no network of one class and one keypoint for pictures of any size."""
    told = session.get_modelmeta().custom_metadata_map.get(_STRIDE_KEY, "")
    inputs, outputs, card = session.get_inputs(), session.get_outputs(), file.card
    rows = _BOX_NUMBERS + 1 + _POINT_NUMBERS
    fits = (
        (card.classes, card.keypoints) == (1, 1)
        and told.isdecimal()
        and int(told) > 0
        and (len(inputs), len(outputs)) == (1, 1)
        and inputs[0].type == outputs[0].type == "tensor(float)"
        and list(inputs[0].shape[:2]) == [1, 3]
        and [isinstance(size, str) for size in inputs[0].shape[2:]] == [True, True]
        and list(outputs[0].shape[:2]) == [1, rows]
        and len(outputs[0].shape) == 3
    )
    if not fits:
        remedy = (
            f"a network of `auvdock export` with one class and one keypoint: (1, 3, h, w) to (1, {rows}, cells), with "
            f"{_STRIDE_KEY} in its metadata"
        )
        raise ConfigError("detector", file.name, remedy)
    return int(told)


def _colours(image: Image, xyxy: Array) -> IntArray:
    """(n,) `BLUE` or `RED` of each light, see `spots.light_class`."""
    height, width = image.shape[:2]
    low = np.clip(np.floor(xyxy[:, :2] + 0.5), 0, (width - 1, height - 1)).astype(np.int64)
    high = np.maximum(np.clip(np.ceil(xyxy[:, 2:] + 0.5), 0, (width, height)).astype(np.int64), low + 1)
    boxes = np.hstack([low, high]).tolist()
    return np.array([light_class(image, *box) for box in boxes], dtype=np.int64)


def _joined(parts: Sequence[Detections]) -> Detections:
    if not parts:
        return Detections.empty()
    return Detections(
        np.vstack([part.xyxy for part in parts]),
        np.vstack([part.centre_px for part in parts]),
        np.concatenate([part.score for part in parts]),
        np.concatenate([part.class_id for part in parts]),
    )
