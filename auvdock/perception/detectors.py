"""Detectors by name: the package's own and a user's."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar, cast

from auvdock.core.contracts import Detector
from auvdock.core.errors import ConfigError
from auvdock.core.named import find_named
from auvdock.core.station import ConicalStationCfg
from auvdock.perception.blob import BlobCfg, BlobDetector
from auvdock.perception.checked_detector import CheckedDetector
from auvdock.perception.halos import HaloCfg, HaloDetector
from auvdock.perception.landing.cores import CoreCfg, CoreDetector
from auvdock.perception.network_detector import NetworkDetector, NetworkDetectorCfg
from auvdock.perception.network_file import network_names
from auvdock.perception.threshold import ThresholdCfg, ThresholdDetector

__all__ = ["DETECTORS", "make_detector", "make_station_detector"]

DETECTORS = ("threshold", "blob", "cores", "halos")
"""The package's own detectors without a network; `network_file.network_names` has those with one. Anything with a colon
is looked up as "package.module:Name", anything that ends in ".onnx" is a network's file."""


def make_detector(name: str, **settings: Any) -> Detector:  # noqa: ANN401
    """A detector by name.

    Args:
        name: "threshold", "blob", "cores" (near lights), "halos" (lamps that burn out), a shipped network
            ("paper_a_light"), a network's file ("mine.onnx", with its card "mine.toml"), or "package.module:Name" for a
            class or factory of your own.
        settings: fields of the detector's configuration; keyword arguments of your own class.

    Raises:
        ConfigError: unknown name or setting, or an object that is no detector.
    """
    if name == "threshold":
        return ThresholdDetector(_configure(ThresholdCfg, settings))
    if name == "blob":
        return BlobDetector(_configure(BlobCfg, settings))
    if name == "cores":
        return CoreDetector(_configure(CoreCfg, settings))
    if name == "halos":
        return HaloDetector(_configure(HaloCfg, settings))
    if name.endswith(".onnx") or name in network_names():
        return NetworkDetector(name, _configure(NetworkDetectorCfg, settings))
    if ":" not in name:
        known = ", ".join((*DETECTORS, *network_names()))
        raise ConfigError("detector", name, f"one of {known}, or your own as package.module:Name or mine.onnx")
    return _foreign(name, settings)


def make_station_detector(name: str, station: ConicalStationCfg) -> Detector:
    """The detector `name` for a station: where that carries a rotating beacon, the package's own measure flux as well.

    Raises:
        ConfigError: as `make_detector`.
    """
    own = (*DETECTORS, *network_names())
    if station.rotating is not None and (name in own or name.endswith(".onnx")):
        return make_detector(name, flux=True)
    return make_detector(name)


_T = TypeVar("_T")


def _configure(cls: type[_T], settings: dict[str, Any]) -> _T:
    known = [field.name for field in dataclasses.fields(cast(Any, cls))]
    for key in settings:
        if key not in known:
            raise ConfigError(f"detector.{key}", settings[key], f"one of {', '.join(known)} (this key is unknown)")
    return cls(**settings)


def _foreign(name: str, settings: dict[str, Any]) -> Detector:
    factory = find_named("detector", name)
    try:
        detector: Any = factory(**settings)
    except TypeError as error:
        raise ConfigError("detector", name, f"settings that {name.partition(':')[2]} takes ({error})") from error
    if not callable(getattr(detector, "detect", None)):
        raise ConfigError("detector", name, "a class with a method detect(frame, regions) -> Detections")
    return CheckedDetector(name, detector)
