"""What every command does: tell that it compiles, unless nothing but JSON was asked for."""

import sys
from types import ModuleType

import pytest

from auvdock.cli.main import COMMANDS, main
from auvdock.core.compiled import compiled


@pytest.mark.parametrize(("words", "lines"), [(["compile"], 1), (["compile", "--json"], 0)])
def test_tells_that_it_compiles(words, lines, monkeypatch, capsys):
    def run(argv, prog):
        space = {}
        exec("def twice(x):\n    return 2 * x", space)
        return compiled(space["twice"])(21) - compiled(space["twice"])(21)

    module = ModuleType("compiles")
    monkeypatch.setattr(module, "run", run, raising=False)
    monkeypatch.setitem(sys.modules, "compiles", module)
    monkeypatch.setitem(COMMANDS, ("compile",), ("compiles:run", "compile something"))
    assert main(words) == 0
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("compiling") == len(printed.err.splitlines()) == lines
