"""Models as data; none of this needs PyTorch."""

import pytest

from auvdock.core.errors import ConfigError
from auvdock.core.reader import from_mapping
from auvdock.networks.catalog import load_model, model_names
from auvdock.networks.config import ChangeCfg, NetworkCfg

STEM = {"name": "stem", "block": "Conv", "channels": 8, "stride": 2}


def network(**change):
    plain = {"source": "here", "layers": [STEM, {"name": "end", "block": "C2f"}], "head": {"inputs": ["end"]}}
    return from_mapping(NetworkCfg, plain | change)


def test_every_model_can_be_read_and_says_whose_it_is():
    for name in model_names():
        cfg = load_model(name)
        assert cfg.source
        assert cfg.head.inputs


def test_a_row_of_several_changes_has_each_of_them():
    light, base = load_model("paper_a_light"), load_model("yolov8n_pose")
    blocks = {layer.name: layer.block for layer in light.layers}
    changed = [layer for layer in base.layers if blocks[layer.name] != layer.block]
    assert {blocks[layer.name] for layer in changed} == {"GhostConv", "CSPPC", "C3k2"}
    assert {layer.block for layer in changed} == {"Conv", "C2f"}
    assert [layer.name for layer in light.layers] == [layer.name for layer in base.layers]
    assert light.head.class_convolution == "separable"


def test_what_is_put_in_is_read_in_place_of_what_stands_before_it():
    layers = {layer.name: layer for layer in load_model("yolo_d").layers}
    assert list(layers).index("container") == list(layers).index("context") + 1
    assert layers["rejoin5"].inputs == ("back5", "container")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"layers": [STEM, STEM]}, "layers[1].name"),
        ({"layers": [STEM, {"name": "end", "block": "Concat", "inputs": ["later"]}]}, "layers[1].inputs"),
        ({"layers": [STEM | {"block": "Convolution"}]}, "layers[0].block"),
        ({"layers": [STEM | {"strides": 2}]}, "layers[0].strides"),
        ({"head": {"inputs": ["nowhere"]}}, "head.inputs"),
        ({"head": {"inputs": ["end"], "classes": 0}}, "head.classes"),
    ],
)
def test_a_graph_that_does_not_fit_is_refused(change, field):
    with pytest.raises(ConfigError) as refused:
        network(**change)
    assert refused.value.field == field


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"replace": [{"layers": ["nowhere"], "settings": {"block": "C3k2"}}]}, "replace[0].layers"),
        ({"replace": [{"layers": ["end"], "settings": {"blocks": "C3k2"}}]}, "replace[0].settings.blocks"),
        ({"insert": [{"after": "nowhere", "layer": STEM}]}, "insert[0].after"),
        ({"head": {"bins": 1}}, "head.bins"),
    ],
)
def test_a_change_that_does_not_fit_is_refused(change, field):
    with pytest.raises(ConfigError) as refused:
        network().changed(from_mapping(ChangeCfg, {"source": "here"} | change))
    assert refused.value.field == field


def test_an_unknown_model_is_refused_with_those_that_are_known():
    with pytest.raises(ConfigError, match="paper_a_light"):
        load_model("paper_a_lite")
