"""MuJoCo for a strict type checker: its bindings are compiled and ship no stubs, so all of it is `Any`."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any, TypeAlias

from auvdock.core.errors import ConfigError

__all__ = ["MjData", "MjModel", "mujoco"]


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
