"""`auvdock fit-landing`: fit the `beacons` fidelity of a landing to detectors of lights and tags on rendered frames."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from auvdock.cli.console import messages, track
from auvdock.cli.fit import CONDITIONS, write_model
from auvdock.cli.parsing import at_least, parse
from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.landing_world import LandingWorld
from auvdock.optics.detection_fit import Observation, fit_detection_model
from auvdock.optics.faults import FaultCfg
from auvdock.optics.lamp import LampCfg
from auvdock.optics.tag_fit import TagObservation, fit_tag_model, observe_landing
from auvdock.perception.detectors import make_detector
from auvdock.perception.landing.tag_detectors import make_tag_detector

__all__ = ["FitLanding", "run", "sample_landing_poses"]


@dataclass(frozen=True)
class FitLanding:
    """Fit the beacons fidelity of a landing: renders frames from above the platform and writes two small TOML files.

    Every water is seen with the vehicle's lamps off, on, and on over a dark station.
    """

    detector: Annotated[str, tyro.conf.Positional]
    """Of lights: cores, threshold, blob, or your own as package.module:Name."""
    tag_detector: Annotated[str, tyro.conf.Positional]
    """Of tags: apriltag or contour."""
    out_lights: Path
    """Where to write the model of the detector of lights."""
    out_tags: Path
    """Where to write the model of the detector of tags."""
    frames: int = 80
    """Frames for each water and lamp."""
    seed: int = 0
    """Decides poses and camera noise."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(FitLanding, argv, prog)
    at_least(1, frames=args.frames)
    at_least(0, seed=args.seed)
    detector = make_detector(args.detector)
    tag_detector = make_tag_detector(args.tag_detector, (LandingWorldCfg().station.tag.tag_id,))
    rng = np.random.default_rng(args.seed)
    lights: list[Observation] = []
    tags: list[TagObservation] = []
    every = tuple(beacon.name for beacon in LandingWorldCfg().station.beacons)
    for water, attenuation in CONDITIONS:
        for lamp, dark in ((None, ()), (LampCfg(), ()), (LampCfg(), every)):
            cfg = LandingWorldCfg(
                water=water, attenuation_per_m=attenuation, lamp=lamp, faults=FaultCfg(dead_lights=dark)
            )
            world = LandingWorld(cfg)
            poses = sample_landing_poses(args.frames, world.camera, cfg.station.depth_m, rng)
            name = f"{water} c={attenuation or 'preset'}, lamp {'on' if lamp else 'off'}{', dark' if dark else ''}"
            shown = track(poses, name)
            seen, read = observe_landing(world.imager, cfg.station, detector, tag_detector, shown, rng)
            # A dark station's lights cannot be found, and what is found there is no light.
            lights += () if dark else seen
            tags += read
            world.close()
    names = ", ".join(f"{water} c={c:g}" if c else water for water, c in CONDITIONS)
    source = (
        f"auvdock fit-landing {args.detector} {args.tag_detector} --frames {args.frames} --seed {args.seed}; {names}"
    )
    write_model(fit_detection_model(args.detector, source, lights), args.out_lights, "out_lights")
    write_model(fit_tag_model(args.tag_detector, source, tags), args.out_tags, "out_tags")
    messages().print(f"{len(lights)} frames with lights, {len(tags)} with the tag", highlight=False)
    return 0


def sample_landing_poses(count: int, camera: Camera, station_depth_m: float, rng: np.random.Generator) -> list[Array]:
    """Body poses (4, 4) with the camera 0.3 m to 7 m above the platform, denser near by, the station mostly in view."""
    poses: list[Array] = []
    for height_m in np.exp(rng.uniform(math.log(0.3), math.log(7.0), count)):
        x, y = rng.uniform(-1.0, 1.0, 2) * height_m * (0.25, 0.35)
        roll, pitch = np.radians(rng.normal(0.0, 3.0, 2))
        rotation = rotation_from_euler_zyx(roll, pitch, math.radians(rng.uniform(-45.0, 45.0)))
        place = np.array([x, y, height_m - station_depth_m])
        poses.append(make_transform(rotation, place - rotation @ camera.T_body_camera[:3, 3]))
    return poses
