"""A network's file is refused unless it is what its card says; copies of a detector load it anew."""

import copy
import hashlib
import pickle
import re
from importlib.resources import as_file

import numpy as np
import pytest
from perception_scenes import CAMERA

from auvdock.assets import asset
from auvdock.cli.main import main
from auvdock.core.contracts import Frame
from auvdock.core.errors import ConfigError
from auvdock.perception.detectors import make_detector
from auvdock.perception.network_file import network_names, read_network

NAME = network_names()[0]


@pytest.fixture
def own(tmp_path):
    """A user's copy of a shipped network and its card."""
    for ending in (".onnx", ".toml"):
        with as_file(asset("networks/weights", NAME, ending)) as path:
            (tmp_path / f"own{ending}").write_bytes(path.read_bytes())
    return tmp_path / "own.onnx"


def write_model(path, model):
    """A file with a card that fits it, but for its content."""
    path.write_bytes(model)
    card = path.with_suffix(".toml")
    checksum = hashlib.sha256(model).hexdigest()
    card.write_text(re.sub(r'sha256 = "\w*"', f'sha256 = "{checksum}"', card.read_text()))


def picture():
    image = np.random.default_rng(1).integers(0, 30, (CAMERA.height_px, CAMERA.width_px, 3), dtype=np.uint8)
    image[100:106, 200:206] = 255
    return Frame(image, 0.0, CAMERA)


def test_each_shipped_network_is_small_and_its_card_is_filled_in():
    for name in network_names():
        file = read_network(name)
        assert len(file.model) <= 8_000_000
        assert hashlib.sha256(file.model).hexdigest() == file.card.sha256
        assert all(len(text) > 20 for text in (file.card.data, file.card.schedule, file.card.limits))
        assert file.card.scores


def test_a_network_of_ones_own_detects_as_the_shipped_one(own):
    first, second = (make_detector(name, min_score=0.01).detect(picture()) for name in (NAME, str(own)))
    assert len(first) > 0
    assert first.centre_px.tobytes() == second.centre_px.tobytes()


@pytest.mark.parametrize("make", [copy.deepcopy, lambda item: pickle.loads(pickle.dumps(item))])
def test_a_copy_detects_alike(make):
    detector = make_detector(NAME, min_score=0.01)
    first, second = detector.detect(picture()), make(detector).detect(picture())
    assert len(first) > 0
    assert first.centre_px.tobytes() == second.centre_px.tobytes()


def test_a_higher_score_keeps_fewer(own):
    counts = [len(make_detector(str(own), min_score=score).detect(picture())) for score in (0.001, 0.1, 1.0)]
    assert counts[0] > counts[1] >= counts[2] == 0


def one_byte_wrong(path):
    model = bytearray(path.read_bytes())
    model[len(model) // 2] ^= 1
    path.write_bytes(model)


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (one_byte_wrong, "SHA-256"),
        (lambda path: path.write_bytes(b""), "SHA-256"),
        (lambda path: path.unlink(), "read"),
        (lambda path: path.with_suffix(".toml").unlink(), "TOML"),
        (lambda path: path.with_suffix(".toml").write_text("model = 3"), "model"),
        (lambda path: write_model(path, b"no network" * 99), "ONNX Runtime"),
        (lambda path: write_model(path, b""), "ONNX Runtime"),
    ],
    ids=["one bit", "empty", "missing", "no card", "no card's content", "noise", "nothing"],
)
def test_a_damaged_file_is_one_line(own, damage, told, capsys):
    damage(own)
    with pytest.raises(ConfigError) as refused:
        make_detector(str(own))
    assert told in str(refused.value)
    assert main(["dock", "conical", "--fidelity", "pixels", "--detector", str(own)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize("shape", [(1, 8, 21), (1, 5, 21)])
def test_a_network_of_other_shape_is_refused(own, shape):
    onnx = pytest.importorskip("onnx")
    kind = onnx.TensorProto.FLOAT
    given = onnx.helper.make_tensor_value_info("images", kind, [1, 3, 64, 64])
    found = onnx.helper.make_tensor_value_info("found", kind, shape)
    values = onnx.numpy_helper.from_array(np.zeros(shape, dtype=np.float32), "zeros")
    node = onnx.helper.make_node("Constant", [], ["found"], value=values)
    graph = onnx.helper.make_graph([node], "zeros", [given], [found])
    model = onnx.helper.make_model(graph, ir_version=10, opset_imports=[onnx.helper.make_opsetid("", 18)])
    write_model(own, model.SerializeToString())
    with pytest.raises(ConfigError, match="one class and one keypoint"):
        make_detector(str(own))


def test_an_unknown_name_and_an_unknown_setting_are_named():
    with pytest.raises(ConfigError, match=NAME):
        make_detector("paper_x")
    with pytest.raises(ConfigError, match="colour"):
        make_detector(NAME, colour=3)
    with pytest.raises(ConfigError, match="threads"):
        make_detector(NAME, threads=0)
