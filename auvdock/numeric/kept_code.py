"""Compiled code kept on disk, in place of Numba's own cache.

Numba's cache takes a file that is damaged, a disk that is full or a folder that cannot be written for an error of the
function that is called, and looks beside a module only if it may write there. Here code that cannot be read or written
is left aside with a warning, and the function is compiled.

There is one file for each function, types of its arguments and kind of processor:

    SHA-256 of all that follows (32 bytes) | stamp (32 bytes) | Numba's pickled result

The stamp changes with the module's file, with any file of this room, from which all compiled functions may take
functions and constants, with the function's byte code, with Numba and with this format. A file takes its place as a
whole, so that processes can write it at the same time.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import tempfile
import uuid
import warnings
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from auvdock.numeric.warning import AuvdockWarning

__all__ = ["ROOM", "FolderState", "KeptCode", "KeptCodeWarning", "examine_folder", "hash_of", "is_whole", "said"]

_caching: Any = import_module("numba.core.caching")
_config: Any = import_module("numba.core.config")
_numba: Any = import_module("numba")
_result: Any = import_module("numba.core.compiler").CompileResult
_dumps: Callable[[object], bytes] = import_module("numba.core.serialize").dumps
_user_dirs: Any = import_module("numba.misc.appdirs").AppDirs

_FORMAT = b"auvdock 2"
ROOM = Path(__file__).resolve().parent
"""The shared room."""
_HASH_BYTES = 32
_SUFFIX = ".nbc"
_TAG = sys.implementation.cache_tag


class KeptCodeWarning(AuvdockWarning):
    """Compiled code could not be read from disk or written there."""


class KeptCode(_caching._Cache):
    """Where the compiled code of one function is kept; put in the place of Numba's cache of that function."""

    def __init__(self, function: Callable[..., object], source: Path) -> None:
        """Note the function and what its file holds now.

        Args:
            function: the plain Python function.
            source: the file in which it stands.

        Raises:
            OSError: that file or one of this room cannot be read.
        """
        self._function = function
        self._source = source
        self._enabled = True
        parts = (_FORMAT, _numba.__version__.encode(), source.read_bytes(), function.__code__.co_code, hash_of(ROOM))
        self._stamp = _hash(parts)

    @property
    def cache_path(self) -> str:
        """The first folder in which code is looked for."""
        return str(self.folders[0])

    @property
    def folders(self) -> tuple[Path, ...]:
        """Where code is looked for and kept, in this order."""
        return _folders(self._source)

    def load_overload(self, sig: object, target_context: Any) -> Any:  # noqa: ANN401
        """The compiled code for such arguments; None if there is none that can be used."""
        target_context.refresh()
        if not self._enabled:
            return None
        name = self._name(sig, target_context.codegen())
        for folder in self.folders:
            try:
                content = (folder / name).read_bytes()
            except FileNotFoundError:
                continue
            except OSError as error:
                _leave_aside(folder, f"cannot be read ({error.strerror or error})")
                continue
            if not is_whole(content):
                _leave_aside(folder, "is damaged")
            elif content[_HASH_BYTES : 2 * _HASH_BYTES] == self._stamp:
                try:
                    return _result._rebuild(target_context, *pickle.loads(content[2 * _HASH_BYTES :]))
                except Exception as error:  # whole, but of another making: unpickling fails in any way
                    _leave_aside(folder, f"cannot be used ({type(error).__name__}: {error})")
        return None

    def save_overload(self, sig: object, data: Any) -> None:  # noqa: ANN401
        """Keep compiled code in the first folder that takes it."""
        # What Numba itself does not keep either: lifted loops, addresses that hold in this process only.
        if not self._enabled or data.library.has_dynamic_globals or any(not part.can_cache for part in data.lifted):
            return
        body = self._stamp + _dumps(data._reduce())
        content = hashlib.sha256(body).digest() + body
        name = self._name(sig, data.codegen)
        failures: list[str] = []
        for folder in self.folders:
            try:
                _write(folder / name, content)
            except OSError as error:
                failures.append(f"{folder}: {error.strerror or error}")
            else:
                break
        else:
            text = (
                f"compiled code cannot be kept ({'; '.join(failures)}); every process compiles its inner loops anew: "
                "make room or set NUMBA_CACHE_DIR"
            )
            _say("written", text)

    def enable(self) -> None:
        """Read and write from now on."""
        self._enabled = True

    def disable(self) -> None:
        """Neither read nor write from now on."""
        self._enabled = False

    def flush(self) -> None:
        """Forget what is kept of this function."""
        for folder in self.folders:
            for path in folder.glob(f"{self._base()}-*{_SUFFIX}"):
                with suppress(OSError):
                    path.unlink()

    def _base(self) -> str:
        name = self._function.__qualname__.replace("<", "").replace(">", "")
        return f"{self._source.stem}.{name}.{_TAG}"

    def _name(self, sig: object, codegen: Any) -> str:  # noqa: ANN401
        cells = tuple(cell.cell_contents for cell in self._function.__closure__ or ())
        key = repr((str(sig), _fields(sig), codegen.magic_tuple(), _dumps(cells) if cells else b""))
        return f"{self._base()}-{hashlib.sha256(key.encode()).hexdigest()[:16]}{_SUFFIX}"


def _fields(kinds: Any) -> list[object]:  # noqa: ANN401
    """Fields of the named tuples among types of arguments: the types' own names tell only how many there are."""
    return [(tuple(getattr(kind, "fields", ())), _fields(kind.types)) for kind in kinds if hasattr(kind, "types")]


@lru_cache(maxsize=1)
def hash_of(room: Path) -> bytes:
    """Hash of a folder's Python files, their names included; read once, as a process loads them once."""
    parts: list[bytes] = []
    for path in sorted(room.glob("*.py")):
        parts += [path.name.encode(), path.read_bytes()]
    return _hash(parts)


def _hash(parts: Iterable[bytes]) -> bytes:
    """Hash that tells where one part ends and the next begins."""
    return hashlib.sha256(b"".join(hashlib.sha256(part).digest() for part in parts)).digest()


def _folders(source: Path) -> tuple[Path, ...]:
    """NUMBA_CACHE_DIR alone if it can be written; else that too, beside the module, the user's folder of caches."""
    parent = source.resolve().parent
    # As Numba names them: short, and told apart by the hash of the whole path.
    own = f"{parent.name}_{hashlib.sha1(str(parent).encode()).hexdigest()}"
    found = (parent / "__pycache__", Path(_user_dirs(appname="numba", appauthor=False).user_cache_dir) / own)
    if not _config.CACHE_DIR:
        return found
    asked = Path(_config.CACHE_DIR) / own
    return (asked,) if _unwritable(asked) is None else (asked, *found)


@dataclass(frozen=True)
class FolderState:
    """What `examine_folder` found.

    Attributes:
        whole: files that can be used.
        damaged: files that cannot be read or are damaged.
        unwritable: why nothing can be written there; None if it can.
    """

    whole: int
    damaged: int
    unwritable: str | None


def examine_folder(folder: Path) -> FolderState:
    """Read every file of kept code in a folder, and write one of the size of a large one."""
    whole = damaged = 0
    for path in folder.glob(f"*.{_TAG}-*{_SUFFIX}"):
        try:
            good = is_whole(path.read_bytes())
        except OSError:
            good = False
        whole, damaged = whole + good, damaged + (not good)
    return FolderState(whole, damaged, _unwritable(folder, 1 << 20))


def is_whole(content: bytes) -> bool:
    """Whether a file's content is as it was written."""
    body = content[_HASH_BYTES:]
    return len(body) > _HASH_BYTES and hashlib.sha256(body).digest() == content[:_HASH_BYTES]


def _unwritable(folder: Path, size_bytes: int = 0) -> str | None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(size_bytes))
    except OSError as error:
        return error.strerror or str(error)
    return None


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.tmp.{uuid.uuid4().hex[:16]}")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    except OSError:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def _leave_aside(folder: Path, why: str) -> None:
    _say("read", f"compiled code in {folder} {why}; it is left aside, inner loops are compiled anew")


said: set[str] = set()
"""What this process has warned of: all its functions share their folders, and compiling resets Python's own memory."""


def _say(kind: str, text: str) -> None:
    if kind not in said:
        said.add(kind)
        warnings.warn(text, KeptCodeWarning, stacklevel=3)
