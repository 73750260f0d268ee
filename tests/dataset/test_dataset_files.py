"""A data set's folder: the same bytes, resumed, in formats that others read; settings that are refused."""

import json
import shutil

import numpy as np
import pytest
from dataset_scenes import small_cfg

from auvdock.cli.main import main
from auvdock.core.errors import ConfigError
from auvdock.dataset.frames import read_frame, read_split
from auvdock.dataset.labels import CLASSES
from auvdock.dataset.make import Making
from auvdock.dataset.plan import SPLITS, plan_scenes, split_frames

FRAMES, SEED, SHARES = 22, 7, (3.0, 1.0, 2.0)


def make(folder, workers=1):
    making = Making(small_cfg(), FRAMES, SEED, SHARES, folder, shards=True)
    made = list(making.run(workers))
    making.finish()
    return made


def content(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "set"
    make(folder)
    return folder


def test_two_workers_write_the_same_bytes_as_one(dataset, tmp_path):
    make(tmp_path / "set", workers=2)
    assert content(tmp_path / "set") == content(dataset)


def test_a_killed_run_goes_on_after_its_finished_scenes(dataset, tmp_path):
    folder = tmp_path / "set"
    shutil.copytree(dataset, folder)
    before = content(folder)
    scenes = sorted((folder / "scenes").iterdir())
    scenes[1].unlink()
    for path in (folder / "card.json", *folder.glob(f"*/images/{scenes[1].stem}_001.png")):
        path.unlink()
    kept = {path: path.stat().st_mtime_ns for path in folder.rglob(f"{scenes[0].stem}*")}
    assert [scene.name for scene in make(folder)] == [scenes[1].stem]
    assert content(folder) == before
    assert kept == {path: path.stat().st_mtime_ns for path in kept}


def test_splits_share_no_scene_and_hold_what_was_asked_for(dataset):
    card = json.loads((dataset / "card.json").read_text())
    seeds = [seed for split in SPLITS for seed in card["splits"][split]["scene_seeds"]]
    assert len(set(seeds)) == len(seeds)
    assert [card["splits"][split]["frames"] for split in SPLITS] == [11, 4, 7]
    many = plan_scenes(small_cfg(), 40_000, 0, (1.0, 1.0, 1.0))
    assert len({scene.seed for scene in many}) == len(many)


def test_card_counts_what_the_annotations_hold(dataset):
    card = json.loads((dataset / "card.json").read_text())
    for split in SPLITS:
        coco = json.loads((dataset / "annotations" / f"{split}.json").read_text())
        positive = [item for item in coco["annotations"] if not item["iscrowd"]]
        counted = card["splits"][split]
        assert sum(counted["positives_by_class"].values()) == len(positive)
        assert sum(counted["positives_by_c_range"].values()) == len(positive)
        assert sum(counted["positives_by_side_px"].values()) == len(positive)
        assert sum(counted["ignored_by_reason"].values()) == len(coco["annotations"]) - len(positive)
        assert counted["frames"] == len(coco["images"]) == sum(counted["frames_by_c_range"].values())


def test_cocos_own_evaluator_gives_perfect_answers_full_marks(dataset):
    reader = pytest.importorskip("pycocotools.coco")
    evaluator = pytest.importorskip("pycocotools.cocoeval")
    truth = reader.COCO(str(dataset / "annotations" / "train.json"))
    assert [item["name"] for item in truth.loadCats(truth.getCatIds())] == list(CLASSES.values())
    keys = ("image_id", "category_id", "bbox", "keypoints")
    # Ignored ones too: to find them is no mistake.
    answers = [{**{key: item[key] for key in keys}, "score": 0.9} for item in truth.dataset["annotations"]]
    for kind in ("bbox", "keypoints"):
        run = evaluator.COCOeval(truth, truth.loadRes(answers), kind)
        run.params.kpt_oks_sigmas = np.array([0.1])
        run.evaluate()
        run.accumulate()
        run.summarize()
        assert run.stats[0] == pytest.approx(1.0)


def test_yolo_text_is_the_same_boxes(dataset):
    for split in SPLITS:
        coco = json.loads((dataset / "annotations" / f"{split}.json").read_text())
        for image in coco["images"]:
            ours = [item for item in coco["annotations"] if item["image_id"] == image["id"]]
            for kind, ignored in (("labels", 0), ("ignored", 1)):
                path = dataset / split / kind / image["file_name"].replace(".png", ".txt")
                lines = [[float(word) for word in line.split()] for line in path.read_text().splitlines()]
                size = np.array([image["width"], image["height"]])
                wanted = [item for item in ours if item["iscrowd"] == ignored]
                assert len(lines) == len(wanted)
                for (class_id, *numbers, visibility), item in zip(lines, wanted, strict=True):
                    box = np.array(item["bbox"])
                    assert class_id == item["category_id"] - 1
                    assert visibility == item["keypoints"][2]
                    assert np.array(numbers[:2]) * size == pytest.approx(box[:2] + box[2:] / 2.0, abs=2e-3)
                    assert np.array(numbers[2:4]) * size == pytest.approx(box[2:], abs=2e-3)
                    assert np.array(numbers[4:6]) * size == pytest.approx(item["keypoints"][:2], abs=2e-3)


def test_shards_hold_the_frames(dataset, tmp_path):
    folder = tmp_path / "set"
    shutil.copytree(dataset, folder)
    mapped = read_split(folder, "test")
    shutil.rmtree(folder / "shards")
    decoded = read_split(folder, "test")
    assert len(mapped) == len(decoded) == 7
    for one, other in zip(mapped, decoded, strict=True):
        assert np.array_equal(one.image, other.image)
        assert np.array_equal(one.labels.xyxy, other.labels.xyxy)


def test_what_is_no_data_set_is_refused_in_one_line(dataset, tmp_path):
    with pytest.raises(ConfigError, match="frames of the split 'train'"):
        read_split(tmp_path, "train")
    (tmp_path / "picture.png").write_bytes(b"no picture")
    with pytest.raises(ConfigError, match="image file"):
        read_frame(tmp_path / "picture.png")
    folder = tmp_path / "set"
    shutil.copytree(dataset, folder)
    shard = next((folder / "shards").glob("test_*"))
    shard.write_bytes(shard.read_bytes()[:300])
    with pytest.raises(ConfigError, match="shard"):
        read_split(folder, "test")
    next((folder / "scenes").glob("test_*")).write_text("{")
    with pytest.raises(ConfigError, match="auvdock dataset"):
        read_split(folder, "test")


def test_frames_are_shared_out_to_the_last_one():
    assert split_frames(3400, (2000.0, 200.0, 1200.0)) == (2000, 200, 1200)
    assert split_frames(10, (1.0, 1.0, 1.0)) == (4, 3, 3)
    assert split_frames(1, (0.0, 0.0, 0.3)) == (0, 0, 1)


@pytest.mark.parametrize(
    ("words", "text", "field"),
    [
        (["--frames", "0"], "", "frames"),
        (["--seed", "-1"], "", "seed"),
        (["--workers", "-1"], "", "workers"),
        (["--split", "0", "0", "0"], "", "split"),
        (["--split", "-1", "1", "1"], "", "split"),
        (["--config", "nothing"], "", "config"),
        ([], "[scenes]\nframez = 3\n", "scenes.framez"),
        ([], "[scenes]\nframes = 0\n", "scenes.frames"),
        ([], "[water]\nnames = ['pool', 'mud']\n", "water.names[1]"),
        ([], "[water]\nattenuation_per_m = [0.01, 1.0]\n", "water.attenuation_per_m"),
        ([], "[range]\ntest = [1.0]\n", "range.test"),
        ([], "[range]\nedges = [2.0, 1.0]\n", "range.edges"),
        ([], "[camera]\nf_number = [4.0, 2.0]\n", "camera.f_number"),
        ([], "[labels]\ndim_sigma = 9.0\n", "labels.dim_sigma"),
        ([], "scenes = 3\n", "scenes"),
        ([], "[scenes\n", "config"),
    ],
)
def test_settings_that_cannot_be_used_are_refused_by_name(words, text, field, tmp_path, capsys):
    file = tmp_path / "draw.toml"
    file.write_text(text)
    more = ["--config", str(file)] if text else []
    assert main(["dataset", "--out", str(tmp_path / "set"), *words, *more]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert line.startswith(f"auvdock: error: {field}")
    assert not (tmp_path / "set").exists()


def test_a_folder_of_another_recipe_or_of_something_else_is_refused(dataset, tmp_path, capsys):
    assert main(["dataset", "--out", str(dataset), "--frames", "3"]) == 2
    assert "another folder" in capsys.readouterr().err
    (tmp_path / "thesis.tex").write_text("")
    assert main(["dataset", "--out", str(tmp_path), "--frames", "3"]) == 2
    assert "an empty folder" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_the_command_writes_a_sheet_of_labelled_frames(tmp_path, capsys):
    file = tmp_path / "draw.toml"
    file.write_text("[nuisance]\nsurfaces = false\n[scenes]\nframes = 1\nconditions = 1\n")
    words = ["--out", str(tmp_path / "set"), "--frames", "3", "--config", str(file)]
    assert main(["dataset", *words, "--preview", str(tmp_path / "sheet.png")]) == 0
    sheet = read_frame(tmp_path / "sheet.png")
    assert sheet.shape[0] > 300
    assert sheet.max() > 200
