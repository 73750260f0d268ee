"""Where to put n lights: greatest guidance space, greatest per watt, or least pose error, by differential evolution."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from scipy.optimize import differential_evolution

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.checked import Checked
from auvdock.core.limits import Count, Positive, above, at_least, between
from auvdock.planning.array_design import (
    ArrayBounds,
    ArrayDesign,
    bounds_of,
    decode,
    paper_lamps,
    physical_layout,
    ring_vector,
)
from auvdock.planning.paper_a import PaperAGrid, PaperALightCfg, count_visible, hull_volume_m3
from auvdock.planning.pose_error import position_sigma_m
from auvdock.planning.region import PlanCfg, make_detectability

__all__ = ["Found", "OptimiseCfg", "optimise_paper", "optimise_physical", "physical_score"]

UNSEEN_ERROR_M = 2.0
"""Pose error that stands for a place from which too few lights are found."""


@dataclass(frozen=True)
class OptimiseCfg(Checked):
    """The search."""

    goal: Literal["volume", "volume_per_watt", "pose_error"] = "volume"
    """"volume", "volume_per_watt" (power is free up to the given one) or "pose_error"."""
    bounds: ArrayBounds = ArrayBounds()
    power_w: Positive = 60.0
    """Electrical power of the whole array; for "volume_per_watt" the most it may take."""
    generations: Count = 20
    """Generations of differential evolution."""
    population: Annotated[int, at_least(5)] = 16
    """Layouts in a generation."""
    directions: Annotated[int, at_least(8)] = 72
    """Directions, over a quarter sphere, at which the region is probed."""
    ranges: Annotated[int, at_least(4)] = 18
    """Ranges at which it is probed in each direction."""
    cone_deg: Annotated[float, between(5.0, 90.0)] = 90.0
    """Only places within this angle of the approach axis count; 90 is all that lies before the mouth."""
    reach_m: Annotated[float, above(1.0)] = 32.0
    """Greatest range that is probed."""


@dataclass(frozen=True, eq=False)
class Found:
    """Best array of a search.

    Attributes:
        design: the array.
        power_w: its electrical power.
        score: value of the goal: m³, m³/W, or m (pose error, less is better).
        start_score: the same of the ring that the search started from.
        evaluations: layouts tried.
    """

    design: ArrayDesign
    power_w: float
    score: float
    start_score: float
    evaluations: int


def optimise_physical(
    others: BeaconLayout,
    cfg: OptimiseCfg,
    plan: PlanCfg,
    rng: np.random.Generator,
    tick: Callable[[], object] | None = None,
) -> Found:
    """Place the array's lights in the physical model; the search starts from the paper's ring among random layouts.

    Args:
        others: the station; its lights other than the array's stay, and its array gives wavelength and efficiency.
        cfg: goal and bounds.
        plan: water and camera.
        rng: source of the search's draws.
        tick: called after each layout.
    """
    free_power = cfg.goal == "volume_per_watt"

    def cost(vector: Array) -> float:
        power = float(vector[-1]) if free_power else cfg.power_w
        layout_vector = vector[:-1] if free_power else vector
        design = decode(layout_vector, cfg.bounds.lights)
        penalty = _penalty(design, cfg.bounds)
        if penalty > 0.0:
            return penalty
        layout = physical_layout(design, others, power / cfg.bounds.lights)
        score = physical_score(layout, cfg, plan, power)
        return score if cfg.goal == "pose_error" else -score

    bounds = bounds_of(cfg.bounds)
    start = ring_vector(cfg.bounds, 45.0, 6.0)
    if free_power:
        bounds.append((0.05 * cfg.power_w, cfg.power_w))
        start = np.append(start, cfg.power_w)
    best, value, first, count = _search(cost, bounds, start, cfg, rng, tick)
    power = float(best[-1]) if free_power else cfg.power_w
    design = decode(best[:-1] if free_power else best, cfg.bounds.lights)
    sign = 1.0 if cfg.goal == "pose_error" else -1.0
    return Found(design, power, sign * value, sign * first, count)


def optimise_paper(
    cfg: OptimiseCfg, model: PaperALightCfg, rng: np.random.Generator, tick: Callable[[], object] | None = None
) -> Found:
    """Place the lights in paper A's model for the greatest hull on its grid, each light with the paper's intensity."""
    grid = PaperAGrid()

    def cost(vector: Array) -> float:
        design = decode(vector, cfg.bounds.lights)
        penalty = _penalty(design, cfg.bounds)
        if penalty > 0.0:
            return penalty
        return -hull_volume_m3(count_visible(paper_lamps(design), model, grid) >= 4, grid)

    start = ring_vector(cfg.bounds, 45.0, 6.0)
    best, value, first, count = _search(cost, bounds_of(cfg.bounds), start, cfg, rng, tick)
    return Found(decode(best, cfg.bounds.lights), cfg.power_w, -value, -first, count)


def physical_score(layout: BeaconLayout, cfg: OptimiseCfg, plan: PlanCfg, power_w: float) -> float:
    """The goal's value for a mirror-symmetric layout, from places at fixed directions and ranges."""
    sees = make_detectability(layout, plan)
    places, weight_m3 = _places(cfg)
    places = places + sees.sight.target_m
    sighting = sees.sighting(places)
    seen = sighting.count >= plan.min_lights
    if cfg.goal == "pose_error":
        sigma = np.minimum(position_sigma_m(sees, places, sighting), UNSEEN_ERROR_M)
        near = np.linalg.norm(places, axis=1) <= 0.5 * cfg.reach_m
        return float(np.sqrt(np.average(sigma[near] ** 2, weights=weight_m3[near])))
    volume = float(weight_m3[seen].sum())
    return volume / power_w if cfg.goal == "volume_per_watt" else volume


def _places(cfg: OptimiseCfg) -> tuple[Array, Array]:
    """Places (m, 3) in the half y > 0 of the cone and the volume (m,) of both halves that each stands for."""
    index = np.arange(cfg.directions) + 0.5
    cap = 1.0 - math.cos(math.radians(cfg.cone_deg))
    x = 1.0 - cap * index / cfg.directions
    phi = np.mod(index * (3.0 - math.sqrt(5.0)), 1.0) * math.pi - 0.5 * math.pi
    side = np.sqrt(1.0 - x**2)
    rays = np.column_stack([x, side * np.cos(phi), side * np.sin(phi)])
    edges = np.linspace(0.0, cfg.reach_m, cfg.ranges + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    shell = (edges[1:] ** 3 - edges[:-1] ** 3) * 2.0 * math.pi * cap / 3.0 / cfg.directions
    return (rays[None] * middle[:, None, None]).reshape(-1, 3), np.repeat(shell, cfg.directions)


def _penalty(design: ArrayDesign, bounds: ArrayBounds) -> float:
    """0 where no two lights are too close, else a positive cost that grows as they close in."""
    short = bounds.min_gap_m - design.least_gap_m()
    return 1e3 + 1e3 * short if short > 0.0 else 0.0


def _search(
    cost: Callable[[Array], float],
    bounds: list[tuple[float, float]],
    start: Array,
    cfg: OptimiseCfg,
    rng: np.random.Generator,
    tick: Callable[[], object] | None,
) -> tuple[Array, float, float, int]:
    """Best vector, its cost, the start's cost and the number of evaluations."""
    count = 0

    def counted(vector: Array) -> float:
        nonlocal count
        count += 1
        value = cost(vector)
        if tick is not None:
            tick()
        return value

    low, high = np.array(bounds).T
    population = rng.uniform(low, high, (cfg.population, len(bounds)))
    # A third of the first generation varies the ring: good layouts are near it, and random ones seldom see anything.
    near = cfg.population // 3
    population[1 : 1 + near] = start + rng.normal(0.0, 0.08, (near, len(bounds))) * (high - low)
    population[0] = start
    population = np.clip(population, low, high)
    first = cost(start)
    outcome = differential_evolution(
        counted,
        bounds,
        init=population,  # type: ignore[arg-type]  # SciPy takes an array, its annotation knows names only
        maxiter=cfg.generations,
        mutation=(0.4, 0.9),
        recombination=0.8,
        polish=False,
        tol=1e-6,
        rng=rng,
    )
    return np.asarray(outcome.x, dtype=np.float64), float(outcome.fun), first, count
