"""Kept code: whatever is wrong with it on disk, the function gives the right value and the user hears of it."""

import collections
import errno
import hashlib
import importlib.util
import os
import shutil
import sys
import warnings
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core import config

from auvdock.numeric import kept_code
from auvdock.numeric.compiled import cache_folders, compiling
from auvdock.numeric.kept_code import KeptCodeWarning, examine_folder

SOURCE = """
from auvdock.numeric.compiled import compiled
FACTOR = {factor}

@compiled
def raised(x):
    return FACTOR * x
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder for modules, and where their code is kept: beside them, else in the user's folder of caches."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # Python's own takes a file changed within a second for old
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.setenv("HOME", str(tmp_path / "user"))
    return tmp_path


def loaded(folder, text):
    """A module of such a text as another process would load it."""
    source = folder / "tiny.py"
    source.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("tiny", source)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def called(folder, factor=2.5, x=4.0):
    """The module as another process would load it: its value, whether it was compiled, and what was warned of."""
    module = loaded(folder, SOURCE.format(factor=factor))
    new = []
    kept_code.said.clear()
    with warnings.catch_warnings(record=True) as told, compiling(lambda: new.append(True)):
        warnings.simplefilter("always")
        value = module.raised(x)
    assert value == factor * x
    assert all(warning.category is KeptCodeWarning for warning in told)
    return module.raised, bool(new), [str(warning.message) for warning in told]


def kept_file(folder):
    (path,) = (folder / "__pycache__").glob("tiny.raised.*.nbc")
    return path


def test_code_is_kept_beside_its_module_and_read_again(place):
    function, new, told = called(place)
    assert (new, told) == (True, [])
    assert cache_folders(function)[0] == place / "__pycache__"
    assert called(place)[1:] == (False, [])
    assert called(place, x=3)[1] is True  # integers are other code
    assert called(place)[1] is called(place, x=3)[1] is False
    function.recompile()  # forgets what is kept
    assert called(place, x=3)[1] is True


def test_code_of_another_source_is_left_without_a_word(place):
    called(place, factor=2.5)
    # Only a constant of the file differs: the byte code is the same.
    assert called(place, factor=3.5)[1:] == (True, [])


def test_code_follows_the_order_of_a_named_tuples_fields(place, monkeypatch):
    text = "from auvdock.numeric.compiled import compiled\n@compiled\ndef first(pairs):\n    return pairs[1].first\n"
    pairs = ModuleType("pairs")
    monkeypatch.setitem(sys.modules, "pairs", pairs)
    for fields, value in ((("first", "second"), 2.0), (("second", "first"), 3.0), (("first", "second"), 2.0)):
        pair = collections.namedtuple("Pair", fields, module="pairs")  # pyright: ignore[reportUntypedNamedTuple]
        monkeypatch.setattr(pairs, "Pair", pair, raising=False)
        assert loaded(place, text).first((0.0, pair(2.0, 3.0))) == value


@pytest.fixture
def room(place, monkeypatch):
    """A copy of the shared room whose files count in the place of the installed ones."""
    copy = place / "numeric"
    shutil.copytree(kept_code.ROOM, copy, ignore=shutil.ignore_patterns("__pycache__"))
    assert len(list(copy.glob("*.py"))) > 5
    monkeypatch.setattr(kept_code, "ROOM", copy)
    yield copy
    kept_code.hash_of.cache_clear()


def change_one_number(room):
    file = room / "constants.py"
    text = file.read_text(encoding="utf-8")
    assert "SATURATED_CODE = 250" in text
    file.write_text(text.replace("SATURATED_CODE = 250", "SATURATED_CODE = 251"), encoding="utf-8")


@pytest.mark.parametrize(
    "change",
    [
        change_one_number,
        lambda room: (room / "another.py").touch(),
        lambda room: (room / "scalars.py").unlink(),
        lambda room: (room / "scalars.py").rename(room / "numbers.py"),
    ],
    ids=["a number", "a new file", "a file less", "another name"],
)
def test_code_is_left_when_the_shared_room_changes(place, room, change):
    called(place)
    kept_code.hash_of.cache_clear()  # another process reads the room anew
    assert called(place)[1:] == (False, [])
    change(room)
    kept_code.hash_of.cache_clear()
    assert called(place)[1:] == (True, [])
    assert called(place)[1:] == (False, [])


SHARED = """
from auvdock.numeric.compiled import compiled
FACTOR = {factor}

@compiled
def doubled(x):
    return 2.0 * x
"""
USER = """
from auvdock.numeric.compiled import compiled
from shared_by_kernels import FACTOR, doubled

@compiled
def raised(x):
    return FACTOR * doubled(x)
"""


def test_what_a_kernel_took_from_the_shared_room_is_never_stale(place, monkeypatch):
    room = place / "room"
    room.mkdir()
    monkeypatch.setattr(kept_code, "ROOM", room)
    monkeypatch.syspath_prepend(room)
    values = []
    for shared in (SHARED, SHARED, SHARED.replace("{factor}", "7.0"), SHARED.replace("2.0 * x", "3.0 * x")):
        (room / "shared_by_kernels.py").write_text(shared.format(factor=5.0), encoding="utf-8")
        kept_code.hash_of.cache_clear()
        sys.modules.pop("shared_by_kernels", None)
        importlib.invalidate_caches()
        values.append(loaded(place, USER).raised(1.0))
    kept_code.hash_of.cache_clear()
    assert values == [10.0, 10.0, 14.0, 15.0]
    assert len(list((place / "__pycache__").glob("tiny.raised.*.nbc"))) == 1  # of the same name all along


def replace_by_folder(path):
    path.unlink()
    path.mkdir()
    (path / "something").touch()


@pytest.mark.parametrize(
    ("damage", "is_mended"),
    [
        (lambda path: path.write_bytes(b""), True),
        (lambda path: path.write_bytes(path.read_bytes()[:-1]), True),
        (lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]), True),
        (lambda path: path.write_bytes(bytes(path.stat().st_size)), True),
        (lambda path: path.write_bytes(os.urandom(500)), True),
        (replace_by_folder, False),
    ],
    ids=["empty", "cut by a byte", "cut in half", "zeros", "garbage", "unreadable"],
)
def test_what_cannot_be_read_is_left_aside_once_and_written_anew(place, damage, is_mended):
    called(place)
    damage(kept_file(place))
    _, new, told = called(place)
    assert new
    assert len(told) == 1
    assert str(place / "__pycache__") in told[0]
    if is_mended:
        assert called(place)[1:] == (False, [])
    else:  # it is kept in the next folder, and read there
        assert called(place)[1] is False


def test_it_is_said_once_for_all_functions(place):
    called(place)
    called(place, x=3)
    for path in (place / "__pycache__").glob("tiny.raised.*.nbc"):
        path.write_bytes(b"")
    function, _, told = called(place)
    with warnings.catch_warnings(record=True) as again:
        warnings.simplefilter("always")
        assert function(3) == 7.5
    assert (len(told), again) == (1, [])


def test_whole_code_of_another_making_is_left_aside(place):
    called(place)
    body = kept_file(place).read_bytes()[32:64] + b"no pickle"
    kept_file(place).write_bytes(hashlib.sha256(body).digest() + body)
    _, new, told = called(place)
    assert new
    assert "cannot be used" in told[0]


@settings(max_examples=200, deadline=None)
@given(
    body=st.binary(min_size=33, max_size=200), where=st.integers(0, 231), flip=st.integers(1, 255), cut=st.integers()
)
def test_any_changed_byte_and_any_cut_is_noticed(body, where, flip, cut):
    content = hashlib.sha256(body).digest() + body
    assert kept_code.is_whole(content)
    where %= len(content)
    assert not kept_code.is_whole(content[:where] + bytes([content[where] ^ flip]) + content[where + 1 :])
    assert not kept_code.is_whole(content[: cut % len(content)])


def refusing(number, folder):
    """What the file system does to whoever writes below a folder, if the folder is read-only or its disk is full."""
    plain = Path.write_bytes

    def write(path, content):
        if path.is_relative_to(folder):
            plain(path, content[: len(content) // 2])
            raise OSError(number, os.strerror(number), str(path))
        return plain(path, content)

    return write


def test_valid_code_beside_a_read_only_installation_is_used(place, monkeypatch):
    called(place)
    monkeypatch.setattr(Path, "write_bytes", refusing(errno.EROFS, place))
    assert called(place)[1:] == (False, [])


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.ENOSPC])
def test_what_cannot_be_kept_beside_the_module_goes_to_the_user_s_folder(place, monkeypatch, number):
    monkeypatch.setattr(Path, "write_bytes", refusing(number, place / "__pycache__"))
    assert called(place)[1:] == (True, [])
    assert not list((place / "__pycache__").glob("*.nbc*"))
    assert called(place)[1:] == (False, [])


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.ENOSPC])
def test_what_cannot_be_kept_anywhere_is_compiled_and_said(place, monkeypatch, number):
    monkeypatch.setattr(Path, "write_bytes", refusing(number, place))
    for _ in range(2):
        _, new, told = called(place)
        assert new
        assert len(told) == 1
        assert os.strerror(number) in told[0]
    assert not list(place.rglob("*.nbc*"))  # no half of one either


def test_the_folder_that_was_asked_for_comes_first_unless_it_cannot_be_used(place, monkeypatch):
    called(place)
    monkeypatch.setattr(config, "CACHE_DIR", str(place / "asked"))
    assert called(place)[1:] == (True, [])
    assert list((place / "asked").rglob("*.nbc"))
    (place / "file").touch()
    monkeypatch.setattr(config, "CACHE_DIR", str(place / "file"))
    assert called(place)[1] is False


def test_a_folder_is_examined_by_reading_and_writing_it(place):
    called(place)
    called(place, x=3)
    folder = place / "__pycache__"
    assert examine_folder(folder) == kept_code.FolderState(whole=2, damaged=0, unwritable=None)
    next(folder.glob("*.nbc")).write_bytes(b"")
    assert examine_folder(folder) == kept_code.FolderState(whole=1, damaged=1, unwritable=None)
    (place / "file").touch()
    assert examine_folder(place / "file").unwritable == os.strerror(errno.EEXIST)
