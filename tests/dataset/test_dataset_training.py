"""Numbered batches: what a step sees depends on its number alone, and all frames come round."""

import numpy as np
import pytest
from dataset_scenes import small_cfg

from auvdock.dataset.crops import CropCfg
from auvdock.dataset.frames import FrameLabels, LabelledImage
from auvdock.dataset.labels import TAG
from auvdock.dataset.make import Making
from auvdock.dataset.training import for_classes, load_training_cfg, numbered_batch
from auvdock.numeric.constants import BLUE, RED

CFG = CropCfg(size_px=64, channel_gain=(1.0, 1.0), zoom_log=0.0)


def frames(count=7):
    """Frames of one grey each, so that a crop tells of which it is, with a light in the middle."""
    made = []
    for k in range(count):
        centre = np.array([[80.0, 60.0]])
        labels = FrameLabels(
            np.array([BLUE]), np.hstack([centre - 6, centre + 6]), centre, np.zeros(1, dtype=bool), np.ones(1)
        )
        made.append(LabelledImage(np.full((120, 160, 3), 10 * k + 5, dtype=np.uint8), labels))
    return made


def test_a_step_is_the_same_whenever_it_is_asked_for():
    there = frames()
    first = [numbered_batch(there, step, 4, 3, 1, CFG) for step in range(4)]
    again = numbered_batch(there, 2, 4, 3, 1, CFG)
    assert again.images.tobytes() == first[2].images.tobytes()
    for one, other in zip(again.targets, first[2].targets, strict=True):
        np.testing.assert_array_equal(one, other)
    assert first[2].images.tobytes() != first[3].images.tobytes()
    assert first[2].images.tobytes() != numbered_batch(there, 2, 4, 4, 1, CFG).images.tobytes()


def test_each_frame_comes_once_before_any_comes_again():
    there = frames(6)
    seen = np.concatenate([numbered_batch(there, step, 4, 0, 1, CFG).images[:, 0, 0, 0] for step in range(3)])
    assert len(set(seen[:6])) == len(set(seen[6:])) == 6
    assert list(seen[:6]) != list(seen[6:])


def test_targets_count_from_the_pictures_corner():
    batch = numbered_batch(frames(), 0, 5, 0, 1, CFG)
    targets = batch.targets
    counting = ~targets.ignored
    assert counting.sum() >= 3
    assert targets.keypoints_px.min() >= 0.0
    assert targets.keypoints_px.max() <= 64.0
    middle = (targets.xyxy[:, :2] + targets.xyxy[:, 2:]) / 2.0
    whole = counting & (np.ptp(targets.xyxy.reshape(-1, 2, 2), axis=1) > 11.9).all(axis=1)
    np.testing.assert_allclose(targets.keypoints_px[whole, 0], middle[whole], atol=1e-6)
    assert set(targets.picture) <= set(range(5))


@pytest.mark.parametrize(("classes", "expected"), [(1, [0, 0]), (2, [0, 0, 1]), (3, [BLUE, RED, TAG])])
def test_classes_as_a_network_has_them(classes, expected):
    centre = np.zeros((3, 2))
    box = np.zeros((3, 4))
    labels = FrameLabels(np.array([BLUE, RED, TAG]), box, centre, np.zeros(3, dtype=bool), np.arange(3.0))
    assert for_classes(labels, classes).class_id.tolist() == expected


def test_a_training_that_was_ended_goes_on_to_the_same_weights(tmp_path):
    torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")
    pytest.importorskip("pycocotools")
    from auvdock.core.strict import merge
    from auvdock.experiments.network_training import TrainingRun

    making = Making(small_cfg(), 12, 5, (8.0, 4.0, 0.0), tmp_path / "set", shards=True)
    assert list(making.run(1))
    making.finish()
    tiny = {"crops": 12, "batch": 2, "warm_up_steps": 2, "validate_steps": 3, "keep_steps": 2}
    cfg = merge(load_training_cfg(), {"schedule": tiny, "crop": {"size_px": 64}})

    def start(name):
        return TrainingRun("paper_a_light", tmp_path / "set", tmp_path / name, cfg, seed=1)

    whole = list(start("whole").run())
    assert [told.step for told in whole] == [1, 2, 3, 4, 5, 6]
    assert [told.step for told in whole if told.score is not None] == [3, 6]
    ended = start("broken").run()
    for _ in range(5):  # the last checkpoint is that of step 4
        next(ended)
    del ended
    resumed = start("broken")
    assert resumed.done == 4
    rest = list(resumed.run())
    assert [told.losses for told in rest] == [told.losses for told in whole[4:]]
    names = ("weights.pt", "losses.csv", "training.json")
    one, other = ({name: (tmp_path / out / name).read_bytes() for name in names[1:]} for out in ("whole", "broken"))
    assert one == other
    first, second = (torch.load(tmp_path / out / names[0], weights_only=True) for out in ("whole", "broken"))
    assert all(torch.equal(values, second[name]) for name, values in first.items())
    assert (tmp_path / "whole" / "curve.png").read_bytes().startswith(b"\x89PNG")
