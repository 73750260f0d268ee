"""Track views are made late, but show the frame that they were asked for."""

from __future__ import annotations

import numpy as np

from auvdock.numeric.tracks import Track
from auvdock.perception.views import TrackViews


def test_views_stay_what_they_were_when_the_tracker_goes_on() -> None:
    tracks = Track.zeros(3)
    tracks["centre_px"][:2] = [[1.0, 2.0], [3.0, 4.0]]
    for name, numbers in {"track_id": (7, 9), "class_id": (0, 1), "beacon_id": (-1, 3), "missed": (0, 2)}.items():
        tracks[name][:2] = numbers
    views = TrackViews(tracks[:2])
    for name in ("centre_px", "track_id", "class_id", "beacon_id", "missed"):
        tracks[name][:] += 100
    assert len(views) == 2
    first, second = views
    assert (first.track_id, first.class_id, first.beacon_id, first.missed) == (7, 0, None, 0)
    assert (second.track_id, second.class_id, second.beacon_id, second.missed) == (9, 1, 3, 2)
    np.testing.assert_array_equal(views[1].centre_px, [3.0, 4.0])
    assert [view.track_id for view in views[:1]] == [7]


def test_no_tracks() -> None:
    views = TrackViews(Track.zeros(0))
    assert len(views) == 0
    assert list(views) == []
