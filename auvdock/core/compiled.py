"""Loops over pixels, lights and small matrices, compiled by Numba where NumPy would take dozens of calls.

A compiled function is plain Python. It is compiled once, on its first call with arguments of its types, and kept on
disk beside its module, or in the user's cache folder, or not at all where neither can be written. Arithmetic keeps to
IEEE 754, so the same machine gives the same bits each time.

Numba notices when the file of a kept function changes, but not when a function that it calls from another file does:
hence a compiled function calls only compiled functions of its own file.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

__all__ = ["cache_folder", "compiled", "compiling", "external"]

_P = ParamSpec("_P")
_R = TypeVar("_R")
_numba: Any = import_module("numba")
_events: Any = import_module("numba.core.event")
_llvm: Any = import_module("llvmlite.binding")


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile a function with Numba; as in NumPy, x / 0 is `inf` or `nan`; indices are not checked."""
    try:
        return _numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # no folder for the cache can be written
        return _numba.njit(error_model="numpy")(function)


def cache_folder(function: Callable[..., object]) -> str | None:
    """Where a compiled function is kept on disk; None where no folder could be written."""
    return getattr(getattr(function, "stats", None), "cache_path", None)


def external(library: Path, name: str, addresses: int) -> Callable[..., None]:
    """A C function of a shared library that takes so many addresses and returns nothing, for compiled code to call.

    It is found by its name each time compiled code is loaded, so that code can be kept on disk.
    """
    _llvm.load_library_permanently(str(library))
    types = _numba.core.types
    return types.ExternalFunction(name, types.void(*[types.intp] * addresses))


@contextmanager
def compiling(tell: Callable[[], object]) -> Generator[None]:
    """Call `tell` once within this context, when a function is about to be compiled that was not kept on disk."""
    listener = _First(tell)
    with _events.install_listener("numba:compile", listener):
        yield


class _First(_events.Listener):
    """Passes on the first event."""

    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell: Callable[[], object] | None = tell

    def on_start(self, event: object) -> None:
        """A function is about to be compiled."""
        if self._tell is not None:
            tell, self._tell = self._tell, None
            tell()

    def on_end(self, event: object) -> None:
        """It is compiled."""
