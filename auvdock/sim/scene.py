"""The MuJoCo model of one vehicle and one station."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.marine import flip_vector
from auvdock.core.transforms import quat_wxyz_from_rotation
from auvdock.core.vehicle import HullPartCfg, MountCfg, VehicleCfg
from auvdock.sim.dock import Dock
from auvdock.sim.hydrodynamics import GRAVITY_M_S2
from auvdock.sim.mj import MjModel, mujoco

__all__ = ["LATCH", "VEHICLE", "build_model", "scene_xml"]

VEHICLE = "vehicle"
"""Name of the vehicle's body."""
LATCH = "latch"
"""Name of the weld that the latch switches on."""

_CONTACT_TIME_S = 0.03
"""Time constant of contacts: over three physics steps at 120 Hz (MuJoCo asks for two), a polymer lining's give."""
_CAMERA_FOVY_DEG = 50.0
"""Of the named cameras, which are for looking at the scene; perception's camera brings its own intrinsics."""
_SKIN = 'material="hull" group="2" condim="3" friction="0 0 0" mass="0"'
_FIN_SPAN_M = 0.055
_FIN_CHORD_M = 0.075


def build_model(vehicle: VehicleCfg, dock: Dock, dt_s: float) -> MjModel:
    """Compile the scene, with the contact solver told the vehicle's mass in water.

    MuJoCo scales a contact's softness by `body_invweight0`, taken from the dry mass; it is replaced by the same mean
    of M⁻¹'s diagonal with the added mass in it, so that contacts are as stiff as `solref` says.
    """
    model = mujoco.MjModel.from_xml_string(scene_xml(vehicle, dock, dt_s))
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, VEHICLE)
    inverse = np.diag(np.linalg.inv(vehicle.rigid_body_mass_body + vehicle.added_mass_body))
    model.body_invweight0[body] = (inverse[:3].mean(), inverse[3:].mean())
    model.dof_invweight0[:3] = inverse[:3].mean()
    model.dof_invweight0[3:6] = inverse[3:].mean()
    if model.M_rownnz[:6].tolist() != [1, 2, 3, 4, 5, 6]:
        raise RuntimeError("the free joint's mass matrix is not stored densely")
    return model


def scene_xml(vehicle: VehicleCfg, dock: Dock, dt_s: float) -> str:
    """MJCF of the scene; every element is named.

    Dense Jacobian and Newton solver for this small model, whose single body needs no islands; automatic reset is off
    because a diverged state must be seen.
    """
    assets = "\n    ".join(dock.assets())
    geoms = "\n      ".join(dock.geoms())
    return f"""
<mujoco model="auvdock">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{dt_s:.17g}" gravity="0 0 {-GRAVITY_M_S2}" integrator="Euler" solver="Newton" jacobian="dense"
      cone="elliptic" iterations="30" tolerance="1e-10">
    <flag autoreset="disable" island="disable" eulerdamp="disable"/>
  </option>
  <size memory="4M"/>
  <statistic center="0 0 {-dock.depth_m:.9g}" extent="4"/>
  <visual>
    <global offwidth="1920" offheight="1080"/>
    <quality offsamples="0" shadowsize="0"/>
    <map znear="0.005" zfar="25"/>
    <headlight ambient="0.35 0.35 0.35" diffuse="0.4 0.4 0.4" specular="0 0 0"/>
    <rgba fog="0.03 0.16 0.24 1"/>
  </visual>
  <default>
    <geom solref="{_CONTACT_TIME_S} 1" solimp="0.95 0.99 0.001"/>
  </default>
  <asset>
    <texture name="water" type="skybox" builtin="gradient" rgb1="0.06 0.30 0.42" rgb2="0.01 0.07 0.12" width="64"
      height="384"/>
    <material name="station" rgba="0.55 0.57 0.55 1" specular="0.1"/>
    <material name="floor" rgba="0.45 0.42 0.34 1" specular="0"/>
    <material name="hull" rgba="0.95 0.78 0.12 1" specular="0.2"/>
    <material name="fin" rgba="0.1 0.1 0.12 1" specular="0.1"/>
    <material name="lamp_blue" rgba="0.55 0.7 1 1" emission="1"/>
    <material name="lamp_red" rgba="1 0.35 0.25 1" emission="1"/>
    {assets}
  </asset>
  <worldbody>
    <light name="sun" directional="true" pos="0 0 0" dir="0.2 0.1 -1" diffuse="0.5 0.5 0.5" castshadow="false"/>
      {geoms}
    {_vehicle_body(vehicle, dock.free_world_m)}
  </worldbody>
  <equality>
    <weld name="{LATCH}" body1="{VEHICLE}" active="false" solref="{dock.latch_time_s} 1" solimp="0.9 0.95 0.01"/>
  </equality>
</mujoco>
"""


def _vehicle_body(vehicle: VehicleCfg, position_m: tuple[float, float, float]) -> str:
    quat, moments = _principal_inertia(vehicle)
    parts = "\n      ".join(_hull(vehicle) if not vehicle.hull else [_part(part) for part in vehicle.hull])
    place = " ".join(f"{part:.9g}" for part in position_m)
    com = " ".join(f"{part:.12g}" for part in vehicle.centre_of_gravity_body_m)
    cameras = "\n      ".join(
        _camera(name, mount) for name, mount in (("bow", vehicle.bow_camera), ("belly", vehicle.belly_camera))
    )
    return f"""<body name="{VEHICLE}" pos="{place}">
      <freejoint name="vehicle_free"/>
      <inertial pos="{com}" mass="{vehicle.mass_kg:.12g}" quat="{quat}" diaginertia="{moments}"/>
      {parts}
      {cameras}
      <site name="nose" pos="{vehicle.nose_x_m:.9g} 0 0" size="0.01" group="3"/>
    </body>"""


def _hull(vehicle: VehicleCfg) -> list[str]:
    """A torpedo: one capsule, and fins that are only drawn."""
    radius, tail = vehicle.radius_m, vehicle.tail_x_m
    fin_x = tail + 0.08
    fins = [
        f'<geom name="fin_{name}" type="box" pos="{fin_x:.9g} {y * (radius + 0.5 * _FIN_SPAN_M):.9g} '
        f'{z * (radius + 0.5 * _FIN_SPAN_M):.9g}" size="{0.5 * _FIN_CHORD_M} '
        f'{0.5 * _FIN_SPAN_M if y else 0.004} {0.5 * _FIN_SPAN_M if z else 0.004}" material="fin" group="2" '
        f'contype="0" conaffinity="0" mass="0"/>'
        for name, y, z in (("port", 1, 0), ("starboard", -1, 0), ("top", 0, 1), ("bottom", 0, -1))
    ]
    ends = f"{tail + radius:.9g} 0 0 {vehicle.nose_x_m - radius:.9g} 0 0"
    return [f'<geom name="hull" type="capsule" fromto="{ends}" size="{radius:.9g}"\n          {_SKIN}/>', *fins]


def _part(part: HullPartCfg) -> str:
    x, y, z = (float(coordinate) for coordinate in flip_vector(np.array(part.position_m)))
    length, width, height = part.size_m
    if part.shape == "box":
        size = f'pos="{x:.9g} {y:.9g} {z:.9g}" size="{0.5 * length:.9g} {0.5 * width:.9g} {0.5 * height:.9g}"'
    else:
        half = 0.5 * (length - (width if part.shape == "capsule" else 0.0))
        size = f'fromto="{x - half:.9g} {y:.9g} {z:.9g} {x + half:.9g} {y:.9g} {z:.9g}" size="{0.5 * width:.9g}"'
    return f'<geom name="{part.name}" type="{part.shape}" {size} {_SKIN}/>'


def _principal_inertia(vehicle: VehicleCfg) -> tuple[str, str]:
    """Quaternion and principal moments about the centre of gravity.

    The principal axes are permuted cyclically so that they never coincide with the body's: MuJoCo stores the mass
    matrix of a body whose inertial frame is its own as a diagonal, where added mass finds no room.
    """
    offset = vehicle.centre_of_gravity_body_m
    about_cg = np.diag(vehicle.inertia_kg_m2) - vehicle.mass_kg * (
        float(offset @ offset) * np.eye(3) - np.outer(offset, offset)
    )
    moments, axes = np.linalg.eigh(about_cg)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] = -axes[:, 0]
    moments, axes = np.roll(moments, 1), np.roll(axes, 1, axis=1)
    quat: Array = quat_wxyz_from_rotation(axes)
    return " ".join(f"{part:.17g}" for part in quat), " ".join(f"{part:.17g}" for part in moments)


def _camera(name: str, mount: MountCfg) -> str:
    """A MuJoCo camera looks along its −z with +y up."""
    forward = flip_vector(np.array(mount.direction))
    up = flip_vector(np.array(mount.up))
    right = np.cross(forward, up)
    pos = " ".join(f"{part:.9g}" for part in flip_vector(np.array(mount.position_m)))
    axes = " ".join(f"{part:.9g}" for part in (*right, *up))
    return f'<camera name="{name}" pos="{pos}" xyaxes="{axes}" fovy="{_CAMERA_FOVY_DEG}"/>'
