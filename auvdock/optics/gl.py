"""Offscreen OpenGL through MuJoCo's own renderer: colour and metric depth of the static scene in one pass."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
from auvdock.core.errors import GraphicsError
from auvdock.sim.mj import MjModel, mujoco

__all__ = ["StaticRenderer", "offscreen_context", "probe_gl"]

_NEAR_M, _FAR_M = 0.05, 80.0
_COARSE = {"offsamples": 0, "shadowsize": 0, "numslices": 12, "numstacks": 6, "numquads": 1}
"""Quality while the context is made: no multisampling, no shadows, and few facets on what is round."""
_UNSEEN_GROUP = 5
_REMEDY = (
    "install libegl1 and libgl1-mesa-dri and set MUJOCO_GL=egl, or install libosmesa6 and set MUJOCO_GL=osmesa; "
    "or run without images: --fidelity beacons"
)


class StaticRenderer:
    """Draws what does not move: geoms fixed to the world, under one light from above.

    The vehicle itself is not drawn, so a camera may sit inside its hull. No context is made before the first `render`;
    after a fork or unpickling a new one is made in the new process.
    """

    def __init__(
        self,
        model: MjModel,
        width_px: int,
        height_px: int,
        tangent_x: float,
        tangent_y: float,
        hidden_geoms: tuple[str, ...] = (),
    ) -> None:
        """Keep the view, half width and half height as tangents of angles, and the names of geoms to leave out."""
        self._model = model
        self._hidden = hidden_geoms
        self._size = (width_px, height_px)
        self._tangents = (tangent_x, tangent_y)
        self._process = -1
        self._drop()

    def _drop(self) -> None:
        self._gl: Any = None
        self._context: Any = None
        self._scene: Any = None
        self._process = -1

    def __getstate__(self) -> dict[str, Any]:
        """Everything but OpenGL's state, which lives in one process."""
        return {"model": self._model, "size": self._size, "tangents": self._tangents, "hidden": self._hidden}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A renderer without a context."""
        width, height = state["size"]
        tangent_x, tangent_y = state["tangents"]
        self.__init__(state["model"], width, height, tangent_x, tangent_y, state["hidden"])

    def close(self) -> None:
        """Free the context, if this process has one."""
        if self._process == os.getpid():
            self._gl.make_current()
            self._context.free()
            self._gl.free()
        self._drop()

    def render(self, T_world_camera: Array) -> tuple[Image, NDArray[np.float32]]:
        """Shaded albedo (h, w, 3) uint8 and depth along the optical axis (h, w) in metres; rows from the bottom up.

        Depth is `inf` where there is nothing.

        Raises:
            GraphicsError: no OpenGL context can be had here; the message says what to install.
        """
        if self._process != os.getpid():
            self._drop()
            self._open()
        self._gl.make_current()
        width, height = self._size
        scene = self._scene
        for camera in scene.camera:
            camera.pos[:] = T_world_camera[:3, 3]
            camera.forward[:] = T_world_camera[:3, 2]
            camera.up[:] = -T_world_camera[:3, 1]
            camera.frustum_near, camera.frustum_far = _NEAR_M, _FAR_M
            camera.frustum_top, camera.frustum_bottom = self._tangents[1] * _NEAR_M, -self._tangents[1] * _NEAR_M
            camera.frustum_center, camera.frustum_width = 0.0, self._tangents[0] * _NEAR_M
        rect = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(rect, scene, self._context)
        colour = np.empty((height, width, 3), dtype=np.uint8)
        depth = np.empty((height, width), dtype=np.float32)
        mujoco.mjr_readPixels(colour, depth, rect, self._context)
        # Reversed depth: 1 at the near plane, 0 at the far plane.
        empty = depth <= 0.0
        depth *= np.float32(_FAR_M - _NEAR_M)
        depth += np.float32(_NEAR_M)
        np.divide(np.float32(_NEAR_M * _FAR_M), depth, out=depth)
        depth[empty] = np.inf
        return colour, depth

    def _open(self) -> None:
        width, height = self._size
        model = self._model
        quality = model.vis.quality
        kept = {name: getattr(quality, name) for name in _COARSE}
        try:
            self._gl = offscreen_context(width, height)
            self._gl.make_current()
            for name, value in _COARSE.items():
                setattr(quality, name, value)
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_resizeOffscreen(width, height, self._context)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        except GraphicsError:
            self._drop()
            raise
        except Exception as error:
            self._drop()
            raise GraphicsError(f"no OpenGL context for rendering ({error}); {_REMEDY}") from error
        finally:
            for name, value in kept.items():
                setattr(quality, name, value)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        scene = mujoco.MjvScene(model, 2 * model.ngeom + 100)
        for flag in ("SHADOW", "REFLECTION", "SKYBOX", "FOG", "HAZE"):
            scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = 0
        static = mujoco.mjtCatBit.mjCAT_STATIC
        option = mujoco.MjvOption()
        found = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in self._hidden]
        groups = {geom: int(model.geom_group[geom]) for geom in found if geom >= 0}
        for geom in groups:
            model.geom_group[geom] = _UNSEEN_GROUP
        mujoco.mjv_updateScene(model, data, option, None, mujoco.MjvCamera(), static, scene)
        for geom, group in groups.items():
            model.geom_group[geom] = group
        scene.nlight = 1
        light = scene.lights[0]
        light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        light.headlight, light.castshadow = 0, 0
        light.pos[:], light.dir[:] = (0.0, 0.0, 10.0), (0.0, 0.0, -1.0)
        light.ambient[:], light.diffuse[:], light.specular[:] = 0.5, 0.5, 0.0
        self._scene = scene
        self._process = os.getpid()


def offscreen_context(width_px: int, height_px: int) -> Any:  # noqa: ANN401
    """An OpenGL context without a window: MUJOCO_GL's choice, else EGL, OSMesa or, on a desktop, GLFW.

    Raises:
        GraphicsError: none can be had; the message says what to install.
    """
    chosen = os.environ.get("MUJOCO_GL", "")
    desktop = sys.platform != "linux" or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    makers = ["mujoco"] if chosen or desktop else []
    makers += [] if chosen else ["mujoco.egl", "mujoco.osmesa"]
    failures: list[str] = []
    for maker in makers:
        try:
            return import_module(maker).GLContext(width_px, height_px)
        except Exception as error:  # drivers fail in many ways: ImportError, AttributeError, RuntimeError, GLError
            failures.append(f"{maker.removeprefix('mujoco.')}: {str(error).splitlines()[0] if str(error) else error!r}")
    raise GraphicsError(f"no OpenGL context for rendering ({'; '.join(failures)}); {_REMEDY}")


def probe_gl() -> str:
    """Make a context, ask it for its renderer's name, and free it.

    Raises:
        GraphicsError: no OpenGL context can be had.
    """
    context = offscreen_context(16, 16)
    try:
        context.make_current()
        name = import_module("OpenGL.GL").glGetString(import_module("OpenGL.GL").GL_RENDERER)
        return name.decode() if isinstance(name, bytes) else type(context).__module__
    finally:
        context.free()
