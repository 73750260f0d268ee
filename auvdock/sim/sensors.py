"""The vehicle's own sensors with noise and bias: pressure, compass, inclinometer, gyroscopes, DVL."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import Proprioception
from auvdock.core.limits import NotNegative
from auvdock.numeric.compiled import compiled
from auvdock.numeric.scalars import within_pi

__all__ = ["SensorCfg", "Sensors"]


@dataclass(frozen=True)
class SensorCfg(Checked):
    """Noise of each sample (white) and bias (drawn once an episode); both are standard deviations."""

    depth_noise_m: NotNegative = 0.01
    """Pressure gauge, 0.01 % of a 100 m range (Paroscientific Digiquartz data sheet: accuracy 0.01 % of full scale)."""
    depth_bias_m: NotNegative = 0.02
    """Atmospheric pressure and tide left over after zeroing at the surface: 2 hPa."""
    attitude_noise_rad: NotNegative = 0.0017
    """Roll and pitch, 0.1° (TCM-class compass modules: 0.2° accuracy)."""
    attitude_bias_rad: NotNegative = 0.0035
    """Roll and pitch alignment, 0.2° (same data sheets)."""
    heading_noise_rad: NotNegative = 0.0035
    """Compass, 0.2° (TCM-class compass modules: 0.1° resolution, 0.05° repeatability, steel and currents near by)."""
    heading_bias_rad: NotNegative = 0.0087
    """Compass, 0.5° (OS5000- and TCM-class data sheets: 0.3° to 0.5° rms accuracy)."""
    gyro_noise_rad_s: NotNegative = 0.0005
    """MEMS gyroscope, 0.007 °/s/√Hz over 15 Hz (ADIS1648x data sheets)."""
    gyro_bias_rad_s: NotNegative = 0.0002
    """In-run bias after zeroing, about 40 °/h (same class, over temperature)."""
    ground_velocity_noise_m_s: NotNegative = 0.003
    """DVL bottom lock (Teledyne RDI Workhorse Navigator 1200 kHz: 0.3 cm/s at 1 m/s, single ping)."""
    water_velocity_noise_m_s: NotNegative = 0.01
    """DVL water track: shorter cells and fewer scatterers, some three times the bottom lock's."""
    velocity_scale_error: NotNegative = 0.002
    """DVL scale error (same data sheet: ±0.2 %)."""
    contact_threshold_n: NotNegative = 5.0
    """Force that closes the touch switch: the bow's, in landing the underside's."""


_BLOCK = 64
"""Samples whose noise is drawn at once: one call of the generator costs as much as the numbers of one sample."""


class Sensors:
    """Draws what the sensors say from the true state."""

    def __init__(self, cfg: SensorCfg) -> None:
        """Prepare; call `reset` before use."""
        self._cfg = cfg
        c = cfg
        # One standard normal each: depth, roll, pitch, yaw, gyro, ground velocity, water velocity.
        self._std = np.array(
            [c.depth_noise_m, c.attitude_noise_rad, c.attitude_noise_rad, c.heading_noise_rad]
            + [c.gyro_noise_rad_s] * 3
            + [c.ground_velocity_noise_m_s] * 3
            + [c.water_velocity_noise_m_s] * 3
        )
        self._bias_std = np.array(
            [c.depth_bias_m, c.attitude_bias_rad, c.attitude_bias_rad, c.heading_bias_rad]
            + [c.gyro_bias_rad_s] * 3
            + [0.0] * 6
        )
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator, compass_datum_rad: float = 0.0) -> None:
        """Draw this episode's biases; `rng` then belongs to the sensors, and the datum is added to the compass."""
        self._rng = rng
        self._datum_rad = compass_datum_rad
        self._bias = self._bias_std * rng.standard_normal(13)
        self._noise, self._row = np.zeros((0, 13)), _BLOCK
        self._scale = 1.0 + self._cfg.velocity_scale_error * float(rng.standard_normal())

    def sample(
        self,
        time_s: float,
        depth_m: float,
        euler_zyx_rad: Array,
        nu_body: Array,
        nu_relative_body: Array,
        switch_force_n: float,
        latched: bool,
    ) -> Proprioception:
        """One sample of all sensors; depth in m, angles (3,) in rad, velocities (6,) in m/s and rad/s."""
        if self._row == _BLOCK:
            self._noise, self._row = self._rng.standard_normal((_BLOCK, 13)), 0
        noise = self._noise[self._row]
        self._row += 1
        readings = _readings(
            self._bias, self._std, noise, euler_zyx_rad, nu_body, nu_relative_body, self._scale, self._datum_rad
        )
        return Proprioception(
            time_s=time_s,
            depth_m=depth_m + float(readings[0]),
            euler_zyx_rad=readings[1:4],
            angular_velocity_rad_s=readings[4:7],
            velocity_ground_m_s=readings[7:10],
            velocity_water_m_s=readings[10:13],
            contact=switch_force_n > self._cfg.contact_threshold_n,
            latched=latched,
        )


@compiled
def _readings(
    bias: Array,
    std: Array,
    noise: Array,
    euler_zyx_rad: Array,
    nu_body: Array,
    nu_relative_body: Array,
    scale: float,
    datum_rad: float,
) -> Array:
    """(13,) error of the depth, and what the other sensors say: three each of angles, rates and both velocities."""
    out = np.empty(13)
    for i in range(13):
        out[i] = bias[i] + std[i] * noise[i]
    for i in range(3):
        out[1 + i] += euler_zyx_rad[i]
        out[4 + i] += nu_body[3 + i]
        out[7 + i] += scale * nu_body[i]
        out[10 + i] += scale * nu_relative_body[i]
    out[3] = within_pi(out[3] + datum_rad)
    return out
