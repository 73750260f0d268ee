"""Track views are made late, but show the frame that they were asked for."""

from __future__ import annotations

import numpy as np

from auvdock.perception.views import TrackViews


def test_views_stay_what_they_were_when_the_tracker_goes_on() -> None:
    centre_px, labels = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[7, 0, -1, 0], [9, 1, 3, 2]])
    views = TrackViews(centre_px, labels)
    centre_px += 100.0
    labels += 100
    assert len(views) == 2
    first, second = views
    assert (first.track_id, first.class_id, first.beacon_id, first.missed) == (7, 0, None, 0)
    assert (second.track_id, second.class_id, second.beacon_id, second.missed) == (9, 1, 3, 2)
    np.testing.assert_array_equal(views[1].centre_px, [3.0, 4.0])
    assert [view.track_id for view in views[:1]] == [7]


def test_no_tracks() -> None:
    views = TrackViews(np.zeros((0, 2)), np.zeros((0, 4), dtype=np.int64))
    assert len(views) == 0
    assert list(views) == []
