"""Array designs, pose error against a Monte Carlo, and that the optimiser beats the paper's ring."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from auvdock.core.errors import ConfigError
from auvdock.core.station import ConicalStationCfg, load_conical_station
from auvdock.core.strict import load_toml
from auvdock.core.transforms import rotation_looking_along
from auvdock.planning.array_design import ArrayBounds, bounds_of, decode, paper_lamps, physical_layout, ring_vector
from auvdock.planning.detectability import Sighting
from auvdock.planning.optimise import OptimiseCfg, optimise_paper, optimise_physical, physical_score
from auvdock.planning.paper_a import PaperAGrid, PaperALightCfg, count_visible, hull_volume_m3
from auvdock.planning.pose_error import position_sigma_m
from auvdock.planning.region import PlanCfg, guidance_space, make_detectability
from auvdock.planning.station_file import with_lights, write_station


def test_ring_vector_is_the_papers_ring_in_both_models():
    bounds = ArrayBounds()
    design = decode(ring_vector(bounds, 45.0, 6.0), 6)
    grid = PaperAGrid()
    seen = count_visible(paper_lamps(design), PaperALightCfg(turbulence=False), grid) >= 4
    assert hull_volume_m3(seen, grid) == pytest.approx(324.8, rel=0.02)
    ring = load_conical_station().layout
    layout = physical_layout(design, ring, 10.0)
    for one, other in zip(layout.beacons, ring.beacons, strict=True):
        assert one.name == other.name
        np.testing.assert_allclose(one.position_m, other.position_m, atol=1e-12)
        np.testing.assert_allclose(one.axis, other.axis, atol=1e-12)


@pytest.mark.parametrize("lights", [4, 5, 6, 7])
def test_designs_are_mirror_symmetric_and_within_bounds(lights):
    bounds = ArrayBounds(lights=lights)
    low, high = np.array(bounds_of(bounds)).T
    design = decode(np.random.default_rng(lights).uniform(low, high), lights)
    assert len(design.azimuth_rad) == lights
    places = np.column_stack(
        [design.radius_m * np.sin(design.azimuth_rad), design.radius_m * np.cos(design.azimuth_rad)]
    )
    gap = np.linalg.norm(places[:, None] * np.array([-1.0, 1.0]) - places[None], axis=2)
    assert gap.min(axis=1).max() < 1e-9
    assert design.radius_m.max() <= bounds.max_radius_m


def test_pose_error_is_that_of_a_least_squares_solution():
    layout = load_conical_station().layout
    sees = make_detectability(layout, PlanCfg(water="clear"))
    place = np.array([6.0, 1.5, -0.8])
    lights = layout.array_positions_m
    sigma_px, focal = 0.2, float(sees.sight.camera.matrix[0, 0])
    sighting = Sighting(
        np.ones((1, 6), dtype=bool), np.full((1, 6), 200.0), np.zeros((1, 6, 2)), np.full((1, 6), sigma_px), np.ones(1)
    )
    predicted = float(position_sigma_m(sees, place[None], sighting)[0])
    R = rotation_looking_along(sees.sight.target_m - place, np.array([0.0, 0.0, 1.0])).T

    def project(x):
        q = (lights - place - x[:3]) @ (Rotation.from_rotvec(x[3:]).as_matrix() @ R).T
        return (focal * q[:, :2] / q[:, 2:]).ravel()

    rng = np.random.default_rng(0)
    truth = project(np.zeros(6))

    def error_m():
        measured = truth + rng.normal(0.0, sigma_px, 12)
        return least_squares(lambda x: project(x) - measured, np.zeros(6)).x[:3]

    errors = [error_m() for _ in range(250)]
    spread = math.sqrt(np.mean(np.sum(np.square(errors), axis=1)))
    assert predicted == pytest.approx(spread, rel=0.12)


def test_too_few_lights_give_no_pose():
    sees = make_detectability(load_conical_station().layout, PlanCfg(water="clear"))
    sighting = sees.sighting(np.array([[6.0, 0.0, 0.0]]))
    few = dataclasses.replace(sighting, found=np.array([[True, True, True, False, False, False]]))
    assert np.isinf(position_sigma_m(sees, np.array([[6.0, 0.0, 0.0]]), few)).all()


def test_optimiser_beats_the_ring_in_the_papers_model():
    cfg = OptimiseCfg(generations=3, population=14)
    found = optimise_paper(cfg, PaperALightCfg(), np.random.default_rng(1))
    assert found.start_score == pytest.approx(324.8, rel=0.02)
    assert found.score > found.start_score


@pytest.mark.parametrize("goal", ["volume", "volume_per_watt", "pose_error"])
def test_optimiser_never_ends_behind_its_start(goal):
    station = load_conical_station().layout
    cfg = OptimiseCfg(goal, generations=1, population=8, directions=24, ranges=10)
    found = optimise_physical(station, cfg, PlanCfg(), np.random.default_rng(2))
    if goal == "pose_error":
        assert found.score <= found.start_score
    else:
        assert found.score >= found.start_score
    assert found.power_w <= cfg.power_w
    assert found.design.least_gap_m() >= cfg.bounds.min_gap_m


def test_probing_agrees_with_the_voxels():
    layout = load_conical_station().layout
    probed = physical_score(layout, OptimiseCfg(), PlanCfg(), 60.0)
    assert probed == pytest.approx(guidance_space(layout, PlanCfg(resolution=28)).volume_m3, rel=0.05)


@pytest.mark.parametrize("preset", ["conical", "rotating"])
def test_station_file_reads_back(tmp_path, preset):
    station = load_conical_station(preset)
    station = with_lights(station, station.layout)
    write_station(tmp_path / "station.toml", station)
    assert load_toml(ConicalStationCfg, tmp_path / "station.toml") == station


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"goal": "beauty"}, "volume"), ({"power_w": 0.0}, "power"), ({"cone_deg": 1.0}, "degrees")],
)
def test_refuses_searches_without_sense(settings, words):
    with pytest.raises(ConfigError, match=words):
        OptimiseCfg(**settings)


@pytest.mark.parametrize("settings", [{"lights": 3}, {"min_radius_m": 0.0}, {"min_beam_deg": 80.0}, {"min_gap_m": 5.0}])
def test_refuses_bounds_without_a_layout(settings):
    with pytest.raises(ConfigError, match=f"^{next(iter(settings))}: "):
        ArrayBounds(**settings)
