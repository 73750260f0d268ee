"""A camera for people: behind and above the vehicle, in clear view without water between."""

from __future__ import annotations

import mujoco
import numpy as np

from auvdock.core.arrays import Image
from auvdock.optics.gl import make_renderer
from auvdock.sim.simulator import Simulator

__all__ = ["ChaseCamera"]


class ChaseCamera:
    """Follows the vehicle; makes its OpenGL context at the first picture and leaves it behind when pickled."""

    def __init__(self, simulator: Simulator, width_px: int = 640, height_px: int = 360) -> None:
        """Remember what to look at."""
        self._simulator = simulator
        self._width_px = width_px
        self._height_px = height_px
        self._renderer: mujoco.Renderer | None = None

    def render(self) -> Image:
        """(H, W, 3) uint8 RGB of the vehicle and what lies before it.

        Raises:
            GraphicsError: no OpenGL context can be had.
        """
        if self._renderer is None:
            self._renderer = make_renderer(self._simulator.model, self._width_px, self._height_px)
        truth = self._simulator.truth
        camera = mujoco.MjvCamera()
        camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        forward = truth.T_world_body[:3, 0]
        camera.lookat[:] = truth.T_world_body[:3, 3] + 0.8 * forward
        camera.azimuth = float(np.degrees(np.arctan2(forward[1], forward[0])))
        camera.elevation = -20.0
        camera.distance = 4.0
        self._renderer.update_scene(self._simulator.data, camera)
        return self._renderer.render()

    def close(self) -> None:
        """Release the OpenGL context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, object]:
        """Everything but the OpenGL context."""
        return {**self.__dict__, "_renderer": None}
