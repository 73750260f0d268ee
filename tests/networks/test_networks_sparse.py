"""Boxes and keypoints on patches are those of the whole picture."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")
pytest.importorskip("onnxscript", reason="onnxscript is not installed; pip install 'auvdock[train]'")

from network_trials import make_lived_in, run_onnx  # noqa: E402

from auvdock.core.reader import from_mapping  # noqa: E402
from auvdock.networks.catalog import load_model  # noqa: E402
from auvdock.networks.config import NetworkCfg  # noqa: E402
from auvdock.networks.export import export_sparse  # noqa: E402
from auvdock.networks.network import Network  # noqa: E402
from auvdock.networks.sparse import PatchHead, ScorePart, cut_patches  # noqa: E402


@pytest.mark.parametrize("model", ["paper_a_light", "yolo_d"])
def test_every_cell_of_every_level_at_borders_too(model):
    torch.manual_seed(0)
    network = Network(load_model(model)).eval()
    make_lived_in(network)
    network.fold()
    image = torch.rand(1, 3, 96, 160)
    with torch.no_grad():
        whole = network(image)
        scores, *features = ScorePart(network)(image)
        classes = scores.shape[1]
        torch.testing.assert_close(scores, whole[:, 4 : 4 + classes])
        for index, (level, x) in enumerate(zip(network.raw(image), features, strict=True)):
            cells = [(row, column) for row in range(x.shape[2]) for column in range(x.shape[3])]
            said = PatchHead(network, index)(*cut_patches(x, cells))
            expected = torch.cat((level.box, level.keypoints), 1)[0].flatten(1).T
            torch.testing.assert_close(said, expected, rtol=1e-4, atol=1e-4)


def test_a_head_that_patches_cannot_replace_is_refused():
    with pytest.raises(TypeError, match="RFAConv"):
        PatchHead(Network(load_model("paper_b")), 0)


def test_exported_parts_agree_with_the_whole_network():
    torch.manual_seed(1)
    plain = {
        "source": "one level",
        "layers": [{"name": "end", "block": "Conv", "channels": 8, "stride": 4}],
        "head": {"inputs": ["end"]},
    }
    network = Network(from_mapping(NetworkCfg, plain)).eval()
    make_lived_in(network)
    image = torch.rand(1, 3, 32, 48)
    with torch.no_grad():
        whole, (level,) = network(image), network.raw(image)
    scores_model, (head_model,) = export_sparse(network)
    scores, features = run_onnx(scores_model, images=image)
    np.testing.assert_allclose(scores, whole[:, 4:5], rtol=1e-4, atol=1e-6)
    patches, inside = cut_patches(torch.from_numpy(features), [(0, 0), (3, 5), (7, 11), (4, 0)])
    (said,) = run_onnx(head_model, patches=patches, inside=inside)
    expected = torch.cat((level.box, level.keypoints), 1)[0, :, [0, 3, 7, 4], [0, 5, 11, 0]].T
    np.testing.assert_allclose(said, expected, rtol=1e-4, atol=1e-4)
