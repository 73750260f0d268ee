"""Crops for training: their labels lie on what they label."""

from itertools import islice

import numpy as np
import pytest
from dataset_scenes import small_cfg
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.errors import ConfigError
from auvdock.dataset.crops import CropCfg, batches, crop, crops
from auvdock.dataset.frames import FrameLabels, LabelledImage, stream_frames
from auvdock.numeric.constants import BLUE, RED


def dots(places, width=400, height=260, ignored=None, side=10.0):
    """A dark picture with soft dots, and their labels."""
    v, u = np.mgrid[:height, :width]
    image = np.zeros((height, width, 3))
    for x, y in places:
        image += 255.0 * np.exp(-0.5 * ((u - x) ** 2 + (v - y) ** 2) / 4.0)[:, :, None]
    centre = np.array(places, dtype=float).reshape(-1, 2)
    count = len(centre)
    none = np.zeros(count, dtype=bool) if ignored is None else np.array(ignored)
    labels = FrameLabels(
        np.array([BLUE, RED] * count)[:count],
        np.hstack([centre - side / 2, centre + side / 2]),
        centre,
        none,
        np.arange(count, dtype=float),
    )
    return LabelledImage(np.clip(np.rint(image), 0, 255).astype(np.uint8), labels)


@settings(max_examples=60, deadline=None)
@given(
    x=st.floats(12.0, 387.0),
    y=st.floats(12.0, 247.0),
    seed=st.integers(0, 2**32),
    size_px=st.sampled_from([96, 192, 320]),
)
def test_a_label_lies_where_the_light_is(x, y, seed, size_px):
    taken = crop(dots([(x, y)]), np.random.default_rng(seed), CropCfg(size_px=size_px, near_share=1.0))
    assert taken.image.shape == (size_px, size_px, 3)
    weight = taken.image[:, :, 1].astype(float)
    v, u = np.mgrid[:size_px, :size_px]
    (centre,) = taken.labels.centre_px
    if np.all((centre > 8.0) & (centre < size_px - 9.0)):
        found = np.array([(u * weight).sum(), (v * weight).sum()]) / weight.sum()
        assert found == pytest.approx(centre, abs=0.15)
        left, top, right, bottom = taken.labels.xyxy[0]
        assert 0.5 * np.array([left + right, top + bottom]) == pytest.approx(centre)


def test_most_crops_hold_a_light():
    frame = dots([(380.0, 240.0)], width=2000, height=1500)
    rng = np.random.default_rng(0)
    share = np.mean([len(crop(frame, rng, CropCfg()).labels.class_id) > 0 for _ in range(600)])
    # Of the 15 % that lie anywhere few do; three standard deviations of 600 draws are 0.044.
    assert share == pytest.approx(0.86, abs=0.044)


def test_a_light_that_the_crop_cuts_is_ignored_and_classes_stay_with_their_lights():
    frame = dots([(100.0, 100.0), (150.0, 130.0), (330.0, 60.0)], ignored=[False, True, False])
    rng = np.random.default_rng(1)
    cut = 0
    for _ in range(400):
        labels = crop(frame, rng, CropCfg(size_px=96, near_share=0.0)).labels
        index = labels.c_range.astype(int)
        assert np.array_equal(labels.class_id, frame.labels.class_id[index])
        assert labels.ignored[index == 1].all()
        sides = labels.xyxy[:, 2:] - labels.xyxy[:, :2]
        assert (sides > 0.0).all()
        for side, centre, ignored in zip(
            *(part[index != 1] for part in (sides, labels.centre_px, labels.ignored)), strict=True
        ):
            # Boxes of 10 px are 10 to 12.8 px here, the least of them after the floor.
            assert ignored or side.min() >= 0.75 * 10.0
            assert not ignored or (np.minimum(centre, 95.0 - centre) < 6.4).any()
            cut += ignored
    assert cut > 5


def test_gains_change_each_channel_by_itself_within_bounds():
    flat = LabelledImage(np.full((300, 300, 3), 100, dtype=np.uint8), dots([]).labels)
    levels = np.array([item.image[5, 5] for item in islice(crops([flat], np.random.default_rng(2)), 200)], dtype=float)
    assert levels.min() >= 70
    assert levels.max() <= 130
    assert abs(np.corrcoef(levels.T)[0, 1]) < 0.25


def test_batches_are_the_same_for_the_same_generator_and_go_over_all_frames():
    frames = [dots([(50.0 + 40.0 * k, 100.0)]) for k in range(6)]
    one, other = (next(batches(frames, 6, np.random.default_rng(3))) for _ in range(2))
    assert one[0].shape == (6, 192, 192, 3)
    assert one[0].dtype == np.uint8
    assert np.array_equal(one[0], other[0])
    flat = [LabelledImage(np.full((200, 200, 3), 40 * k, dtype=np.uint8), dots([]).labels) for k in range(6)]
    images, _ = next(batches(flat, 6, np.random.default_rng(4), CropCfg(channel_gain=(1.0, 1.0))))
    assert sorted(images[:, 0, 0, 0].tolist()) == [0, 40, 80, 120, 160, 200]


def test_a_frame_smaller_than_a_crop_is_continued_by_its_border():
    flat = LabelledImage(np.full((60, 80, 3), 90, dtype=np.uint8), dots([]).labels)
    taken = crop(flat, np.random.default_rng(5), CropCfg(channel_gain=(1.0, 1.0)))
    assert (taken.image == 90).all()


def test_frames_stream_without_a_folder():
    cfg = small_cfg(scenes={"conditions": 1, "frames": 2})
    some = list(islice(stream_frames(cfg, 5), 5))
    again = list(islice(stream_frames(cfg, 5), 5))
    assert all(np.array_equal(a.image, b.image) for a, b in zip(some, again, strict=True))
    assert sum(len(frame.labels.class_id) for frame in some) > 0


def test_crops_of_nothing_and_gains_out_of_order_are_refused():
    with pytest.raises(ValueError, match="at least one frame"):
        next(crops([], np.random.default_rng(0)))
    with pytest.raises(ConfigError, match="channel_gain"):
        CropCfg(channel_gain=(1.3, 0.7))
