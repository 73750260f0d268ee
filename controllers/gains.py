"""Controller gains derived from the linearised vehicle with python-control, and the margins they achieve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

from auvdock.controllers.linear_model import AxisPlant, axis_plants
from auvdock.controllers.pid import PidGains
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import below, between
from auvdock.core.vehicle import VehicleCfg

__all__ = [
    "AutopilotGains",
    "Crossover",
    "DesignCfg",
    "LoopDesign",
    "PhaseMargin",
    "cascade_design",
    "design_gains",
    "loop_margins",
    "plant_transfer",
    "rolls",
]

Crossover = Annotated[float, between(0.01, 10.0)]
"""Gain crossover of a loop, rad/s."""
PhaseMargin = Annotated[float, below(90.0)]
"""Phase margin of a loop, degrees."""


@dataclass(frozen=True)
class DesignCfg(Checked):
    """What the loops shall achieve; gains follow from it and from the vehicle."""

    surge_m_s: float = 0.5
    """Speed through the water at which the vehicle is linearised: paper A's approach speed."""
    surge_crossover_rad_s: Crossover = 1.0
    """Gain crossover of the surge speed loop."""
    sway_crossover_rad_s: Crossover = 1.2
    """Gain crossover of the sway velocity loop."""
    heave_crossover_rad_s: Crossover = 1.2
    """Gain crossover of the heave velocity loop."""
    pitch_crossover_rad_s: Crossover = 2.0
    """Gain crossover of the pitch loop."""
    heading_crossover_rad_s: Crossover = 1.8
    """Gain crossover of the heading loop."""
    roll_crossover_rad_s: Crossover = 2.0
    """Gain crossover of the roll loop, where thrusters act on roll."""
    depth_crossover_rad_s: Crossover = 0.35
    """Gain crossover of the depth loop, which gives the heave loop its set-point."""
    velocity_margin_deg: PhaseMargin = 65.0
    """Phase margin for which the velocity loops are designed."""
    attitude_margin_deg: PhaseMargin = 57.0
    """Phase margin for which the attitude loops are designed: at rest, where a hull damps little, 10° less are left."""
    integral_ratio: float = 0.1
    """Integral over proportional action of the attitude loops at crossover: k_i = ratio × ω_c × k_p."""
    min_gain_margin_db: float = 6.0
    """Gain margin below which a design is refused."""
    min_phase_margin_deg: float = 45.0
    """Phase margin below which a design is refused."""

    def __post_init__(self) -> None:
        """Refuse to design for a margin below the least."""
        for name in ("velocity_margin_deg", "attitude_margin_deg"):
            if getattr(self, name) < self.min_phase_margin_deg:
                raise ConfigError(name, getattr(self, name), "a phase margin of min_phase_margin_deg up to 90")


@dataclass(frozen=True)
class LoopDesign:
    """One loop: its plant, its gains and what they achieve at the design point."""

    gains: PidGains
    crossover_rad_s: float
    gain_margin_db: float
    phase_margin_deg: float


@dataclass(frozen=True)
class AutopilotGains:
    """All loops of the autopilot; `depth` is the outer loop around `heave`, `roll` is None where nothing acts on it."""

    surge: LoopDesign
    sway: LoopDesign
    heave: LoopDesign
    pitch: LoopDesign
    heading: LoopDesign
    depth: LoopDesign
    roll: LoopDesign | None = None

    @property
    def loops(self) -> dict[str, LoopDesign]:
        """By name; with roll where there is one."""
        loops = {name: getattr(self, name) for name in ("surge", "sway", "heave", "pitch", "heading", "depth")}
        return loops if self.roll is None else {**loops, "roll": self.roll}


def _library() -> Any:  # noqa: ANN401
    """python-control, imported late: it takes seconds, which only those shall pay who design gains."""
    import control

    return control


def plant_transfer(plant: AxisPlant, delay_s: float) -> Any:  # noqa: ANN401 - python-control ships no types
    """Transfer function from wrench command to velocity (surge, sway, heave) or angle (roll, pitch, heading).

    1/(m s + d) or 1/(I s² + d s + k), times 1/(τ s + 1), times a second-order Padé approximant of e^{−s T}.
    """
    control = _library()

    velocity = plant.axis in ("surge", "sway", "heave")
    denominator = [plant.inertia, plant.damping] if velocity else [plant.inertia, plant.damping, plant.stiffness]
    delay = control.tf(*control.pade(delay_s, 2))
    return control.tf([1.0], denominator) * control.tf([1.0], [plant.lag_s, 1.0]) * delay


def loop_margins(loop: Any) -> tuple[float, float, float]:  # noqa: ANN401
    """Smallest gain margin in dB, smallest phase margin in degrees and its crossover in rad/s of an open loop.

    A gain margin counts in both directions: a conditionally stable loop may also be spoilt by too little gain.
    """
    control = _library()

    gain, phase, _, _, crossover, _ = control.stability_margins(loop, returnall=True)
    gains_db = [abs(20.0 * math.log10(float(value))) for value in gain if float(value) > 0.0]
    pairs = [(abs(float(value)), float(omega)) for value, omega in zip(phase, crossover, strict=True)]
    margin_deg, omega = min(pairs) if pairs else (math.inf, math.nan)
    return (min(gains_db) if gains_db else math.inf), margin_deg, omega


def _controller(gains: PidGains) -> Any:  # noqa: ANN401
    control = _library()

    return control.tf([gains.kd, gains.kp, gains.ki], [1.0, 0.0])


def _checked(axis: str, gains: PidGains, transfer: Any, cfg: DesignCfg) -> LoopDesign:  # noqa: ANN401
    gain_db, phase_deg, crossover = loop_margins(_controller(gains) * transfer)
    if gain_db < cfg.min_gain_margin_db or phase_deg < cfg.min_phase_margin_deg:
        raise ConfigError(
            f"{axis}_crossover_rad_s",
            getattr(cfg, f"{axis}_crossover_rad_s"),
            f"a slower loop: margins are {gain_db:.1f} dB and {phase_deg:.0f} deg",
        )
    return LoopDesign(gains, crossover, gain_db, phase_deg)


def _controller_at_crossover(transfer: Any, crossover: float, margin_deg: float) -> tuple[float, float]:  # noqa: ANN401
    """|C| and arg C at crossover that give |C P| = 1 and the phase margin (Åström and Murray 2021, section 11.3)."""
    response = complex(transfer(1j * crossover))
    phase = math.radians(margin_deg - 180.0) - math.atan2(response.imag, response.real)
    return 1.0 / abs(response), math.remainder(phase, 2.0 * math.pi)


def _velocity_loop(plant: AxisPlant, delay_s: float, crossover: float, cfg: DesignCfg) -> LoopDesign:
    """PI: C(jω) = k_p − j k_i/ω, hence k_p = |C| cos φ and k_i = −ω |C| sin φ with −90° < φ < 0."""
    transfer = plant_transfer(plant, delay_s)
    size, phase = _controller_at_crossover(transfer, crossover, cfg.velocity_margin_deg)
    if phase >= 0.0:
        raise ConfigError(f"{plant.axis}_crossover_rad_s", crossover, "a slower loop: lag and delay eat the margin")
    # Strong damping would let the integral do most of the work; a cap keeps the loop from creeping.
    phase = max(phase, math.radians(-30.0))
    gains = PidGains(kp=size * math.cos(phase), ki=-crossover * size * math.sin(phase), kd=0.0)
    return _checked(plant.axis, gains, transfer, cfg)


def _attitude_loop(plant: AxisPlant, delay_s: float, crossover: float, cfg: DesignCfg) -> LoopDesign:
    """PID: C(jω) = k_p + j (k_d ω − k_i/ω) with k_i = ratio ω k_p, hence k_p = |C| cos φ and k_d from the rest.

    A hull that damps itself so well that φ would be less than the integral's own lag gets no derivative action, and
    more margin than was asked for.
    """
    transfer = plant_transfer(plant, delay_s)
    size, phase = _controller_at_crossover(transfer, crossover, cfg.attitude_margin_deg)
    phase = max(phase, -math.atan(cfg.integral_ratio))
    if phase > math.radians(85.0):
        raise ConfigError(f"{plant.axis}_crossover_rad_s", crossover, "a crossover that derivative action can support")
    kp = size * math.cos(phase)
    ki = cfg.integral_ratio * crossover * kp
    kd = max(0.0, (size * math.sin(phase) + ki / crossover) / crossover)
    return _checked(plant.axis, PidGains(kp=kp, ki=ki, kd=kd), transfer, cfg)


def cascade_design(inner: LoopDesign, plant: AxisPlant, delay_s: float, cfg: DesignCfg) -> LoopDesign:
    """Depth loop: P action around the closed heave loop, L = k T_heave(s)/s with |L(jω_c)| = 1."""
    control = _library()

    closed = control.feedback(_controller(inner.gains) * plant_transfer(plant, delay_s), 1)
    transfer = closed * control.tf([1.0], [1.0, 0.0])
    crossover = cfg.depth_crossover_rad_s
    gain = 1.0 / abs(complex(transfer(1j * crossover)))
    gain_db, phase_deg, achieved = loop_margins(gain * transfer)
    if gain_db < cfg.min_gain_margin_db or phase_deg < cfg.min_phase_margin_deg:
        raise ConfigError("depth_crossover_rad_s", crossover, "a loop slower than the heave loop")
    return LoopDesign(PidGains(kp=gain, ki=0.0, kd=0.0), achieved, gain_db, phase_deg)


@lru_cache(maxsize=32)
def design_gains(vehicle: VehicleCfg, cfg: DesignCfg, dt_s: float) -> AutopilotGains:
    """Gains for a vehicle and a control period; pure, and remembered for repeated episodes.

    The delay in the loop is 1.5 periods: one until the sample becomes a command, half of one for the hold.

    Raises:
        ConfigError: a loop cannot reach its margins at the wanted crossover.
    """
    plants = axis_plants(vehicle, cfg.surge_m_s)
    delay_s = 1.5 * dt_s
    heave = _velocity_loop(plants["heave"], delay_s, cfg.heave_crossover_rad_s, cfg)
    return AutopilotGains(
        surge=_velocity_loop(plants["surge"], delay_s, cfg.surge_crossover_rad_s, cfg),
        sway=_velocity_loop(plants["sway"], delay_s, cfg.sway_crossover_rad_s, cfg),
        heave=heave,
        pitch=_attitude_loop(plants["pitch"], delay_s, cfg.pitch_crossover_rad_s, cfg),
        heading=_attitude_loop(plants["heading"], delay_s, cfg.heading_crossover_rad_s, cfg),
        depth=cascade_design(heave, plants["heave"], delay_s, cfg),
        roll=_attitude_loop(plants["roll"], delay_s, cfg.roll_crossover_rad_s, cfg) if rolls(vehicle) else None,
    )


def rolls(vehicle: VehicleCfg) -> bool:
    """Whether thrusters act on roll (a fin does not count: it is idle in a hover)."""
    return any(
        actuator.kind == "thruster" and abs(wrench) > 1e-9
        for actuator, wrench in zip(vehicle.actuators, vehicle.thruster_wrenches_body[3], strict=True)
    )
