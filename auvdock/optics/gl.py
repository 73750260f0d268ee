"""Offscreen OpenGL through MuJoCo's own renderer: colour and metric depth of the static scene in one pass."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
from auvdock.core.errors import GraphicsError
from auvdock.optics.offscreen import Offscreen
from auvdock.sim.mj import MjModel, mujoco

__all__ = ["StaticRenderer", "probe_gl"]

_NEAR_M, _FAR_M = 0.05, 80.0
_UNSEEN_GROUP = 5
_PROBE_XML = """
<mujoco><worldbody>
  <geom type="box" pos="0 0 2.5" size="3 3 0.5" rgba="1 0.5 0 1"/>
</worldbody></mujoco>
"""
"""A wall 2 m before a camera in the origin that looks along z."""
_PROBE_DISTANCE_M = 2.0


class StaticRenderer:
    """Draws what does not move: geoms fixed to the world, under one light from above.

    The vehicle itself is not drawn, so a camera may sit inside its hull. No context is made before the first `render`;
    after a fork, if the driver survives one, and after unpickling a new one is made in the new process.
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
        self._offscreen: Offscreen | None = None
        self._scene: Any = None

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
        if self._offscreen is not None:
            self._offscreen.close()
        self._offscreen = self._scene = None

    def render(self, T_world_camera: Array) -> tuple[Image, NDArray[np.float32]]:
        """Shaded albedo (h, w, 3) uint8 and depth along the optical axis (h, w) in metres; rows from the bottom up.

        Depth is `inf` where there is nothing.

        Raises:
            GraphicsError: no OpenGL context can be had here, or it is at work in another thread; the message says what
                to install or to do.
        """
        offscreen, scene = self.drawn_by()
        for camera in scene.camera:
            camera.pos[:] = T_world_camera[:3, 3]
            camera.forward[:] = T_world_camera[:3, 2]
            camera.up[:] = -T_world_camera[:3, 1]
            camera.frustum_near, camera.frustum_far = _NEAR_M, _FAR_M
            camera.frustum_top, camera.frustum_bottom = self._tangents[1] * _NEAR_M, -self._tangents[1] * _NEAR_M
            camera.frustum_center, camera.frustum_width = 0.0, self._tangents[0] * _NEAR_M
        depth = np.empty(self._size[::-1], dtype=np.float32)
        colour = offscreen.draw(scene, depth)
        empty = depth <= 0.0
        depth *= np.float32(_FAR_M - _NEAR_M)
        depth += np.float32(_NEAR_M)
        np.divide(np.float32(_NEAR_M * _FAR_M), depth, out=depth)
        depth[empty] = np.inf
        return colour, depth

    @property
    def name(self) -> str:
        """What draws.

        Raises:
            GraphicsError: no OpenGL context can be had here; the message says what to install or to do.
        """
        return self.drawn_by()[0].name

    def drawn_by(self) -> tuple[Offscreen, Any]:
        """The context and MuJoCo's scene in it; made when first asked for in a process.

        Raises:
            GraphicsError: no OpenGL context can be had here.
        """
        if self._offscreen is None or not self._offscreen.is_ours:
            self._offscreen = Offscreen(self._model, *self._size, coarse=True)
            self._scene = self._static_scene()
        return self._offscreen, self._scene

    def _static_scene(self) -> Any:  # noqa: ANN401
        model = self._model
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
        return scene


def probe_gl() -> str:
    """Draw a wall and look at it; the name of what drew it.

    Raises:
        GraphicsError: no OpenGL context can be had, or what it draws is wrong.
    """
    renderer = StaticRenderer(mujoco.MjModel.from_xml_string(_PROBE_XML), 16, 16, 1.0, 1.0)
    try:
        colour, depth = renderer.render(np.eye(4))
        red, green, blue = (int(value) for value in colour[8, 8])
        distance_m = float(depth[8, 8])
        if not (red > green > blue == 0) or abs(distance_m - _PROBE_DISTANCE_M) > 0.01 * _PROBE_DISTANCE_M:
            raise GraphicsError(
                f"{renderer.name}: draws an orange wall at {_PROBE_DISTANCE_M:g} m as ({red}, {green}, {blue}) at "
                f"{distance_m:.3g} m; update the graphics driver, or set MUJOCO_GL to another of egl and osmesa"
            )
        return renderer.name
    finally:
        renderer.close()
