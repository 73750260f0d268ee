"""MuJoCo for a strict type checker: its bindings are compiled and ship no stubs, so all of it is `Any`."""

from __future__ import annotations

from importlib import import_module
from typing import Any, TypeAlias

__all__ = ["MjData", "MjModel", "mujoco"]

mujoco: Any = import_module("mujoco")
MjModel: TypeAlias = Any
"""`mujoco.MjModel`."""
MjData: TypeAlias = Any
"""`mujoco.MjData`."""
