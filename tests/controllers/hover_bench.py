"""A bench for hovering: either vehicle in the simulator far above its station, behind quiet or noisy sensors."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from auvdock.core.station import load_conical_station
from auvdock.core.transforms import quat_wxyz_from_euler_zyx
from auvdock.core.vehicle import load_vehicle
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.sensors import SensorCfg
from auvdock.sim.simulator import SimCfg, Simulator

VEHICLES = {name: load_vehicle(name) for name in ("bluerov2_heavy", "remus_hybrid")}
DT_S = 1.0 / 20.0
STEPS = 6
_NONE: dict[str, Any] = {field.name: 0.0 for field in dataclasses.fields(SensorCfg) if field.name != "dvl"}
QUIET = SensorCfg(**_NONE)


class Hoverer:
    """One vehicle in open water, 30 m from anything that it could touch."""

    def __init__(
        self,
        name,
        yaw_rad=0.0,
        current_m_s=0.0,
        direction_deg=0.0,
        sensors=QUIET,
        seed=0,
        position_m=(30.0, 0.0, -4.0),
        station=None,
    ):
        self.simulator = Simulator(SimCfg(vehicle=name, sensors=sensors), station or load_conical_station())
        self.simulator.reset(
            np.array(position_m),
            quat_wxyz_from_euler_zyx(0.0, 0.0, yaw_rad),
            np.random.default_rng(seed),
            CurrentCfg(speed_m_s=current_m_s, direction_deg=direction_deg),
        )

    def tilt(self, roll_rad, pitch_rad):
        """Start anew with the hull tilted."""
        self.simulator.reset(
            np.array([30.0, 0.0, -4.0]), quat_wxyz_from_euler_zyx(roll_rad, pitch_rad, 0.0), np.random.default_rng(0)
        )

    @property
    def T_world_body(self):
        return self.simulator.truth.T_world_body

    def step(self, values):
        for _ in range(STEPS):
            self.simulator.step(values)

    def senses(self):
        return self.simulator.proprioception()
