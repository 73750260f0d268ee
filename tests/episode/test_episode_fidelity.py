"""The two fidelities tell the same story: the same seeds, flown once with rendered frames and once without."""

import pytest

from auvdock.campaign.statistics import wilson
from auvdock.episode.config import level_cfg
from auvdock.episode.runner import EpisodeRunner

SEEDS = range(3)


def fly(fidelity):
    runner = EpisodeRunner(level_cfg(1).override({"world": {"fidelity": fidelity}}))
    results = [runner.run(seed) for seed in SEEDS]
    runner.world.close()
    return results


@pytest.mark.render
def test_success_rates_and_guidance_metrics_agree():
    pixels, beacons = fly("pixels"), fly("beacons")
    of_pixels, of_beacons = (wilson(sum(result.success for result in flown), len(flown)) for flown in (pixels, beacons))
    assert max(of_pixels.low, of_beacons.low) <= min(of_pixels.high, of_beacons.high)
    for one, other in zip(pixels, beacons, strict=True):
        assert one.success == other.success
        assert one.time_s == pytest.approx(other.time_s, rel=0.1)
        assert one.entry_distance_m == pytest.approx(other.entry_distance_m, rel=0.1)
        assert one.precise_frames == pytest.approx(other.precise_frames, rel=0.1)
        # The beacons fidelity may be wrong by a factor of three in the pose's error, not by more.
        assert one.pose_error_median_m is not None
        assert other.pose_error_median_m is not None
        assert 1 / 3 < one.pose_error_median_m / other.pose_error_median_m < 3
