"""Paper B's tables as data, the means that it quotes, and one place watched."""

import math

import numpy as np
import pytest

from auvdock.experiments.rotating_rig import X_M, Y_M
from auvdock.experiments.rotating_tables import (
    PAPER_AZIMUTH_DEG,
    PAPER_DEVIATION_DEG,
    PLACES,
    mean_error,
    paper_mean,
)
from auvdock.experiments.rotating_watch import Place, Scenario, watch


def test_the_papers_means() -> None:
    """4.72° and 3.09° over 20 to 45 m, as its contributions say; 6.12 and 4.26 at most; 50 m only near the axis."""
    assert paper_mean(PAPER_AZIMUTH_DEG) == pytest.approx(4.72, abs=0.005)
    assert paper_mean(PAPER_DEVIATION_DEG) == pytest.approx(3.09, abs=0.005)
    assert len(PLACES) == 2 * len(X_M) * len(Y_M) == 56
    for table, greatest in ((PAPER_AZIMUTH_DEG, 6.12), (PAPER_DEVIATION_DEG, 4.26)):
        assert max(value for row in table.values() for value in row if value is not None) == greatest
        assert [key for key, row in table.items() if row[-1] is not None] == [(1.5, False), (-1.5, False)]


def test_mean_error_and_its_interval() -> None:
    """Mean of absolute values over all passes; the interval covers the mean of a known distribution."""
    assert mean_error([]).value is None
    assert mean_error([[], []]).videos == 0
    one = mean_error([[1.0, -3.0]])
    assert (one.value, one.low, one.passes) == (2.0, None, 2)
    rng = np.random.default_rng(0)
    covered = 0
    for _ in range(40):
        mean = mean_error(rng.normal(0.0, 1.0, (30, 2)).tolist())
        assert mean.low is not None
        assert mean.high is not None
        covered += mean.low <= math.sqrt(2.0 / math.pi) <= mean.high
    assert covered >= 34


@pytest.mark.parametrize("place", [Place(1.5, 30.0, False), Place(-4.5, 20.0, True)])
def test_one_place_without_an_image(place: Place) -> None:
    """Azimuth within 1°, deviation within 0.3°, and the same seed gives the same bits."""
    found = watch(place, 1, 4, "beacons")
    assert len(found.ours_deg) >= 1
    assert max(abs(error) for error in found.ours_deg) < 1.0
    assert max(abs(error) for error in found.ours_deviation_deg) < 0.3
    assert found.paper_deg == ()
    assert watch(place, 1, 4, "beacons") == found


def test_a_late_clock_is_nine_degrees() -> None:
    """50 ms at 0.5 rev/s."""
    found = watch(Place(1.5, 25.0, False), 2, 4, "beacons", Scenario("late", clock_offset_s=0.05))
    assert len(found.ours_deg) >= 1
    for error in found.ours_deg:
        assert error == pytest.approx(9.0, abs=1.0)


@pytest.mark.render
def test_one_place_in_pixels() -> None:
    """Both methods on the same frames: ours within 0.7° and near nothing in deviation, the paper's within its pass."""
    found = watch(Place(1.5, 30.0, False), 0, 4, "pixels")
    assert len(found.ours_deg) >= 1
    assert max(abs(error) for error in found.ours_deg) < 0.7
    assert max(abs(error) for error in found.ours_deviation_deg) < 0.1
    assert len(found.paper_deg) >= 3
    # It picks one of the pass's frames, which lie 6° apart on both sides of the peak.
    for error, frames in zip(found.paper_deg, found.run, strict=True):
        assert abs(error) < 6.0 * frames
    assert found.bound_deg is not None
    assert 0.0 < found.bound_deg < 0.1
