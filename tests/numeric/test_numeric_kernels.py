"""A kernel, a function under @compiled, rests on its own file and on the shared room: kept code follows these."""

import ast
import builtins
import symtable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SHARED = "auvdock.numeric"
FOUND_BY_NAME = {("auvdock.sim.mj", "c_function")}
"""A C function that compiled code looks up each time it is loaded, so it holds no copy that could go stale."""


def top_level(node):
    """What stands in a module outside functions and classes, these included, also under `if` and `try`."""
    for part in ast.iter_child_nodes(node):
        yield part
        if not isinstance(part, ast.FunctionDef | ast.ClassDef):
            yield from top_level(part)


def imported(tree):
    """Where the names come from that a module imports: (module, name in it, None for the module itself)."""
    origin = {}
    for node in top_level(tree):
        if isinstance(node, ast.ImportFrom):
            origin |= {alias.asname or alias.name: (node.module, alias.name) for alias in node.names}
        elif isinstance(node, ast.Import):
            origin |= {alias.asname or alias.name.split(".")[0]: (alias.name, None) for alias in node.names}
    return origin


def made(tree):
    """What the names are made of that a module assigns, or defines by a function that is no kernel."""
    parts = {}
    for node in top_level(tree):
        names = set()
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}
            node = node.value
        elif isinstance(node, ast.FunctionDef) and not is_kernel(node):
            names = {node.name}
        for name in names:
            parts.setdefault(name, set()).update(part.id for part in ast.walk(node) if isinstance(part, ast.Name))
    return parts


def is_kernel(node):
    return any(
        isinstance(part, ast.Name) and part.id == "compiled" for mark in node.decorator_list for part in ast.walk(mark)
    )


def named(kernel):
    """Globals that a kernel's code names, its defaults included, without its annotations and decorators."""
    bare = ast.parse(ast.unparse(kernel)).body[0]
    assert isinstance(bare, ast.FunctionDef)
    bare.decorator_list, bare.returns = [], None
    for part in ast.walk(bare):
        if isinstance(part, ast.arg):
            part.annotation = None
        elif isinstance(part, ast.AnnAssign):
            part.annotation = ast.Constant(None)
    table = symtable.symtable(ast.unparse(bare), "kernel", "exec")
    names = {symbol.get_name() for symbol in table.get_symbols() if symbol.is_referenced()}
    scopes = table.get_children()
    for scope in scopes:  # comprehensions and nested functions are scopes of their own
        names |= {symbol.get_name() for symbol in scope.get_symbols() if symbol.is_global()}
        scopes += scope.get_children()
    return names - set(dir(builtins))


def strangers(source):
    """(kernel, what it rests on) for what is another file's of this project and not the shared room's."""
    tree = ast.parse(source)
    origin, parts = imported(tree), made(tree)
    found = []
    for kernel in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and is_kernel(node)):
        open_names, seen = sorted(named(kernel)), set()
        while open_names:
            name = open_names.pop()
            if name in seen:
                continue
            seen.add(name)
            open_names += sorted(parts.get(name, ()))
            module, what = origin.get(name, ("", None))
            is_ours = module.split(".")[0] == "auvdock"
            # Of the room by name only: through a module or a package anything could be reached.
            is_shared = module.startswith(f"{SHARED}.") and what is not None
            if is_ours and not is_shared and (module, what) not in FOUND_BY_NAME:
                found.append((kernel.name, f"{module}.{what}"))
    return found


FILES = sorted(
    path
    for room in ("auvdock", "controllers", "envs", "experiments", "assets")
    for path in (ROOT / room).rglob("*.py")
    if "@compiled" in path.read_text(encoding="utf-8")
)


def test_there_are_kernels_in_most_rooms():
    assert {"numeric", "sim", "optics", "perception", "controllers"} <= {
        part for path in FILES for part in path.relative_to(ROOT).parts
    }


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_kernel_rests_on_its_own_file_and_the_shared_room_only(path):
    assert strangers(path.read_text(encoding="utf-8")) == []


HEAD = """
import math
import numpy as np
from auvdock.core.arrays import Array
from auvdock.core import transforms
from auvdock.numeric.compiled import compiled
from auvdock.numeric import constants
from auvdock.numeric.constants import RED
from auvdock.optics.tag_pattern import BLACK_SHARE as share, tag_cells
_OWN, _MORE = 2.0 * RED, np.zeros(3)
_DERIVED = [share * _OWN]
_AGAIN: float = _DERIVED[0]
if True:
    from auvdock.core.marine import flip_vector
def _plain():
    return 3.0 * share
_THROUGH = _plain()
"""


@pytest.mark.parametrize(
    ("kernel", "expected"),
    [
        (
            "def k(x: Array) -> Array:\n    y: Array = x\n    return math.pi * y + _OWN * RED + len(_MORE) * np.sum(x)",
            [],
        ),
        ("def k(share):\n    return share", []),
        ("def k(x):\n    return x * share", ["auvdock.optics.tag_pattern.BLACK_SHARE"]),
        ("def k(x):\n    return tag_cells(x)", ["auvdock.optics.tag_pattern.tag_cells"]),
        ("def k(x):\n    return transforms.cross(x, x)", ["auvdock.core.transforms"]),
        ("def k(x):\n    return x * constants.RED", ["auvdock.numeric.constants"]),
        ("def k(x):\n    return x * _AGAIN", ["auvdock.optics.tag_pattern.BLACK_SHARE"]),
        ("def k(x):\n    return x * _THROUGH", ["auvdock.optics.tag_pattern.BLACK_SHARE"]),
        ("def k(x):\n    return flip_vector(x)", ["auvdock.core.marine.flip_vector"]),
        ("def k(x, y=share):\n    return x * y", ["auvdock.optics.tag_pattern.BLACK_SHARE"]),
        ("def k(x):\n    return [part * share for part in x]", ["auvdock.optics.tag_pattern.BLACK_SHARE"]),
    ],
)
def test_a_stranger_is_found_however_it_comes_in(kernel, expected):
    assert [what for _, what in strangers(f"{HEAD}\n@compiled\n{kernel}\n")] == expected
