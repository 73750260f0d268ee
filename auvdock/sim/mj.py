"""MuJoCo for a strict type checker: its bindings are compiled and ship no stubs, so all of it is `Any`.

Compiled code calls MuJoCo's C functions themselves: the Python bindings' calls cost as much as a small model's step.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias

from auvdock.core.compiled import external
from auvdock.core.errors import ConfigError

__all__ = ["MjData", "MjModel", "addresses", "c_function", "mujoco"]


def _load() -> Any:  # noqa: ANN401
    try:
        return import_module("mujoco")
    except Exception as error:
        # MuJoCo loads the OpenGL library that MUJOCO_GL names while it is imported, and fails there in many ways.
        name = os.environ.get("MUJOCO_GL")
        if not name:
            raise
        remedy = (
            "egl (install libegl1 libgl1-mesa-dri), osmesa (install libosmesa6), or disable with --fidelity beacons"
        )
        raise ConfigError("MUJOCO_GL", name, f"one that loads here: {remedy}") from error


mujoco: Any = _load()
MjModel: TypeAlias = Any
"""`mujoco.MjModel`."""
MjData: TypeAlias = Any
"""`mujoco.MjData`."""


def c_function(name: str) -> Callable[[int, int], None]:
    """MuJoCo's own C function of an `mjModel` and an `mjData`, for compiled code; takes their addresses.

    Raises:
        ImportError: MuJoCo's library is not where its package keeps it.
    """
    for folder in mujoco.__path__:
        for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
            for library in sorted(Path(folder).glob(pattern)):
                return external(library, name, 2)
    raise ImportError(f"no MuJoCo library in {list(mujoco.__path__)}")


def addresses(model: MjModel, data: MjData) -> tuple[int, int]:
    """Where a model and its data lie in memory."""
    return model._address, data._address
