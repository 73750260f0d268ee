"""The vehicle's own sensors with noise and bias: pressure, compass, inclinometer, gyroscopes, DVL."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import Proprioception
from auvdock.core.limits import NotNegative
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.numeric.scalars import within_pi
from auvdock.sim.dvl import Dvl, DvlCfg

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
    dvl: DvlCfg = DvlCfg()
    """When the DVL measures."""
    contact_threshold_n: NotNegative = 5.0
    """Force that closes the touch switch: the bow's, in landing the underside's."""


_BLOCK = 64
"""Samples whose noise is drawn at once: one call of the generator costs as much as the numbers of one sample."""


@dataclass
class Readings(Record):
    """A number for each channel: a reading, its deviation, its bias or a normal number."""

    depth_m: float
    euler_zyx_rad: Annotated[Array, 3]
    angular_velocity_rad_s: Annotated[Array, 3]
    velocity_ground_m_s: Annotated[Array, 3]
    velocity_water_m_s: Annotated[Array, 3]


_CHANNELS = Readings.dtype().itemsize // 8
"""Numbers in it."""


class Sensors:
    """Draws what the sensors say from the true state."""

    def __init__(self, cfg: SensorCfg) -> None:
        """Prepare; call `reset` before use."""
        self._cfg = cfg
        self._dvl = Dvl(cfg.dvl)
        self._std = Readings(
            cfg.depth_noise_m,
            np.array([cfg.attitude_noise_rad, cfg.attitude_noise_rad, cfg.heading_noise_rad]),
            np.full(3, cfg.gyro_noise_rad_s),
            np.full(3, cfg.ground_velocity_noise_m_s),
            np.full(3, cfg.water_velocity_noise_m_s),
        ).packed()
        self._bias_std = Readings(
            cfg.depth_bias_m,
            np.array([cfg.attitude_bias_rad, cfg.attitude_bias_rad, cfg.heading_bias_rad]),
            np.full(3, cfg.gyro_bias_rad_s),
            np.zeros(3),
            np.zeros(3),
        ).packed()
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator, compass_datum_rad: float = 0.0) -> None:
        """Draw this episode's biases; `rng` then belongs to the sensors, and the datum is added to the compass."""
        self._rng = rng
        self._dvl.reset(rng.spawn(1)[0])  # its lost pings leave the other draws as they were
        self._datum_rad = compass_datum_rad
        drawn, self._bias = _normal(rng, 1), Readings.zeros()
        for name in Readings.dtype().names or ():
            self._bias[name] = self._bias_std[name] * drawn[name]
        self._noise, self._row = _normal(rng, 0), _BLOCK
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
        height_m: float = math.inf,
    ) -> Proprioception:
        """One sample of all sensors; depth in m, angles (3,) in rad, velocities (6,) in m/s and rad/s.

        `height_m` is that of the DVL above what lies below it.
        """
        if self._row == _BLOCK:
            self._noise, self._row = _normal(self._rng, _BLOCK), 0
        noise, said = self._noise[self._row : self._row + 1], Readings.zeros()
        self._row += 1
        _read(
            said, self._bias, self._std, noise, euler_zyx_rad, nu_body, nu_relative_body, self._scale, self._datum_rad
        )
        euler_rad: Array = said["euler_zyx_rad"][0]
        log = self._dvl.sample(
            time_s, height_m, euler_rad, said["velocity_ground_m_s"][0], said["velocity_water_m_s"][0]
        )
        return Proprioception(
            time_s=time_s,
            depth_m=depth_m + float(said["depth_m"][0]),
            euler_zyx_rad=euler_rad,
            angular_velocity_rad_s=said["angular_velocity_rad_s"][0],
            velocity_ground_m_s=log.ground_m_s,
            velocity_water_m_s=log.water_m_s,
            contact=switch_force_n > self._cfg.contact_threshold_n,
            latched=latched,
            ground_age_s=log.ground_age_s,
            water_age_s=log.water_age_s,
        )


def _normal(rng: np.random.Generator, count: int) -> Records[Readings]:
    """(count,) normal numbers for each channel."""
    rows = rng.standard_normal((count, _CHANNELS)).view(Readings.dtype())[:, 0]
    return cast("Records[Readings]", rows)


@compiled
def _read(
    said: Records[Readings],
    bias: Records[Readings],
    std: Records[Readings],
    noise: Records[Readings],
    euler_zyx_rad: Array,
    nu_body: Array,
    nu_relative_body: Array,
    scale: float,
    datum_rad: float,
) -> None:
    """Write into `said` (1,) the error of the depth, and what the other sensors say."""
    out, off, sigma, normal = said[0], bias[0], std[0], noise[0]
    out.depth_m = off.depth_m + sigma.depth_m * normal.depth_m
    for i in range(3):
        angle = off.euler_zyx_rad[i] + sigma.euler_zyx_rad[i] * normal.euler_zyx_rad[i]
        out.euler_zyx_rad[i] = angle + euler_zyx_rad[i]
        rate = off.angular_velocity_rad_s[i] + sigma.angular_velocity_rad_s[i] * normal.angular_velocity_rad_s[i]
        out.angular_velocity_rad_s[i] = rate + nu_body[3 + i]
        ground = off.velocity_ground_m_s[i] + sigma.velocity_ground_m_s[i] * normal.velocity_ground_m_s[i]
        out.velocity_ground_m_s[i] = ground + scale * nu_body[i]
        water = off.velocity_water_m_s[i] + sigma.velocity_water_m_s[i] * normal.velocity_water_m_s[i]
        out.velocity_water_m_s[i] = water + scale * nu_relative_body[i]
    out.euler_zyx_rad[2] = within_pi(out.euler_zyx_rad[2] + datum_rad)
