"""`auvdock export`: from weights to a file that ONNX Runtime reads."""

import hashlib
import json

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")
pytest.importorskip("onnxscript", reason="onnxscript is not installed; pip install 'auvdock[train]'")

from network_trials import make_lived_in, run_onnx  # noqa: E402

from auvdock.cli import export  # noqa: E402
from auvdock.cli.main import main  # noqa: E402
from auvdock.core.reader import from_mapping  # noqa: E402
from auvdock.networks.config import NetworkCfg  # noqa: E402
from auvdock.networks.network import Network  # noqa: E402

SMALL = {
    "source": "one level",
    "layers": [{"name": "end", "block": "Conv", "channels": 8, "stride": 4}],
    "head": {"inputs": ["end"]},
}


def test_from_weights_to_onnx(tmp_path, capsys, monkeypatch):
    cfg = from_mapping(NetworkCfg, SMALL)
    network = Network(cfg).eval()
    make_lived_in(network)
    weights, out = tmp_path / "w.pt", tmp_path / "o.onnx"
    torch.save(network.state_dict(), weights)
    monkeypatch.setattr(export, "load_model", lambda name: cfg)
    words = ["export", "--model", "small", "--weights", str(weights), "--json", "--out"]
    assert main([*words, str(out)]) == 0
    told = json.loads(capsys.readouterr().out)
    model = out.read_bytes()
    assert told["sha256"] == hashlib.sha256(model).hexdigest()
    assert told["bytes"] == len(model)
    assert told["greatest_difference"] < 1e-3
    image = torch.rand(1, 3, 20, 36)
    with torch.no_grad():
        np.testing.assert_allclose(run_onnx(model, images=image)[0], network(image), rtol=1e-4, atol=1e-3)
    assert main([*words, str(tmp_path / "nowhere" / "o.onnx")]) == 74
    captured = capsys.readouterr()
    assert "nowhere" in json.loads(captured.out)["recording_error"]
    assert captured.err.count("\n") == 1


def test_an_unknown_model_is_named_with_those_there_are(tmp_path, capsys):
    assert main(["export", "--model", "none", "--weights", "w.pt", "--out", str(tmp_path / "o.onnx")]) == 2
    assert "paper_a_light" in capsys.readouterr().err
