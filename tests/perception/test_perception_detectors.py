"""Detectors on small synthetic images: Gaussian spots, bluish background, noise, eight bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from perception_scenes import CAMERA

from auvdock.core.arrays import Array
from auvdock.core.contracts import BLUE, RED, Detections, Frame, RegionOfInterest
from auvdock.core.errors import ConfigError
from auvdock.perception.detectors import DETECTORS, make_detector

BLUE_LIGHT = (0.25, 0.6, 1.0)
RED_LIGHT = (1.0, 0.3, 0.15)
WATER = (8.0, 18.0, 30.0)
Spot = tuple[float, float, float, float, tuple[float, float, float]]


def frame(spots: list[Spot], seed: int = 0, noise: float = 2.0, halo: float = 0.0) -> Frame:
    """An image of spots (u, v, peak, σ, colour); above 255 a core saturates, to white where all channels do."""
    rows, columns = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px].astype(np.float64)
    image = np.empty((CAMERA.height_px, CAMERA.width_px, 3))
    image[:] = WATER
    for u, v, peak, sigma, colour in spots:
        distance = np.hypot(columns - u, rows - v)
        light = peak * np.exp(-0.5 * (distance / sigma) ** 2) + halo * np.exp(-distance / 50.0)
        image += light[..., None] * np.array(colour)
    image += np.random.default_rng(seed).normal(0.0, noise, image.shape)
    return Frame(np.clip(np.round(image), 0, 255).astype(np.uint8), 0.0, CAMERA)


def matched(found: Detections, spots: list[Spot]) -> tuple[Array, np.ndarray]:
    """Distance from each spot to the nearest detection, and that detection's row."""
    truth = np.array([spot[:2] for spot in spots])
    gap = np.linalg.norm(truth[:, None] - found.centre_px[None], axis=2)
    return gap.min(axis=1), gap.argmin(axis=1)


RING: list[Spot] = [
    (320.3 + 90.0 * np.cos(angle), 180.2 + 90.0 * np.sin(angle), 220.0, 2.2, BLUE_LIGHT)
    for angle in np.arange(6) * np.pi / 3 + 0.2
]


@pytest.mark.parametrize("name", DETECTORS)
def test_nothing_to_see(name: str):
    """Noise alone, and a perfectly black image: no detections, right shapes."""
    detector = make_detector(name)
    for noise in (0.0, 2.0, 6.0):
        found = detector.detect(frame([], noise=noise))
        assert len(found) == 0
        assert found.xyxy.shape == (0, 4)
    assert len(detector.detect(frame([]), [RegionOfInterest(100, 100, 200, 200)])) == 0


@pytest.mark.parametrize("name", DETECTORS)
@pytest.mark.parametrize("peak", [220.0, 900.0])
def test_centroids(name: str, peak: float):
    """Six lights, unsaturated and with saturated cores: all found, nothing else, centres within 0.1 px."""
    spots = [(u, v, peak, sigma, colour) for u, v, _, sigma, colour in RING]
    found = make_detector(name).detect(frame(spots))
    assert len(found) == 6
    error, _ = matched(found, spots)
    assert error.max() < 0.1
    assert (found.score > 0.5).all()
    assert (found.score <= 1.0).all()
    assert (found.xyxy[:, 0] < found.centre_px[:, 0]).all()
    assert (found.xyxy[:, 3] > found.centre_px[:, 1]).all()


def test_centroid_is_unbiased_within_the_pixel():
    """The threshold detector over a grid of sub-pixel positions: no error above 0.1 px."""
    detector = make_detector("threshold")
    for step in range(8):
        spots: list[Spot] = [
            (100.0 + 60.0 * index + 0.125 * step, 180.0 + 0.125 * index, 180.0, 1.6, BLUE_LIGHT) for index in range(8)
        ]
        error, _ = matched(detector.detect(frame(spots, seed=step, noise=1.0)), spots)
        assert error.max() < 0.1


@pytest.mark.parametrize("name", DETECTORS)
def test_two_lights_are_resolved(name: str):
    """Two lights 5 σ apart and of unequal brightness are two, each within 0.5 px."""
    spots: list[Spot] = [(300.4, 180.1, 230.0, 2.0, BLUE_LIGHT), (310.4, 180.1, 160.0, 2.0, BLUE_LIGHT)]
    found = make_detector(name).detect(frame(spots))
    assert len(found) == 2
    error, rows = matched(found, spots)
    assert error.max() < 0.5
    assert rows[0] != rows[1]


@pytest.mark.parametrize("name", DETECTORS)
@pytest.mark.parametrize("peak", [200.0, 1500.0])
def test_colours(name: str, peak: float):
    """Red and blue are told apart, with white cores too."""
    spots: list[Spot] = [
        (200.0, 100.0, peak, 2.5, BLUE_LIGHT),
        (400.0, 100.0, peak, 2.5, RED_LIGHT),
        (200.0, 260.0, peak, 2.5, RED_LIGHT),
        (400.0, 260.0, peak, 2.5, BLUE_LIGHT),
    ]
    found = make_detector(name).detect(frame(spots))
    _, rows = matched(found, spots)
    assert found.class_id[rows].tolist() == [BLUE, RED, RED, BLUE]


def test_halos_of_turbid_water():
    """Broad halos brighter than the cores' surroundings: all six lights within 0.3 px, at most one more."""
    found = make_detector("threshold").detect(frame(RING, halo=25.0, noise=3.0))
    error, rows = matched(found, RING)
    assert error.max() < 0.3
    assert len(set(rows.tolist())) == 6
    assert len(found) <= 7


def test_dim_light_among_noise():
    """A light of ten times the smoothed noise: found within 1 px, no false one in ten images."""
    detector = make_detector("threshold")
    for seed in range(10):
        spots: list[Spot] = [(333.3, 123.4, 35.0, 2.0, BLUE_LIGHT)]
        found = detector.detect(frame(spots, seed=seed, noise=3.0))
        assert len(found) == 1
        assert matched(found, spots)[0][0] < 1.0


@pytest.mark.parametrize("name", DETECTORS)
def test_regions_restrict_and_agree(name: str):
    """In a region only its lights are found, at the same centres to 0.01 px as in the whole frame."""
    picture = frame(RING, halo=10.0)
    detector = make_detector(name)
    whole = detector.detect(picture)
    region = RegionOfInterest(320, 0, 640, 360)
    found = detector.detect(picture, [region])
    expected = whole.select(whole.centre_px[:, 0] >= 320.0)
    assert len(found) == len(expected) > 0
    assert len(found) < len(whole)
    gap = np.linalg.norm(found.centre_px[:, None] - expected.centre_px[None], axis=2)
    assert gap.min(axis=1).max() < 0.01
    # Overlapping regions do not double a light; a region without light finds none.
    twice = detector.detect(picture, [region, RegionOfInterest(300, 0, 640, 360)])
    assert len(twice) == len(whole.select(whole.centre_px[:, 0] >= 300.0))
    assert len(detector.detect(picture, [RegionOfInterest(0, 0, 40, 40)])) == 0
    assert len(detector.detect(picture, [RegionOfInterest(700, 400, 800, 500)])) == 0


@pytest.mark.parametrize("name", DETECTORS)
def test_same_image_same_detections(name: str):
    picture = frame(RING, halo=20.0)
    first, second = make_detector(name).detect(picture), make_detector(name).detect(picture)
    np.testing.assert_array_equal(first.centre_px, second.centre_px)
    np.testing.assert_array_equal(first.score, second.score)


def test_brighter_scores_higher():
    spots: list[Spot] = [(200.0, 180.0, 60.0, 2.0, BLUE_LIGHT), (400.0, 180.0, 200.0, 2.0, BLUE_LIGHT)]
    found = make_detector("threshold").detect(frame(spots))
    _, rows = matched(found, spots)
    assert found.score[rows[1]] > found.score[rows[0]]


def test_settings_reach_the_detector():
    spots: list[Spot] = [(200.0, 180.0, 60.0, 2.0, BLUE_LIGHT), (400.0, 180.0, 200.0, 2.0, BLUE_LIGHT)]
    assert len(make_detector("threshold", min_contrast=100.0).detect(frame(spots))) == 1
    with pytest.raises(ConfigError, match="min_contrast"):
        make_detector("threshold", min_contrats=100.0)
    with pytest.raises(ConfigError, match="noise_factor"):
        make_detector("threshold", noise_factor=0.0)
    with pytest.raises(ConfigError, match="min_threshold"):
        make_detector("blob", min_threshold=300.0)


def test_own_detector_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "own_light_finder.py").write_text(
        "import numpy as np\n"
        "from auvdock.core.contracts import Detections\n"
        "class Finder:\n"
        "    def __init__(self, score=0.5):\n"
        "        self.score = score\n"
        "    def detect(self, frame, regions=()):\n"
        "        return Detections.from_points(np.array([[1.0, 2.0]]), np.array([self.score]), np.array([0]))\n"
        "class Blind:\n"
        "    pass\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    found = make_detector("own_light_finder:Finder", score=0.25).detect(frame([]))
    assert found.centre_px.tolist() == [[1.0, 2.0]]
    assert found.score.tolist() == [0.25]
    for name, message in (
        ("own_light_finder:Blind", "detect"),
        ("own_light_finder:Absent", "own_light_finder has"),
        ("no_such_module_anywhere:Finder", "can be imported"),
    ):
        with pytest.raises(ConfigError, match=message):
            make_detector(name)
    with pytest.raises(ConfigError, match="settings"):
        make_detector("own_light_finder:Finder", colour="blue")


def test_unknown_name_lists_the_known():
    with pytest.raises(ConfigError, match="threshold, blob"):
        make_detector("treshold")
