"""`auvdock train` refuses in one line what it cannot train."""

import subprocess
import sys

import pytest

from auvdock.cli.main import main

WITHOUT = """
import sys
class Without:
    def find_spec(self, name, path=None, target=None):
        if name == "torch":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Without())
from auvdock.cli.main import main
sys.exit(main(["train", "--model", "paper_a_light", "--data", "nowhere", "--out", "nowhere"]))
"""


def test_without_pytorch_one_line_says_what_to_install():
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "pip install 'auvdock[train]'" in done.stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--model", "paper_x"], "model"),
        (["--data", "nowhere"], "data"),
        (["--config", "nowhere.toml"], "config"),
        (["--config", "other"], "config"),
        (["--seed", "-1"], "seed"),
    ],
)
def test_what_cannot_be_trained_is_one_line(words, told, tmp_path, capsys):
    pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")
    pytest.importorskip("pycocotools")
    given = {"--model": "paper_a_light", "--data": str(tmp_path), "--out": str(tmp_path / "out"), words[0]: words[1]}
    assert main(["train", *(part for pair in given.items() for part in pair)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert f"error: {told}:" in captured.err
    assert not (tmp_path / "out").exists()
