import math

import numpy as np
import pytest
from landing_scene import STATION, above, landing_camera, landing_setup, platform_scene

from auvdock.core.contracts import TagDetection
from auvdock.core.errors import ConfigError
from auvdock.core.strict import from_mapping
from auvdock.optics.detection_model import DetectionModelCfg
from auvdock.optics.faults import FaultCfg
from auvdock.optics.ground import Ground
from auvdock.optics.lamp import LampCfg
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.landing_sensing import LandingSensor, load_landing_detection_model
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.tag_fit import TagObservation, fit_tag_model
from auvdock.optics.tag_model import (
    TagModelCfg,
    TagSight,
    corner_sigma_px,
    draw_tag,
    inward,
    load_tag_model,
    tag_chance,
    tag_sight,
)

LIGHTS = DetectionModelCfg("test", "test", 20.0, 0.0, 6.0, 1.0, 2.0, 1.0, 0.02, 0.02, 1.0, 0.0, 0.0)
TAGS = TagModelCfg("test", "test", 3.0, 10.0, 12.0, 4.0, 0.98, 0.9, 0.03, 2.0, 0.9)
SQUARE = np.array([[300.0, 200.0], [380.0, 200.0], [380.0, 280.0], [300.0, 280.0]])
LAMP, SOUND, CALM = LampCfg(), FaultCfg(), NuisanceCfg()
ALL_DARK = ("B0", "B1", "B2", "B3", "B4")


def sensor(water="clear", lamp=LAMP, faults=SOUND, nuisance=CALM, model=LIGHTS, tag_model=TAGS):
    setup = landing_setup(landing_imaging(), water, lamp, faults, nuisance)
    return LandingSensor(setup, STATION, model=model, tag_model=tag_model)


def sight(cell=10.0, snr=200.0, spread=0.2, whole=True):
    return TagSight(SQUARE, cell, snr, spread, whole)


def test_lights_and_tag_from_above():
    unit = sensor()
    unit.reset(np.random.default_rng(0))
    detections, tags = unit.detect(above(2.5), 0.0)
    assert len(detections) == 5
    assert len(tags) == 1
    assert tags[0].tag_id == STATION.tag.tag_id
    # Image up is forward: the upper corners are the tag's edge to the head.
    assert tags[0].corners_px[0, 1] < tags[0].corners_px[3, 1]
    assert tags[0].corners_px[0, 0] < tags[0].corners_px[1, 0]


def test_same_seed_same_detections():
    results = []
    for _ in range(2):
        unit = sensor(nuisance=NuisanceCfg(flicker="severe", marine_snow="severe", interfering_lights="severe"))
        unit.reset(np.random.default_rng(7))
        seen = [unit.detect(above(3.0 - 0.2 * k, yaw_deg=k), 0.05 * k) for k in range(10)]
        results.append([(d.centre_px.tobytes(), [t.corners_px.tobytes() for t in tags]) for d, tags in seen])
    assert results[0] == results[1]


def test_looking_away_gives_nothing():
    unit = sensor()
    unit.reset(np.random.default_rng(0))
    detections, tags = unit.detect(above(3.0, roll_deg=180.0), 0.0)
    assert len(detections) == 0
    assert tags == ()


def test_faults_act_as_in_pixels():
    unit = sensor(faults=FaultCfg(tag_hidden_from_s=1.0, tag_hidden_for_s=2.0, dead_lights=("B0", "B2")))
    unit.reset(np.random.default_rng(0))
    counts = {t: sum(len(unit.detect(above(1.6), t + 0.01 * k)[1]) for k in range(10)) for t in (0.0, 1.0, 2.5, 3.2)}
    assert counts[0.0] >= 8
    assert counts[1.0] == counts[2.5] == 0
    assert counts[3.2] >= 8
    detections, _ = unit.detect(above(3.0), 10.0)
    assert len(detections) == 3


def test_turbid_water_and_height_lose_the_tag_first():
    found = {}
    for water in ("clear", "lake"):
        for height in (1.0, 5.0):
            unit = sensor(water)
            unit.reset(np.random.default_rng(0))
            seen = [unit.detect(above(height), 0.05 * k) for k in range(40)]
            found[water, height] = (np.mean([len(d) for d, _ in seen]), np.mean([len(t) for _, t in seen]))
    assert found["clear", 1.0][1] > 0.85
    assert found["lake", 1.0][1] > 0.8
    assert found["lake", 5.0][1] == 0.0
    assert found["clear", 5.0][0] > 4.9


def test_chance_rises_with_size_and_contrast_and_ends_at_the_ceiling():
    cells = [tag_chance(sight(cell=c), TAGS) for c in (1.0, 2.0, 3.0, 5.0, 20.0)]
    assert cells == sorted(cells)
    snrs = [tag_chance(sight(snr=q), TAGS) for q in (-1.0, 0.0, 3.0, 12.0, 50.0, 1e6)]
    assert snrs == sorted(snrs)
    assert snrs[0] == snrs[1] == 0.0
    assert tag_chance(sight(cell=3.0, snr=1e9), TAGS) == pytest.approx(0.49, rel=1e-6)
    assert tag_chance(sight(cell=1e3, snr=1e9), TAGS) == pytest.approx(0.98)
    assert tag_chance(sight(cell=1e3, snr=1e9, whole=False), TAGS) == pytest.approx(0.9)
    assert draw_tag(None, 0, TAGS, np.random.default_rng(0)) == ()


def test_drawn_corners_have_the_stated_spread_and_shift():
    rng = np.random.default_rng(1)
    one = sight(snr=20.0)
    drawn = [tag.corners_px - SQUARE for _ in range(3000) for tag in draw_tag(one, 0, TAGS, rng)]
    error = np.array(drawn)
    assert len(error) == pytest.approx(3000 * tag_chance(one, TAGS), rel=0.05)
    assert error.mean(axis=0) == pytest.approx(0.9 * 0.2 * inward(SQUARE), abs=0.01)
    assert error.std(axis=0) == pytest.approx(np.full((4, 2), corner_sigma_px(one, TAGS)), rel=0.08)


def test_inward_moves_both_edges_by_one():
    assert inward(SQUARE) == pytest.approx(np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]))


def test_fit_finds_the_model_that_drew():
    rng = np.random.default_rng(0)
    observations = []
    for _ in range(4000):
        cell, snr = math.exp(rng.uniform(0.0, 3.5)), math.exp(rng.uniform(0.5, 6.0))
        one = sight(cell, snr, rng.uniform(0.0, 0.4), bool(rng.random() < 0.9))
        found = draw_tag(one, 0, TAGS, rng)
        observations.append(TagObservation(one, found[0].corners_px if found else None))
    fitted = fit_tag_model("test", "test", observations)
    for name, tolerance in (("cell_50_px", 0.06), ("snr_50", 0.1), ("cell_slope", 0.3), ("snr_slope", 0.2)):
        assert getattr(fitted, name) == pytest.approx(getattr(TAGS, name), rel=tolerance), name
    assert fitted.ceiling == pytest.approx(0.98, abs=0.015)
    assert fitted.cut_share == pytest.approx(0.9, abs=0.06)
    assert fitted.corner_inward == pytest.approx(0.9, abs=0.03)
    # The fit's heavy-tailed law sees a Gaussian as slightly narrower.
    assert fitted.corner_noise_px == pytest.approx(2.0, rel=0.35)
    with pytest.raises(ValueError, match="20 frames"):
        fit_tag_model("test", "test", observations[:5])


def test_assets_are_there_and_unknown_detectors_are_refused():
    assert 1.0 < load_tag_model("apriltag").cell_50_px < 6.0
    assert load_landing_detection_model("cores").ceiling > 0.9
    with pytest.raises(ConfigError, match="apriltag"):
        load_tag_model("nobody")
    with pytest.raises(ConfigError, match="cores"):
        load_landing_detection_model("nobody")
    with pytest.raises(ConfigError):
        from_mapping(TagModelCfg, {**vars(TAGS), "ceiling": 1.5})


@pytest.mark.render
@pytest.mark.parametrize(("water", "height_m"), [("clear", 0.7), ("pool", 1.2), ("lake", 0.6)])
def test_both_fidelities_choose_like_exposures_and_see_like_contrasts(water, height_m):
    scene = platform_scene()
    pixels = landing_camera(landing_imaging(), water, LampCfg(), scene=scene)
    unit = sensor(water)
    try:
        for x in (0.0, 0.08):
            pixels.reset(np.random.default_rng(0))
            unit.reset(np.random.default_rng(0))
            shot = pixels.take(above(height_m, x), 0.0)
            unit.detect(above(height_m, x), 0.0)
            # Within a factor of 2 in exposure the codes differ by less than √2.
            ratio = unit.exposure.sensitivity_s / (shot.exposure_s * shot.gain)
            assert 0.5 < ratio < 2.0
            assert pixels.tag is not None
            view = pixels.tag.scene.look(shot.view)
            assert view is not None
            seen = tag_sight(view, pixels.lit, shot.exposure_s, shot.gain)
            assert seen is not None
            level = shot.frame.image @ np.array([0.299, 0.587, 0.114])
            left, top = seen.corners_px.min(axis=0).astype(int)
            right, bottom = seen.corners_px.max(axis=0).astype(int)
            patch = level[top:bottom, left:right]
            contrast = np.percentile(patch, 97.0) - np.percentile(patch, 3.0)
            noise = pixels.lit.scale(shot.gain).noise_dn(np.array([100.0]))[0] * math.sqrt(
                0.299**2 + 0.587**2 + 0.114**2
            )
            assert seen.contrast_snr == pytest.approx(contrast / noise, rel=0.2)
    finally:
        pixels.close()


@pytest.mark.render
def test_ground_is_as_bright_as_the_picture():
    pixels = landing_camera(
        landing_imaging(), "pool", LampCfg(), FaultCfg(dead_lights=ALL_DARK), scene=platform_scene()
    )
    try:
        assert pixels.tag is not None
        ground = Ground(pixels.tag.scene, STATION)
        for height in (0.6, 1.5, 3.0):
            view = pixels.lit.look(above(height), 0.0)
            picture = pixels.electrons(view, 1e-3)[25::50, 25::50].reshape(-1, 3).astype(float)
            guess = ground.electrons_per_s(view.T_world_camera) * 1e-3
            assert np.median(guess, axis=0) == pytest.approx(np.median(picture, axis=0), rel=0.2)
    finally:
        pixels.close()


def test_tag_detection_is_the_contracts():
    (tag,) = draw_tag(sight(snr=1e6), 3, TAGS, np.random.default_rng(2))
    assert isinstance(tag, TagDetection)
    assert tag.tag_id == 3
    assert tag.sigma_px == pytest.approx(0.03, rel=1e-3)
