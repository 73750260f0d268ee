"""OpenGL without a window: who makes a context here, and what a fork does to the driver behind it.

A process has one OpenGL driver, so what happened to it is kept once a process (`_driver`). Mesa's software rasteriser
starts threads, and so do other drivers; a forked process inherits the driver's memory without them and waits for them
for ever at its next context or at its end. Where nobody has started the driver before, it is therefore started without
threads of its own (LP_NUM_THREADS=0, unless the environment gives another number), and works in a fork. Where that was
not in our hands, a fork is told to be spawned instead.
"""

from __future__ import annotations

import atexit
import os
import sys
import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeVar

from auvdock.core.errors import GraphicsError
from auvdock.sim.mj import GL_REFUSAL

__all__ = ["Driver", "after_fork", "new_context", "renderer_name"]

_T = TypeVar("_T")
_WITHOUT = "or run without images: --fidelity beacons"
_REMEDY = (
    "install libegl1 and libgl1-mesa-dri and set MUJOCO_GL=egl, or install libosmesa6 and set MUJOCO_GL=osmesa; "
    f"{_WITHOUT}"
)
_FORKED = (
    "no OpenGL context for rendering: this process was forked from one that had rendered, which its driver does not "
    "survive; start processes by 'spawn' (gymnasium.vector.AsyncVectorEnv(..., context='spawn'), "
    "multiprocessing.get_context('spawn')), or fork before the first image"
)
_THREADS = "LP_NUM_THREADS"
_WITHOUT_THREADS = ("llvmpipe", "softpipe")
"""Renderers that start no threads if `_THREADS` is 0."""


@dataclass
class Driver:
    """What happened to this process's driver.

    Attributes:
        forkable: EGL was started by us, on a renderer that has no threads.
        windowed: a context was made other than by EGL.
        lost: this process is a fork of one whose driver does not survive that.
    """

    forkable: bool = False
    windowed: bool = False
    lost: bool = False


_driver = Driver()


def new_context(width_px: int, height_px: int, use: Callable[[], _T]) -> tuple[Any, _T]:
    """An OpenGL context, and what `use` made while it was current; afterwards none is current.

    MUJOCO_GL's choice if it is set, else the first of EGL, on a desktop GLFW, and OSMesa with which both work.

    Raises:
        GraphicsError: none can be had; the message says what to install or to do.
    """
    if _driver.lost:
        raise GraphicsError(_FORKED)
    if GL_REFUSAL is not None:
        raise GraphicsError(f"no OpenGL context for rendering ({GL_REFUSAL}); {_WITHOUT}")
    failures: list[str] = []
    for maker in _makers():
        told: list[warnings.WarningMessage] = []
        try:
            with warnings.catch_warnings(record=True) as told:  # GLFW tells of its errors by warnings
                warnings.simplefilter("always")
                return _with(_make(maker, width_px, height_px), use)
        except Exception as error:  # drivers fail in many ways: ImportError, AttributeError, RuntimeError, GLError
            why = str(told[0].message) if told else str(error) or repr(error)
            failures.append(f"{maker.removeprefix('mujoco.')}: {why.splitlines()[0]}")
    raise GraphicsError(f"no OpenGL context for rendering ({'; '.join(failures)}); {_REMEDY}")


def renderer_name() -> str:
    """What the driver of the current context calls its renderer; empty where it does not tell."""
    try:
        library = import_module("OpenGL.GL")
        name = library.glGetString(library.GL_RENDERER)
    except Exception:  # PyOpenGL cannot be had beside GLFW or CGL, or looks at another library than they do
        return ""
    return name.decode(errors="replace") if isinstance(name, bytes) else ""


def _with(context: Any, use: Callable[[], _T]) -> tuple[Any, _T]:  # noqa: ANN401
    try:
        with context.as_current():
            return context, use()
    except Exception:
        context.free()
        raise


def _makers() -> list[str]:
    if sys.platform != "linux" or os.environ.get("MUJOCO_GL", "").strip():
        return ["mujoco"]
    desktop = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return ["mujoco.egl", *(["mujoco.glfw"] if desktop else []), "mujoco.osmesa"]


def _make(maker: str, width_px: int, height_px: int) -> Any:  # noqa: ANN401
    found: Any = import_module(maker).GLContext
    # No destructor: it would free the context without what MuJoCo keeps in it, and in a forked process too.
    owned = type(found.__name__, (found,), {"__del__": _leave, "__module__": found.__module__})
    by_egl = found.__module__ == "mujoco.egl"
    started_before = _egl_started()
    with _without_threads():
        context = owned(width_px, height_px)
        with context.as_current():
            name = renderer_name()
        if by_egl and not started_before:
            _driver.forkable = name.startswith(_WITHOUT_THREADS) and os.environ[_THREADS] == "0"
    _driver.windowed |= not by_egl
    return context


def _leave(context: object) -> None:
    """Nothing happens."""


@contextmanager
def _without_threads() -> Generator[None]:
    """Tell Mesa to rasterise in the calling thread, unless the environment says otherwise; read as EGL starts."""
    if _THREADS in os.environ:
        yield
        return
    os.environ[_THREADS] = "0"
    try:
        yield
    finally:
        del os.environ[_THREADS]


def _egl_started() -> bool:
    return getattr(sys.modules.get("mujoco.egl"), "EGL_DISPLAY", None) is not None


def after_fork() -> None:
    """In the new process: whether the driver can still be used, and that its end is the parent's business."""
    _driver.lost |= _driver.windowed or (_egl_started() and not _driver.forkable)
    if (end := getattr(sys.modules.get("mujoco.egl"), "_terminate_display", None)) is not None:
        atexit.unregister(end)  # it would wait for threads that this process does not have


if hasattr(os, "register_at_fork"):  # POSIX; elsewhere there is no fork
    os.register_at_fork(after_in_child=after_fork)
