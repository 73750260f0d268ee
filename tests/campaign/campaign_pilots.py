"""A user's own pilots, for tests."""

import numpy as np

from auvdock.core.contracts import Command


class Ahead:
    """Goes straight ahead; its state is the number of steps."""

    def __init__(self, control, vehicle, station, camera, dt_s):
        self._values = np.zeros(len(vehicle.actuators))
        self._values[0] = 0.3

    def initial_state(self):
        return 0

    def step(self, state, percept, proprioception):
        return Command(self._values, mode="straight"), state + 1


class Nobody:
    """No pilot at all."""

    def __init__(self, *anything):
        pass
