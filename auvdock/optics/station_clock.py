"""The station's clock as seen from the vehicle's: the error that synchronising them leaves."""

from __future__ import annotations

import numpy as np

from auvdock.core.rotating_beacon import BeaconClockCfg

__all__ = ["StationClock"]


class StationClock:
    """Station time at a vehicle time: t_v = t_s + offset + drift t_s + jitter, solved for t_s.

    Offset and drift are drawn once, when the clock is made; the jitter at each reading.
    """

    def __init__(self, cfg: BeaconClockCfg, rng: np.random.Generator) -> None:
        """Draw the episode's offset and drift; the generator is kept for the jitter."""
        offset, drift = rng.standard_normal(2)
        self._cfg, self._rng = cfg, rng
        self.offset_s = cfg.offset_s + cfg.offset_std_s * float(offset)
        self.drift = 1e-6 * cfg.drift_ppm * float(drift)

    def station_time_s(self, vehicle_time_s: float) -> float:
        """What the station's clock shows when the vehicle's shows `vehicle_time_s`; draws this reading's jitter."""
        jitter_s = self._cfg.jitter_s * float(self._rng.standard_normal())
        return (vehicle_time_s - self.offset_s - jitter_s) / (1.0 + self.drift)
