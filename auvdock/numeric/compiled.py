"""Loops over pixels, lights and small matrices, compiled by Numba where NumPy would take dozens of calls.

A compiled function is plain Python. It is compiled once, on its first call with arguments of its types, and kept on
disk beside its module, or in the user's cache folder, or not at all where neither can be written (`numeric.kept_code`).
Arithmetic keeps to IEEE 754, so the same machine gives the same bits each time.

Kept code is left when the file of its function changes or any of this room, but not for another: hence a compiled
function names functions and constants of its own file and of this room only, and no constant of its file is made from
another's.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from auvdock.numeric.kept_code import KeptCode

__all__ = ["cache_folders", "compiled", "compiling", "external"]

_P = ParamSpec("_P")
_R = TypeVar("_R")
_numba: Any = import_module("numba")
_events: Any = import_module("numba.core.event")
_llvm: Any = import_module("llvmlite.binding")
_NullCache: Any = import_module("numba.core.caching").NullCache


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Compile a function with Numba; as in NumPy, x / 0 is `inf` or `nan`; indices are not checked."""
    made: Any = _numba.njit(error_model="numpy")(function)
    if isinstance(getattr(made, "_cache", None), _NullCache):  # not if the environment asks for plain Python
        with suppress(OSError):  # no file, as of code typed in
            made._cache = KeptCode(function, Path(function.__code__.co_filename))
    return made


def cache_folders(function: object) -> tuple[Path, ...]:
    """Where a compiled function is looked for and kept on disk, in this order; nowhere if it is not kept."""
    kept = getattr(function, "_cache", None)
    return kept.folders if isinstance(kept, KeptCode) else ()


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
