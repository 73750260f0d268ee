"""`auvdock reproduce models`: rows, verdict, and what it says where PyTorch is missing."""

import json
import sys
from dataclasses import replace

import pytest

from auvdock.cli.main import main
from auvdock.experiments import network_sizes

LIGHT = next(row for row in network_sizes.PUBLISHED if row.model == "paper_a_light")
UNKNOWN = next(row for row in network_sizes.PUBLISHED if row.model is None)
NEEDED = "PyTorch is not installed; pip install 'auvdock[train]'"


def test_rows_have_the_papers_figures_and_ours(capsys, monkeypatch):
    pytest.importorskip("torch", reason=NEEDED)
    monkeypatch.setattr(network_sizes, "PUBLISHED", (LIGHT, UNKNOWN))
    assert main(["reproduce", "models", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    light, unknown = found["rows"]
    assert (found["required"], found["met"]) == (1, 1)
    assert (light["paper_size"], light["paper_gflops"], light["unit"]) == (1.8, 4.8, "M")
    assert light["size"] == pytest.approx(1e-6 * light["parameters"])
    assert light["size_difference"] == pytest.approx(light["size"] / 1.8 - 1.0)
    assert light["gflops_difference"] == pytest.approx(light["gflops"] / 4.8 - 1.0)
    assert unknown["model"] is None
    assert "parameters" not in unknown
    assert unknown["notes"]


def test_a_row_that_is_off_is_told(capsys, monkeypatch):
    pytest.importorskip("torch", reason=NEEDED)
    monkeypatch.setattr(network_sizes, "PUBLISHED", (replace(LIGHT, size="1.9"), UNKNOWN))
    assert main(["reproduce", "models"]) == 1
    out = capsys.readouterr().out
    assert "0 of 1 rows" in out
    assert UNKNOWN.row in out


class NoTorch:
    """Finds everything but PyTorch."""

    def find_spec(self, name, path=None, target=None):
        if name == "torch":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def test_without_pytorch_one_line_says_what_to_install(capsys, monkeypatch):
    monkeypatch.delitem(sys.modules, "torch", raising=False)
    monkeypatch.setattr(sys, "meta_path", [NoTorch(), *sys.meta_path])
    assert main(["reproduce", "models"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "pip install 'auvdock[train]'" in captured.err


def test_what_is_not_met_or_not_built_says_why():
    assert all(row.notes for row in network_sizes.PUBLISHED if row.model is None or row.paper == "B")
    used = {note for row in network_sizes.PUBLISHED for note in row.notes}
    assert used == set(network_sizes.NOTES)
