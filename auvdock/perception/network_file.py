"""A trained network's file with its card: shipped in `assets/networks/weights`, or a user's own."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from auvdock.assets import asset, asset_names
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.limits import Count, PositiveShare, at_least
from auvdock.core.strict import load_toml

__all__ = ["NetworkCardCfg", "NetworkFile", "network_names", "read_network"]

_FOLDER = "networks/weights"
_ENDING = ".onnx"


@dataclass(frozen=True)
class NetworkCardCfg(Checked):
    """What is to be known of a trained network before it is used."""

    model: str
    """A model of `assets/networks/models.toml`."""
    sha256: str
    """Checksum of the ONNX file."""
    classes: Count
    """How many; one is lights of any colour, which the detector then reads from the picture."""
    keypoints: Annotated[int, at_least(0)]
    """Of an object."""
    min_score: PositiveShare
    """Less sure detections are dropped unless something else is asked for."""
    data: str
    """What it was trained on: the command that makes it."""
    schedule: str
    """How long and how."""
    seed: int
    """Of the training."""
    limits: str
    """What it is not good for."""
    scores: Mapping[str, Any]
    """What it reaches on frames that it was not trained on."""


class NetworkFile(NamedTuple):
    """A network that may be loaded: its bytes are those that its card tells of."""

    name: str
    """As it was asked for, for errors."""
    model: bytes
    """What the ONNX file holds."""
    card: NetworkCardCfg
    """Its card."""


def network_names() -> tuple[str, ...]:
    """The networks that are shipped."""
    return asset_names(_FOLDER, _ENDING)


def read_network(name: str) -> NetworkFile:
    """A shipped network by name ("paper_a_light"), or a user's own file ("mine.onnx") with its card ("mine.toml").

    Raises:
        ConfigError: no such network or file, no card, or a file that is not the one of the card.
    """
    if name.endswith(_ENDING):
        file: Path | Traversable = Path(name)
        card_file: Path | Traversable = Path(name).with_suffix(".toml")
    elif name not in network_names():
        raise ConfigError("detector", name, f"one of {', '.join(network_names())}, or a file NAME.onnx")
    else:
        file, card_file = asset(_FOLDER, name, _ENDING), asset(_FOLDER, name)
    with located("detector."):
        card = load_toml(NetworkCardCfg, card_file)
    try:
        model = file.read_bytes()
    except (OSError, ValueError) as error:
        raise ConfigError("detector", name, f"an ONNX file that can be read ({error})") from error
    found = hashlib.sha256(model).hexdigest()
    if found != card.sha256:
        remedy = f"the file with the SHA-256 of its card, {card.sha256[:16]}…; this one has {found[:16]}…"
        raise ConfigError("detector", name, remedy)
    return NetworkFile(name, model, card)
