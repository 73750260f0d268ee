"""Weights from a file: those of the model, and nothing that a file could make Python run."""

import pickle

import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")

from auvdock.cli.main import main  # noqa: E402
from auvdock.core.errors import ConfigError  # noqa: E402
from auvdock.networks.catalog import load_model  # noqa: E402
from auvdock.networks.network import Network  # noqa: E402
from auvdock.networks.weights import load_weights  # noqa: E402


class Mischief:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_weights_come_back_as_they_were_written(tmp_path):
    first, second = (Network(load_model("paper_a_light")).eval() for _ in range(2))
    torch.save(first.state_dict(), tmp_path / "light.pt")
    load_weights(second, tmp_path / "light.pt")
    image = torch.rand(1, 3, 32, 32)
    with torch.no_grad():
        assert torch.equal(first(image), second(image))


def test_nothing_of_a_file_is_run(tmp_path):
    made = tmp_path / "made"
    torch.save({"stem": Mischief(made)}, tmp_path / "mischief.pt")
    (tmp_path / "plain.pt").write_bytes(pickle.dumps(Mischief(made)))
    made.unlink(missing_ok=True)
    for name in ("mischief.pt", "plain.pt"):
        with pytest.raises(ConfigError) as refused:
            load_weights(Network(load_model("paper_a_light")), tmp_path / name)
        assert refused.value.field == "weights"
        assert not made.exists()


def other_model(path):
    torch.save(Network(load_model("yolov8n_pose")).state_dict(), path)


@pytest.mark.parametrize(
    "write",
    [
        lambda path: None,
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"no weights" * 100),
        lambda path: torch.save([torch.zeros(3)], path),
        lambda path: torch.save({"stem": 3}, path),
        other_model,
    ],
    ids=["missing", "empty", "noise", "list", "numbers", "other model"],
)
def test_a_file_that_does_not_fit_is_one_line_and_writes_nothing(tmp_path, capsys, write):
    path, out = tmp_path / "weights.pt", tmp_path / "out.onnx"
    write(path)
    assert main(["export", "--model", "paper_a_light", "--weights", str(path), "--out", str(out)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "weights" in captured.err
    assert not out.exists()
