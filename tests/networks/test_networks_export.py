"""Export: ONNX Runtime finds what PyTorch finds, in pictures of any size."""

import numpy as np
import onnxruntime
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")
pytest.importorskip("onnxscript", reason="onnxscript is not installed; pip install 'auvdock[train]'")

from network_trials import make_lived_in, run_onnx  # noqa: E402

from auvdock.core.reader import from_mapping  # noqa: E402
from auvdock.networks.config import NetworkCfg  # noqa: E402
from auvdock.networks.export import INPUT, OUTPUT, STRIDE_KEY, export_onnx, greatest_difference  # noqa: E402
from auvdock.networks.network import Network  # noqa: E402

SMALL = {
    "source": "one of each block that is more than convolutions",
    "layers": [
        {"name": "fine", "block": "Conv", "channels": 16, "stride": 2},
        {"name": "moved", "block": "AKConv", "channels": 16, "stride": 2},
        {"name": "attend", "block": "C2PSA"},
        {"name": "context", "block": "Container"},
        {"name": "up", "block": "Upsample"},
        {"name": "join", "block": "WeightedConcat", "inputs": ["up", "fine"]},
        {"name": "end", "block": "C2f_DC", "channels": 16},
    ],
    "head": {"inputs": ["end", "context"], "classes": 2, "convolution": "RFAConv"},
}


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    made = Network(from_mapping(NetworkCfg, SMALL)).eval()
    make_lived_in(made)
    with torch.no_grad():
        for name, values in made.named_parameters():
            if "moves.weight" in name:
                values.normal_(0.0, 0.05)
    return made


def test_onnx_runtime_agrees_at_any_size(network, capfd):
    images = [torch.rand(1, 3, *size) for size in ((64, 96), (80, 40))]
    with torch.no_grad():
        expected = [network(image).numpy() for image in images]
    model = export_onnx(network)
    assert capfd.readouterr() == ("", "")
    session = onnxruntime.InferenceSession(model)
    assert session.get_modelmeta().custom_metadata_map[STRIDE_KEY] == "4"
    assert [place.name for place in (*session.get_inputs(), *session.get_outputs())] == [INPUT, OUTPUT]
    for image, wanted in zip(images, expected, strict=True):
        (found,) = run_onnx(model, **{INPUT: image})
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-3)
    sizes = [(64, 96), (80, 40)]
    assert greatest_difference(network, model, sizes) < 1e-3
    with torch.no_grad():
        network.head.keypoints[0][-1].bias.add_(1.0)
    assert greatest_difference(network, model, sizes) > 1e-3
