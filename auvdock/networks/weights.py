"""Weights of a network from a file."""

from __future__ import annotations

import pickle
import warnings
from pathlib import Path
from typing import Any, cast

import torch
from torch import Tensor

from auvdock.core.errors import ConfigError
from auvdock.networks.network import Network

__all__ = ["load_weights"]


def load_weights(network: Network, path: Path) -> None:
    """Put the weights of a file into a network; nothing that a file could say is run.

    Args:
        network: not yet folded.
        path: a dictionary of tensors by name, as `torch.save(network.state_dict(), path)` writes it.

    Raises:
        ConfigError: a file that cannot be read, that holds other things than tensors, or that is another network's.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about files that PyTorch then refuses, or reads
            found: Any = torch.load(path, map_location="cpu", weights_only=True)
    except (OSError, RuntimeError, ValueError, EOFError, pickle.UnpicklingError) as error:
        reason = str(error).partition("\n")[0]
        raise ConfigError("weights", str(path), f"a file of tensors that PyTorch can read ({reason})") from error
    values: list[Any] = list(cast(dict[Any, Any], found).values()) if isinstance(found, dict) else []
    if not values or not all(isinstance(value, Tensor) for value in values):
        raise ConfigError("weights", str(path), "a file of tensors by name")
    try:
        network.load_state_dict(cast(dict[str, Tensor], found))
    except RuntimeError as error:
        lines = [line.strip() for line in str(error).splitlines()[1:3]]
        raise ConfigError("weights", str(path), f"weights of this model ({' '.join(lines)[:200]})") from error
