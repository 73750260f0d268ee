"""Walks everything that an object holds, and finds out which arrays share memory."""

from __future__ import annotations

import types
from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np

_NAMED = (type, types.FunctionType, types.BuiltinFunctionType, types.ModuleType)
_LEAVES = (str, bytes, int, float, complex, bool, type(None), np.generic, np.dtype, *_NAMED)


def parts(item: Any) -> Iterator[tuple[str, Any]]:
    """What an object holds, each with a name that it has in a copy as well."""
    if isinstance(item, types.MethodType):
        yield ".__self__", item.__self__
    elif isinstance(item, dict):
        yield from ((f"[{key!r}]", value) for key, value in item.items())
    elif isinstance(item, list | tuple | deque):
        yield from ((f"[{index}]", value) for index, value in enumerate(item))
    else:
        yield from ((f".{name}", value) for name, value in getattr(item, "__dict__", {}).items())
        for kind in type(item).__mro__:
            for name in np.atleast_1d(kind.__dict__.get("__slots__", ())):
                if not name.startswith("__") and hasattr(item, name):
                    yield f".{name}", getattr(item, name)


def walk(root: Any) -> dict[str, Any]:
    """Every object below `root` by every path that does not lead through one twice."""
    found: dict[str, Any] = {}
    seen: set[int] = set()
    todo: list[tuple[str, Any]] = [("", root)]
    while todo:
        path, item = todo.pop()
        if isinstance(item, _LEAVES):
            continue
        found[path] = item
        if id(item) in seen or isinstance(item, np.ndarray):
            continue
        seen.add(id(item))
        todo += [(path + name, part) for name, part in parts(item)]
    return found


def arrays(found: dict[str, Any]) -> list[tuple[int, int, str, np.ndarray]]:
    """First and last byte, path and array, in the order of memory."""
    rows = [
        (*np.lib.array_utils.byte_bounds(item), path, item)
        for path, item in found.items()
        if isinstance(item, np.ndarray) and item.size
    ]
    return sorted(rows, key=lambda row: row[:3])


def sharing(found: dict[str, Any]) -> set[tuple[str, str]]:
    """Pairs of paths to arrays that share memory which somebody may write to."""
    rows = arrays(found)
    pairs: set[tuple[str, str]] = set()
    for index, (_, end, path, item) in enumerate(rows):
        for start, _, other_path, other in rows[index + 1 :]:
            if start >= end:
                break
            if (item.flags.writeable or other.flags.writeable) and np.shares_memory(item, other):
                pairs.add((min(path, other_path), max(path, other_path)))
    return pairs


def aliases(found: dict[str, Any]) -> set[frozenset[str]]:
    """Groups of paths that lead to one object which can change: neither a value nor a tuple of values."""
    groups: dict[int, list[str]] = {}
    for path, item in found.items():
        if not isinstance(item, tuple | frozenset | range | slice):
            groups.setdefault(id(item), []).append(path)
    return {frozenset(paths) for paths in groups.values() if len(paths) > 1}


def shared_between(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Paths in `other` to memory, generators or simulators that `one` holds too."""
    kept = {id(item) for item in one.values() if isinstance(item, np.random.Generator) or _is_mujoco(item)}
    both = [path for path, item in other.items() if id(item) in kept]
    spans = [(start, end) for start, end, _, item in arrays(one) if item.flags.writeable]
    starts = np.array([start for start, _ in spans])
    for start, end, path, _ in arrays(other):
        before = int(np.searchsorted(starts, end))
        if any(begin < end and start < finish for begin, finish in spans[:before]):
            both.append(path)
    return both


def _is_mujoco(item: Any) -> bool:
    return type(item).__module__.startswith("mujoco") and type(item).__name__ in ("MjData", "MjModel")
