"""What follows from the state of a free body in moving water."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.numeric.rotations import rotation_of_quat_wxyz
from auvdock.numeric.water import Water, water_velocity

__all__ = ["Kinematics", "kinematics"]


@dataclass
class Kinematics(Record):
    """Pose and velocities; ν as Fossen (2011) has it, linear then angular, body axes, in m/s and rad/s."""

    T_world_body: Annotated[Array, 4, 4]
    """Pose of the body."""
    euler_zyx_rad: Annotated[Array, 3]
    """Roll, pitch and yaw."""
    water_world_m_s: Annotated[Array, 3]
    """Velocity of the water at the body."""
    nu_body: Annotated[Array, 6]
    """ν over ground."""
    nu_relative_body: Annotated[Array, 6]
    """ν_r relative to the water."""


@compiled
def kinematics(qpos: Array, qvel: Array, water: Records[Water], out: Records[Kinematics]) -> None:
    """Work out pose and velocities.

    Args:
        qpos: (7,) position and quaternion wxyz of the body.
        qvel: (6,) velocity in the world frame, angular velocity in the body frame.
        water: (1,) the water now.
        out: (1,) takes the result.
    """
    body, flow = out[0], water_velocity(water[0], qpos[2])
    T, nu, nu_relative, angles = body.T_world_body, body.nu_body, body.nu_relative_body, body.euler_zyx_rad
    rows = rotation_of_quat_wxyz(qpos[3:])
    for i in range(3):
        T[i, 0], T[i, 1], T[i, 2] = rows[i]
        T[i, -1] = qpos[i]
    T[-1, :] = 0.0
    T[-1, -1] = 1.0
    angles[0], angles[2] = math.atan2(T[2, 1], T[2, 2]), math.atan2(T[1, 0], T[0, 0])
    angles[1] = -math.asin(max(-1.0, min(1.0, T[2, 0])))
    for i in range(3):
        body.water_world_m_s[i] = flow[i]
        nu[i] = nu_relative[i] = 0.0
        for j in range(3):
            nu[i] += qvel[j] * T[j, i]
            nu_relative[i] += (qvel[j] - flow[j]) * T[j, i]
        nu[3 + i] = nu_relative[3 + i] = qvel[3 + i]
