"""MuJoCo for a strict type checker: its bindings are compiled and ship no stubs, so all of it is `Any`.

Compiled code calls MuJoCo's C functions themselves: the Python bindings' calls cost as much as a small model's step.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias

from auvdock.numeric.compiled import external

__all__ = ["GL_REFUSAL", "MjData", "MjModel", "addresses", "c_function", "mujoco"]


def _load() -> tuple[Any, str | None]:
    """MuJoCo, and why the OpenGL library that MUJOCO_GL names cannot be used; physics needs none."""
    try:
        return import_module("mujoco"), None
    except Exception as error:
        # MuJoCo loads that library while it is imported, and fails there in many ways.
        name = os.environ.get("MUJOCO_GL")
        if not name:
            raise
        os.environ["MUJOCO_GL"] = "disable"
        try:
            module = import_module("mujoco")
        finally:
            os.environ["MUJOCO_GL"] = name
        why = (str(error) or repr(error)).splitlines()[0]
        return module, (
            f"MUJOCO_GL: {name!r} cannot be used ({why}); give egl (install libegl1 libgl1-mesa-dri), osmesa (install "
            "libosmesa6), or leave it unset"
        )


_loaded = _load()
mujoco: Any = _loaded[0]
GL_REFUSAL = _loaded[1]
"""Why nothing can be rendered with MUJOCO_GL as it is; None if its value can be used or there is none."""
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
