"""A picture's place to be drawn in: an OpenGL context without a window and MuJoCo's own state on it."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Image
from auvdock.core.errors import GraphicsError
from auvdock.optics.gl_driver import new_context, renderer_name
from auvdock.sim.mj import MjModel, mujoco

__all__ = ["Offscreen"]

_COARSE = {"offsamples": 0, "shadowsize": 0, "numslices": 12, "numstacks": 6, "numquads": 1}
"""Quality for cameras that measure: no multisampling, no shadows, and few facets on what is round."""

_BUSY = (
    "the OpenGL context is at work in another thread; use an environment in one thread at a time, or give each thread "
    "an environment of its own"
)


class Offscreen:
    """Draws scenes of one model into memory.

    It belongs to the process that made it. Threads take it one after the other: OpenGL lets a context be current in one
    thread at a time, so it is current only while something is drawn.
    """

    def __init__(self, model: MjModel, width_px: int, height_px: int, coarse: bool = False) -> None:
        """Make the context.

        Args:
            model: what its scenes show.
            width_px: width of its pictures.
            height_px: their height.
            coarse: draw as fast as can be, not as nice.

        Raises:
            GraphicsError: no OpenGL context can be had here; the message says what to install or to do.
        """
        self._process = -1
        self._size = (width_px, height_px)
        self._busy = threading.Lock()

        def resources() -> tuple[Any, str]:
            context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_resizeOffscreen(width_px, height_px, context)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
            context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
            return context, renderer_name()

        quality = model.vis.quality
        kept = {name: getattr(quality, name) for name in _COARSE} if coarse else {}
        try:
            for field in kept:
                setattr(quality, field, _COARSE[field])
            self.gl, (self._context, name) = new_context(width_px, height_px, resources)
        finally:
            for field, value in kept.items():
                setattr(quality, field, value)
        self._process = os.getpid()
        self.name = name or type(self.gl).__module__
        """What draws: the driver's renderer, or who made the context."""

    @property
    def is_ours(self) -> bool:
        """Whether this process made it; after a fork another is needed."""
        return self._process == os.getpid()

    def draw(self, scene: Any, depth: NDArray[np.float32] | None = None) -> Image:  # noqa: ANN401
        """Colour (h, w, 3) uint8; rows from the bottom up.

        Args:
            scene: MuJoCo's `MjvScene`.
            depth: (h, w) to be filled with MuJoCo's reversed depth, 1 at the near plane, 0 at the far plane and where
                there is nothing.

        Raises:
            GraphicsError: another thread is drawing with it at this moment.
        """
        width, height = self._size
        rect = mujoco.MjrRect(0, 0, width, height)
        colour = np.empty((height, width, 3), dtype=np.uint8)
        with self.current():
            mujoco.mjr_render(rect, scene, self._context)
            mujoco.mjr_readPixels(colour, depth, rect, self._context)
        return colour

    def close(self) -> None:
        """Free it, if this process made it.

        Raises:
            GraphicsError: another thread is drawing with it at this moment.
        """
        if self.is_ours:
            with self.current():
                self._context.free()
            self.gl.free()
            self._process = -1

    def __del__(self) -> None:
        """Free it with what holds it; at the end of the process all is freed anyway."""
        if not sys.is_finalizing():
            self.close()

    @contextmanager
    def current(self) -> Generator[None]:
        """Have the context current in this thread; what was current before is so again afterwards."""
        if not self._busy.acquire(blocking=False):
            raise GraphicsError(_BUSY)
        try:
            with ExitStack() as stack:
                try:
                    stack.enter_context(self.gl.as_current())
                except Exception as error:  # as many kinds as there are drivers
                    raise GraphicsError(_BUSY) from error
                yield
        finally:
            self._busy.release()
