"""Narrow beams: what is flown, and the halo's table read by reciprocity, against photons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.experiments.halo_check import HALF_ANGLES_DEG, READ, WELLS_RAD, mean_and_error
from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.halo import HaloTable, halo_of
from auvdock.optics.light import beam_profile
from auvdock.optics.photons.beam import arriving, beam_share, halo_beam
from auvdock.optics.photons.beam_walk import ARRIVAL_DEG, LEFT_DEG, BeamTally
from auvdock.optics.photons.table import load_halo
from auvdock.optics.water import WELLS, WaterCfg

__all__ = ["BeamCheck", "check_beam", "flown_beam"]

_FRONT = ARRIVAL_DEG.index(90.0)


@dataclass(frozen=True, eq=False)
class BeamCheck:
    """One beam in one phase function; light over I0 e^{-a r} / r², scattered light alone.

    Arrays are (b r, a / b, angle off the axis); all light that arrives is radiance integrated over all directions.
    """

    phase: str
    """Name of the phase function."""
    photons: int
    """Photons sent out."""
    beam_deg: float
    """Full angle of the beam."""
    off_axis_deg: tuple[float, ...]
    """(j,) angles of the line of sight with the beam's axis."""
    fresh: Array
    """What the photons say of all light that arrives."""
    error: Array
    """Standard error of that, relative to it."""
    front: Array
    """What they say of the half sphere before the receiver, 90° about the lamp."""
    front_error: Array
    """Standard error of that, relative to it."""
    within: Array
    """(n, k, j, 8) what they say of the light within `HALF_ANGLES_DEG` about the lamp."""
    within_error: Array
    """Standard error of that, relative to it."""
    table: Array
    """All light that arrives, by reciprocity from the table of the halo."""
    flown: Array
    """All light that arrives as it is flown (`optics.beam_spread`)."""
    wells: Array
    """(θ0, b r, off axis) the same by the model of Wells (1973), which knows no a / b."""
    lamp: Array
    """(n, k, j, 8) as `within`: f(θ) times the isotropic lamp's halo by the table, as fixed lamps have it."""

    @property
    def judged(self) -> BoolArray:
        """Where three standard errors of the photons are 10 % or less."""
        return self.error <= 0.1 / 3.0

    @property
    def within_judged(self) -> BoolArray:
        """The same for the light within half angles."""
        return self.within_error <= 0.1 / 3.0

    @property
    def front_judged(self) -> BoolArray:
        """The same for the half sphere before the receiver."""
        return self.front_error <= 0.1 / 3.0


def check_beam(name: str, batches: Sequence[BeamTally], beam_deg: float, off_axis_deg: tuple[float, ...]) -> BeamCheck:
    """Hold table and flown model to photons at the same places.

    Args:
        name: of the phase function.
        batches: of `send_photons` or `send_batches`.
        beam_deg: full angle of the beam, 4° or more: photons know ψ to half a degree.
        off_axis_deg: (j,) angles of the line of sight with its axis.
    """
    angle = np.radians(off_axis_deg)
    share = beam_share(np.radians(LEFT_DEG), beam_deg, angle)
    light = [arriving(tally, share) for tally in batches]
    fresh, error = mean_and_error([one[..., -1] for one in light])
    front, front_error = mean_and_error([one[..., _FRONT] for one in light])
    within, within_error = mean_and_error([one[..., READ] for one in light])
    halo, radius, absorption = load_halo(name), batches[0].radius, batches[0].absorption
    table = [[halo_beam(halo, float(br), float(x), beam_deg, angle) for x in absorption] for br in radius]
    alike = np.array(
        [[halo.within(float(br), float(x), np.radians(HALF_ANGLES_DEG)) for x in absorption] for br in radius]
    )
    waters = [halo_of(_water(name, float(x))) for x in absorption]
    flown = [[flown_beam(water, float(br), beam_deg, angle) for water in waters] for br in radius]
    models = [halo_of(_water(WELLS, 0.0, theta0)) for theta0 in WELLS_RAD]
    wells = [[flown_beam(model, float(br), beam_deg, angle) for br in radius] for model in models]
    return BeamCheck(
        name,
        sum(tally.photons for tally in batches),
        beam_deg,
        off_axis_deg,
        fresh,
        error,
        front,
        front_error,
        within,
        within_error,
        np.array(table),
        np.array(flown),
        np.array(wells),
        alike[:, :, None, :] * beam_profile(angle, beam_deg)[:, None],
    )


def flown_beam(halo: HaloTable, br: float, beam_deg: float, off_axis_rad: Array) -> Array:
    """(j,) scattered light of a beam as it is flown, over I0 e^{-a r} / r², at angles (j,) off its axis.

    Args:
        halo: of a water at 450 nm.
        br: b r there.
        beam_deg: full angle of the beam.
        off_axis_rad: (j,) angles of the line of sight with its axis.
    """
    spread = beam_spread(halo, 0, math.radians(beam_deg) / 2.0)
    depth = np.full(len(off_axis_rad), br)
    return halo.scattered(depth, 0) * spread.share(depth, off_axis_rad)


def _water(phase: str, absorption: float, theta0_rad: float = 0.05) -> WaterCfg:
    """A water with b = 1 1/m, a phase function, a / b, and θ0 for Wells' model."""
    a, b = (absorption, absorption, absorption), (1.0, 1.0, 1.0)
    return WaterCfg("check", "made up", a, b, phase_function=phase, scattering_angle_rad=theta0_rad)
