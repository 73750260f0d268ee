"""Whole models: shapes, and sizes against those that others have published."""

from dataclasses import replace

import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")

from network_trials import make_lived_in  # noqa: E402

from auvdock.experiments.network_sizes import PUBLISHED, SizeResult, compare_sizes  # noqa: E402
from auvdock.networks.catalog import load_model, model_names  # noqa: E402
from auvdock.networks.network import Network  # noqa: E402
from auvdock.networks.size import measure_size  # noqa: E402

DFL_WEIGHTS = 16
"""Ultralytics count the distances 0 to 15, which are constants, as weights."""


@pytest.mark.parametrize(
    ("model", "classes", "keypoints", "parameters", "gflops"),
    [  # what Ultralytics' trainer prints for the models that it is published with
        ("yolov8n", 80, 0, 3_157_200, 8.7),
        ("yolov8n", 1, 17, 3_295_470, 9.2),
        ("yolov11n", 80, 0, 2_624_080, 6.5),
    ],
)
def test_the_familys_models_are_theirs_to_the_parameter(model, classes, keypoints, parameters, gflops):
    cfg = load_model(model)
    size = measure_size(replace(cfg, head=replace(cfg.head, classes=classes, keypoints=keypoints)))
    assert size.trained_parameters + DFL_WEIGHTS == parameters
    assert size.gflops == pytest.approx(gflops, rel=0.01)


@pytest.mark.parametrize("model", [name for name in model_names() if name != "yolov3"])
def test_every_model_finds_in_pictures_that_are_no_squares(model):
    cfg = load_model(model)
    with torch.device("meta"), torch.no_grad():
        network = Network(cfg).eval()
        found = network(torch.empty(2, 3, 384, 640))
    finest = network.head.strides_px[0]
    assert network.head.strides_px == tuple(finest * 2**level for level in range(len(cfg.head.inputs)))
    cells = sum((384 // stride) * (640 // stride) for stride in network.head.strides_px)
    assert found.shape == (2, 4 + cfg.head.classes + 3 * cfg.head.keypoints, cells)


def test_rows_of_the_papers():
    steps = []
    rows = compare_sizes(lambda: steps.append(1))
    assert len(rows) == len(steps) == len(PUBLISHED) == 32
    for row in rows:
        if isinstance(row, SizeResult) and row.published.required:
            assert row.met, row
            assert abs(row.size_difference) < 0.022, row
            assert abs(row.gflops_difference or 0.0) <= 0.02, row
    unmet = [(row.published.paper, row.published.row) for row in rows if isinstance(row, SizeResult) and not row.met]
    assert {paper for paper, _ in unmet} == {"B"}


def test_operations_are_two_for_each_weight_and_place():
    cfg = load_model("yolov8n_pose")
    whole, half = measure_size(cfg), measure_size(cfg, 320, 640)
    assert whole.gflops == pytest.approx(2.0 * half.gflops)
    assert whole.gflops == pytest.approx(whole.module_gflops)
    # Without a keypoint its branches are missing: on each level 3×3 to 16 channels, 3×3 again, 1×1 to 3.
    without = measure_size(replace(cfg, head=replace(cfg.head, keypoints=0)))
    levels = ((64, 80 * 80), (128, 40 * 40), (256, 20 * 20))
    operations = sum(2 * places * (9 * c * 16 + 9 * 16 * 16 + 16 * 3) for c, places in levels)
    assert 1e9 * (whole.gflops - without.gflops) == pytest.approx(operations)


def test_folding_a_whole_network_changes_no_result():
    torch.manual_seed(1)
    network, image = Network(load_model("paper_a_light")).eval(), torch.rand(1, 3, 64, 96)
    make_lived_in(network)
    with torch.no_grad():
        before = network(image)
        network.fold()
        torch.testing.assert_close(network(image), before, rtol=1e-4, atol=1e-3)
    assert not any(isinstance(part, torch.nn.BatchNorm2d) for part in network.modules())


@pytest.mark.parametrize("model", ["paper_a_light", "paper_b", "yolo_d"])
def test_every_weight_can_be_trained(model):
    torch.manual_seed(2)
    network = Network(load_model(model)).train()
    levels = network.raw(torch.rand(2, 3, 32, 64))
    said = torch.cat([part.flatten() for level in levels for part in level])
    (torch.randn_like(said) * said).sum().backward()
    for name, weight in network.named_parameters():
        assert weight.grad is not None, name
        assert torch.isfinite(weight.grad).all(), name
        assert weight.grad.abs().max() > 0.0, name
