"""`auvdock fit-detector NAME`: fit the `beacons` fidelity to a detector's behaviour on rendered frames."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from auvdock.cli.console import messages, track
from auvdock.cli.parsing import at_least, parse
from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.envs.config import WorldCfg
from auvdock.envs.world import DockingWorld
from auvdock.optics.detection_fit import Observation, fit_detection_model, observe
from auvdock.optics.detection_model import DetectionModelCfg
from auvdock.optics.tag_model import TagModelCfg
from auvdock.perception.detectors import make_detector

__all__ = ["FitDetector", "run", "sample_poses", "write_model"]

CONDITIONS = (("clear", None), ("pool", None), ("lake", None), ("pool", 0.8))
"""Waters and attenuations that the fit covers."""


@dataclass(frozen=True)
class FitDetector:
    """Fit the beacons fidelity to a detector: renders frames at random poses and writes a small TOML file.

    Use the file with `--world.detection-model FILE`.
    """

    detector: Annotated[str, tyro.conf.Positional]
    """threshold, blob, paper_a_light, or your own as NAME.onnx or package.module:Name."""
    out: Path
    """Where to write the model."""
    frames: int = 200
    """Frames for each water."""
    seed: int = 0
    """Decides poses and camera noise."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(FitDetector, argv, prog)
    at_least(1, frames=args.frames)
    at_least(0, seed=args.seed)
    detector = make_detector(args.detector)
    rng = np.random.default_rng(args.seed)
    observations: list[Observation] = []
    for water, attenuation in CONDITIONS:
        world = DockingWorld(WorldCfg(water=water, attenuation_per_m=attenuation))
        poses = sample_poses(args.frames, world.cfg.station.depth_m, rng)
        shown = track(poses, f"{water} c={attenuation or 'preset'}")
        observations += observe(world.imager, detector, shown, rng)
        world.close()
    names = ", ".join(f"{water} c={c:g}" if c else water for water, c in CONDITIONS)
    source = f"auvdock fit-detector {args.detector} --frames {args.frames} --seed {args.seed}; waters {names}"
    model = fit_detection_model(args.detector, source, observations)
    write_model(model, args.out, "out")
    messages().print(f"{len(observations)} frames; wrote {args.out}", highlight=False, soft_wrap=True)
    return 0


def sample_poses(count: int, station_depth_m: float, rng: np.random.Generator) -> list[Array]:
    """Body poses (4, 4) in front of the station from 1 to 30 m, denser near by, heading roughly for it."""
    poses: list[Array] = []
    for range_m in np.exp(rng.uniform(0.0, math.log(30.0), count)):
        spread = min(3.0, 0.25 * range_m)
        y, z = rng.uniform(-spread, spread, 2) * (1.0, 0.5)
        towards = math.atan2(-y, -range_m)
        yaw = towards + math.radians(rng.normal(0.0, 10.0))
        roll, pitch = np.radians(rng.normal(0.0, 3.0, 2))
        position = np.array([range_m + 0.7, y, z - station_depth_m])
        poses.append(make_transform(rotation_from_euler_zyx(roll, pitch, yaw), position))
    return poses


def write_model(model: DetectionModelCfg | TagModelCfg, path: Path, field: str) -> None:
    """Write a fitted model as TOML.

    Args:
        model: the model.
        path: where to.
        field: the option that gave the path, for the error.

    Raises:
        ConfigError: a file that cannot be written.
    """
    try:
        path.write_text(_toml(model), encoding="utf-8")
    except OSError as error:
        raise ConfigError(field, str(path), f"a file that can be written ({error.strerror})") from error


def _toml(model: DetectionModelCfg | TagModelCfg) -> str:
    lines: list[str] = []
    for name, value in dataclasses.asdict(model).items():
        if value is None:
            continue
        lines.append(f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {float(value):.6g}")
    return "\n".join(lines) + "\n"
