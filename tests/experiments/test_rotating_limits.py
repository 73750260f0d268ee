"""How far the beacon is seen: counted from videos, and from turns that are spread evenly over the frames' phase."""

import pytest

from auvdock.experiments.rotating_limits import Sight, limits
from auvdock.experiments.rotating_rig import X_M
from auvdock.experiments.rotating_tables import run_videos
from auvdock.experiments.rotating_watch import Place


def test_limits_count_videos_with_passes() -> None:
    """A place where half of the videos time their passes counts, the paper's own limits come from its table."""
    rows = limits(run_videos([Place(1.5, 20.0, False)], 1, 4, "beacons"))
    near = next(row for row in rows if (row.x_m, row.day) == (1.5, False))
    assert (near.paper_m, near.ours_m) == (50.0, 20.0)
    far = next(row for row in rows if (row.x_m, row.day) == (4.5, True))
    assert (far.paper_m, far.ours_m) == (45.0, 0.0)
    assert (far.found_m, far.shares) == (None, ())


def test_limits_take_the_farthest_half() -> None:
    """The share of turns decides, a half included; none on the whole line is 0."""
    sights = [
        Sight(1.5, False, (50.0,), (0.5,)),
        Sight(4.5, False, (50.0, 45.0), (0.49, 1.0)),
        Sight(-4.5, True, (50.0, 45.0), (0.0, 0.1)),
    ]
    rows = {(row.x_m, row.day): row for row in limits([], sights)}
    assert len(rows) == 2 * len(X_M)
    assert rows[1.5, False].found_m == 50.0
    assert rows[4.5, False].found_m == 45.0
    assert rows[4.5, False].shares == ((50.0, 0.49), (45.0, 1.0))
    assert rows[-4.5, True].found_m == 0.0
    assert rows[-1.5, True].ours_m == pytest.approx(0.0)
