"""Flags that all docking commands share."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from auvdock.cli.console import tell
from auvdock.core.errors import ConfigError, GraphicsError
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.optics.gl import probe_gl
from auvdock.sim.mj import GL_REFUSAL

__all__ = ["DockFlags", "working_fidelity"]


@dataclass(frozen=True)
class DockFlags(ABC):
    """Flags of every docking command; each adds its station's own, and the field `episode` that they change."""

    seed: int = 0
    """Decides start, current, sensor noise and camera noise."""
    fidelity: Literal["pixels", "beacons", "auto"] | None = None
    """pixels renders every frame; beacons draws detections from the same light model without an image; auto is pixels
    where OpenGL works, else beacons."""
    detector: str | None = None
    """threshold, blob, cores, halos, paper_a_light, or your own as NAME.onnx or package.module:Name."""
    controller: str | None = None
    """A pilot of your own as package.module:Name, in place of the station's."""
    water: str | None = None
    """Water preset (I, IA, IB, II, III, 1C to 9C, petzold_clear, petzold_coastal, petzold_harbour, clear, pool, lake),
    or a TOML file written as assets/waters are."""
    attenuation: float | None = None
    """Beam attenuation at 450 nm in 1/m, in place of the preset's, by more or less scattering."""
    turbidity: float | None = None
    """Beam attenuation at 530 nm in 1/m of a water between those that Petzold measured (0.151 to 1.92), in place of
    --water."""
    current: float | None = None
    """Speed of the current in m/s."""
    current_direction: str | None = None
    """Where the current flows to, degrees counter-clockwise from the station's x axis seen from above, or "random"."""
    level: int = 1
    """Difficulty 0 to 4; the flags change single things of it."""
    config: Path | None = None
    """TOML file with further settings, on top of the level."""
    station: str | None = None
    """TOML file of a station in place of the level's, written as assets/stations are; `auvdock plan` writes such."""
    record: Path | None = None
    """Write a Rerun recording here."""
    json: bool = False
    """Print the result as one JSON object and nothing else."""
    from_: Annotated[str | None, tyro.conf.arg(name="from", metavar="DIR#EPISODE")] = None
    """Fly an episode of a campaign again, bit for bit; other flags then change single things of it."""

    @abstractmethod
    def resolve(self) -> AnyEpisodeCfg:
        """The configuration with all flags applied.

        Raises:
            ConfigError: a value that does not fit.
        """

    def changes(self) -> dict[str, Any]:
        """What the common flags change of the configuration.

        Raises:
            ConfigError: a value that does not fit.
        """
        changes: dict[str, Any] = {}
        world: dict[str, Any] = changes.setdefault("world", {})
        if self.fidelity is not None:
            world["fidelity"] = working_fidelity() if self.fidelity == "auto" else self.fidelity
        if self.water is not None:
            world["water"] = self.water
        if self.attenuation is not None:
            world["attenuation_per_m"] = self.attenuation
        if self.turbidity is not None:
            if self.water is not None:
                raise ConfigError("turbidity", self.turbidity, "either it or --water: it is a water of its own")
            world["turbidity_per_m"] = self.turbidity
        if self.current is not None:
            world.setdefault("sim", {}).setdefault("current", {})["speed_m_s"] = self.current
        if self.current_direction is not None:
            start = world.setdefault("start", {})
            start["random_current_direction"] = self.current_direction == "random"
            if self.current_direction != "random":
                degrees = _degrees(self.current_direction)
                world.setdefault("sim", {}).setdefault("current", {})["direction_deg"] = degrees
        if self.detector is not None:
            changes["perception"] = {"detector": self.detector}
        if self.controller is not None:
            changes["control"] = {"controller": self.controller}
        return changes


def working_fidelity() -> str:
    """`pixels` where OpenGL works, else `beacons`."""
    try:
        probe_gl()
    except GraphicsError as error:
        if GL_REFUSAL is None:  # of which every command tells
            tell(str(error))
        return "beacons"
    return "pixels"


def _degrees(text: str) -> float:
    with suppress(ValueError):
        if math.isfinite(degrees := float(text)):
            return degrees
    raise ConfigError("current-direction", text, "degrees or 'random'")
