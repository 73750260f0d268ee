"""The planned region beside the region in which the pixel pipeline really finds the beacons.

At each place of a grid in front of the station the camera looks at the array, a few frames are rendered with station
and floor in them, the threshold detector and the authentication run on them, and the place counts as seen if at least
four array beacons are authenticated in half or more of the frames after the first few.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import euler_zyx_from_rotation, invert, make_transform, rotation_looking_along
from auvdock.envs.config import WorldCfg
from auvdock.envs.world import DockingWorld
from auvdock.perception.detectors import make_detector
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg
from auvdock.planning.pictures import Panel, draw_sections, section_grid
from auvdock.planning.region import PlanCfg, guidance_space, make_detectability

__all__ = ["Agreement", "PixelEye", "check_grid", "check_region", "draw_agreement"]

FRAMES = 6
SETTLING_FRAMES = 3
"""Authentication asks for three detections of a light."""
_UP = np.array([0.0, 0.0, 1.0])
_BATCH = 24


@dataclass(frozen=True, eq=False)
class Agreement:
    """Plan against pixels on a grid of places of equal volume.

    Attributes:
        water: the water.
        places_m: (n, 3) camera places in the station frame.
        planned: (n,) whether the plan says that enough lights are found.
        seen: (n,) whether the pixel pipeline found them.
        cell_m3: volume that belongs to a place.
    """

    water: str
    places_m: Array
    planned: BoolArray
    seen: BoolArray
    cell_m3: float

    @property
    def intersection_over_union(self) -> float:
        """Of the two regions on the grid; 1 if both are empty."""
        union = int(np.count_nonzero(self.planned | self.seen))
        return float(np.count_nonzero(self.planned & self.seen)) / union if union else 1.0


class PixelEye:
    """The whole chain from rendering to authentication, held still at a place."""

    def __init__(self, cfg: WorldCfg) -> None:
        """Build world, detector and perception."""
        self._world = DockingWorld(cfg)
        self._detector = make_detector("threshold")
        self._perception = BeaconPerception(PerceptionCfg(), self._world.camera, cfg.station.layout)
        self._target = cfg.station.layout.array_positions_m.mean(axis=0)

    def count(self, place_m: Array) -> float:
        """Median number of authenticated array beacons over the frames after the first few."""
        world = self._world
        rotation = rotation_looking_along(self._target - place_m, _UP)
        T_world_camera = world.simulator.T_world_station @ make_transform(rotation, place_m)
        T_world_body = T_world_camera @ invert(world.camera.T_body_camera)
        world.imager.reset(np.random.default_rng(0))
        self._perception.reset()
        still, euler = np.zeros(3), np.array(euler_zyx_from_rotation(T_world_body[:3, :3]))
        counts: list[int] = []
        for frame_number in range(FRAMES):
            time_s = frame_number / world.camera.rate_hz
            frame = world.imager.capture(T_world_body, time_s)
            own = Proprioception(time_s, -float(T_world_body[2, 3]), euler, still, still, still)
            counts.append(self._perception.update(self._detector.detect(frame), own).array_count)
        return float(np.median(counts[SETTLING_FRAMES:]))

    def close(self) -> None:
        """Release the renderer."""
        self._world.close()


def check_grid(water: str, step_m: float, plan: PlanCfg | None = None) -> tuple[Array, BoolArray]:
    """Places (n, 3) of a grid over the region's bounding box and one step beyond, in the water, and the plan there.

    The station is its own mirror image in y, so the half y > 0 is enough.
    """
    cfg = plan or PlanCfg(water=water)
    station = WorldCfg().station
    sees = make_detectability(station.layout, cfg)
    space = guidance_space(station.layout, cfg, sees)
    if space.region is None:
        return np.zeros((0, 3)), np.zeros(0, dtype=np.bool_)
    inside = space.region.centres_m()
    low, high = inside.min(axis=0), inside.max(axis=0) + step_m
    low[1] = 0.0
    low[2] = max(low[2] - step_m, 0.5 - station.floor_below_m)
    high[2] = min(high[2], station.depth_m - 0.5)
    axes = [np.arange(lowest + 0.5 * step_m, highest, step_m) for lowest, highest in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return places, sees.seen(places, cfg.min_lights)


def check_region(
    water: str,
    step_m: float,
    tick: Callable[[int], object] | None = None,
    workers: int | None = None,
    grid: tuple[Array, BoolArray] | None = None,
) -> Agreement:
    """Plan and pixels on a grid in one water.

    Args:
        water: preset.
        step_m: grid step.
        tick: called with the number of places done since the last call.
        workers: processes; by default one per core.
        grid: what `check_grid` gave, if it is at hand.
    """
    places, planned = grid or check_grid(water, step_m)
    seen = np.zeros(len(places), dtype=np.bool_)
    batches = [np.arange(start, min(start + _BATCH, len(places))) for start in range(0, len(places), _BATCH)]
    with ProcessPoolExecutor(workers or os.cpu_count() or 1) as pool:
        jobs = {pool.submit(_seen, water, places[batch]): batch for batch in batches}
        for done in as_completed(jobs):
            seen[jobs[done]] = done.result()
            if tick is not None:
                tick(len(jobs[done]))
    return Agreement(water, places, planned, seen, step_m**3)


def draw_agreement(path: Path, agreement: Agreement) -> None:
    """A picture: sections through the planned region with the rendered places of the nearest layer of the grid.

    Raises:
        ConfigError: the file cannot be written.
    """
    station = WorldCfg().station
    sees = make_detectability(station.layout, PlanCfg(water=agreement.water))
    lights = station.layout.array_positions_m
    places = np.vstack([agreement.places_m, agreement.places_m * np.array([1.0, -1.0, 1.0])])
    seen = np.concatenate([agreement.seen, agreement.seen]).astype(np.float64)
    half_x = 0.5 * float(agreement.places_m[:, 0].max())
    panels: list[Panel] = []
    for name, axes, third, wanted in (
        ("level", (0, 1), 2, 0.0),
        ("upright", (0, 2), 1, 0.0),
        ("cross", (1, 2), 0, half_x),
    ):
        layers = np.unique(places[:, third])
        fixed = float(layers[np.argmin(np.abs(layers - wanted))])
        here = np.abs(places[:, third] - fixed) < 1e-6
        across, up = (np.linspace(places[:, k].min() - 0.5, places[:, k].max() + 0.5, 72) for k in axes)
        if axes[0] == 0:
            across = np.linspace(0.02, float(places[:, 0].max()) + 0.5, 72)
        count = section_grid(lambda points: sees.sighting(points).count, axes, across, up, fixed)
        checked = np.column_stack([places[here][:, axes], seen[here]])
        title = f"{name} section at {'xyz'[third]} = {fixed:.1f} m"
        panels.append(Panel(title, "xyz"[axes[0]], "xyz"[axes[1]], across, up, count, lights[:, axes], checked))
    ratio = agreement.intersection_over_union
    draw_sections(path, f"planned and rendered, {agreement.water}: intersection over union {ratio:.2f}", panels, 4)


def _seen(water: str, places: Array) -> list[bool]:
    eye = PixelEye(WorldCfg(water=water))
    try:
        return [eye.count(place) >= PlanCfg().min_lights for place in places]
    finally:
        eye.close()
