"""A camera for people: behind and above the vehicle, in clear view without water between."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from auvdock.core.arrays import Array, Image
from auvdock.optics.offscreen import Offscreen
from auvdock.sim.mj import mujoco
from auvdock.sim.simulator import Simulator

__all__ = ["ChaseCamera", "View", "from_behind", "from_the_side"]


class View(NamedTuple):
    """Where the chase camera stands: it looks at a point of the world from a distance, by azimuth and elevation."""

    look_at_m: Array
    azimuth_deg: float
    elevation_deg: float
    distance_m: float


def from_behind(simulator: Simulator) -> View:
    """The vehicle and what lies before it, from behind and above."""
    T_world_body = simulator.truth.T_world_body
    forward = T_world_body[:3, 0]
    azimuth_deg = math.degrees(math.atan2(forward[1], forward[0])) + 25.0
    return View(T_world_body[:3, 3] + 1.2 * forward, azimuth_deg, -18.0, 4.5)


def from_the_side(simulator: Simulator) -> View:
    """From so far back that the vehicle and the platform below it are both in view."""
    platform_m = simulator.T_world_station[:3, 3]
    down = simulator.truth.T_world_body[:3, 3] - platform_m
    return View(platform_m + 0.5 * down, 60.0, -14.0, 2.2 + 1.4 * float(np.linalg.norm(down)))


class ChaseCamera:
    """Follows the vehicle; makes its OpenGL context at the first picture and leaves it behind when pickled."""

    def __init__(
        self,
        simulator: Simulator,
        view: Callable[[Simulator], View] = from_behind,
        width_px: int = 640,
        height_px: int = 360,
    ) -> None:
        """Remember what to look at, and from where."""
        self._simulator, self._view = simulator, view
        self._size = (width_px, height_px)
        self._offscreen: Offscreen | None = None
        self._scene: Any = None

    def render(self) -> Image:
        """(H, W, 3) uint8 RGB of the vehicle and what lies before it.

        Raises:
            GraphicsError: no OpenGL context can be had, or it is at work in another thread.
        """
        simulator = self._simulator
        camera = mujoco.MjvCamera()
        camera.lookat[:], camera.azimuth, camera.elevation, camera.distance = self._view(simulator)
        # The simulator leaves derived poses stale while nobody looks; draw from the state itself.
        mujoco.mj_kinematics(simulator.model, simulator.data)
        category = mujoco.mjtCatBit.mjCAT_ALL
        offscreen, scene = self._drawn_by()
        mujoco.mjv_updateScene(simulator.model, simulator.data, mujoco.MjvOption(), None, camera, category, scene)
        return np.ascontiguousarray(offscreen.draw(scene)[::-1])

    def close(self) -> None:
        """Release the OpenGL context."""
        if self._offscreen is not None:
            self._offscreen.close()
        self._offscreen = self._scene = None

    def __getstate__(self) -> dict[str, Any]:
        """Everything but OpenGL's state, which lives in one process."""
        return {"simulator": self._simulator, "view": self._view, "size": self._size}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A camera without a context."""
        self.__init__(state["simulator"], state["view"], *state["size"])

    def _drawn_by(self) -> tuple[Offscreen, Any]:
        if self._offscreen is None or not self._offscreen.is_ours:
            model = self._simulator.model
            self._offscreen = Offscreen(model, *self._size)
            scene = self._scene = mujoco.MjvScene(model, 2 * model.ngeom + 100)
            scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
            scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # software rendering takes ten times as long with them
        return self._offscreen, self._scene
