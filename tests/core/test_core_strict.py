"""Strict configuration: nothing unknown, nothing of the wrong type, nothing non-finite gets in."""

import pickle
from dataclasses import dataclass
from pathlib import Path

import pytest

from auvdock.assets import asset, asset_names
from auvdock.core.errors import ConfigError, located
from auvdock.core.strict import from_mapping, load_toml, merge, read_toml, to_plain


@dataclass(frozen=True)
class Inner:
    speed_m_s: float = 1.0
    name: str = "a"


@dataclass(frozen=True)
class Outer:
    inner: Inner = Inner()
    items: tuple[Inner, ...] = ()
    limit: float | None = None
    count: int = 1


def test_whole_numbers_become_floats_and_lists_become_tuples():
    outer = from_mapping(Outer, {"inner": {"speed_m_s": 2}, "items": [{"name": "b"}], "limit": 3})
    assert outer == Outer(Inner(2.0), (Inner(1.0, "b"),), 3.0)
    assert isinstance(outer.inner.speed_m_s, float)


@pytest.mark.parametrize(
    ("data", "field"),
    [
        ({"inner": {"speed": 1.0}}, "inner.speed"),
        ({"items": [{"nmae": "b"}]}, r"items\[0\].nmae"),
        ({"cuont": 1}, "cuont"),
        ({"inner": {"speed_m_s": "fast"}}, "inner.speed_m_s"),
        ({"inner": {"speed_m_s": float("nan")}}, "inner.speed_m_s"),
        ({"inner": {"speed_m_s": float("inf")}}, "inner.speed_m_s"),
        ({"count": True}, "count"),
        ({"count": 1.5}, "count"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(data, field):
    with pytest.raises(ConfigError, match=field):
        from_mapping(Outer, data)
    with pytest.raises(ConfigError, match=field):
        merge(Outer(), data)


def test_unknown_key_names_the_nearest_known_one():
    with pytest.raises(ConfigError, match="count"):
        from_mapping(Outer, {"cuont": 1})


def test_merge_changes_only_what_it_is_told():
    base = Outer(Inner(2.0, "x"), (Inner(),), 4.0, 7)
    merged = merge(base, {"inner": {"name": "y"}})
    assert merged == Outer(Inner(2.0, "y"), (Inner(),), 4.0, 7)
    assert merge(base, to_plain(base)) == base


def test_corrupt_and_missing_files_are_named(tmp_path):
    corrupt = tmp_path / "corrupt.toml"
    corrupt.write_text("speed = = 1", encoding="utf-8")
    for path in (corrupt, tmp_path / "missing.toml"):
        with pytest.raises(ConfigError, match=path.name):
            read_toml(path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="binary"):
        load_toml(Outer, binary)


def test_unknown_preset_lists_those_that_exist():
    with pytest.raises(ConfigError, match="remus_hybrid"):
        asset("vehicles", "remus_hybird")
    assert "conical" in asset_names("stations")


def test_errors_survive_pickling():
    error = ConfigError("field", 3, "a number")
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error)
    assert copy.field == "field"


def test_an_error_is_located_once_however_deep_it_was_raised():
    for field in ("lateral_m", "start.lateral_m", "world.start.lateral_m"):
        with pytest.raises(ConfigError) as caught, located("world."), located("" if "." in field else "start."):
            raise ConfigError(field, -1.0, "0 or more")
        assert caught.value.field == "world.start.lateral_m"
        assert str(caught.value).startswith("world.start.lateral_m: -1.0")


def test_numbers_too_long_to_write_and_lists_too_deep_to_read_are_refused(tmp_path):
    for text in ("count = " + "9" * 5000, "count = 0x" + "f" * 5000, "items = " + "[" * 5000 + "]" * 5000):
        (tmp_path / "long.toml").write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError):
            load_toml(Outer, tmp_path / "long.toml")


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["none", "byte-order mark"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["unix", "windows"])
def test_a_file_of_any_editor_is_read(mark, end, tmp_path):
    path = tmp_path / "some.toml"
    path.write_bytes(mark + end.join([b"[world]", "water = 'See \u2713'".encode(), b""]))
    assert read_toml(path) == {"world": {"water": "See \u2713"}}


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("a = 1".encode("utf-16"), "UTF-8"),
        (b"\xef\xbb\xbf\xef\xbb\xbfa = 1", "valid TOML"),
        (b"a = " + b"[" * 20000 + b"]" * 20000, "valid TOML"),
    ],
)
def test_a_file_that_cannot_be_read_says_why(content, why, tmp_path):
    path = tmp_path / "some.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=why):
        read_toml(path)


def test_a_name_that_no_file_can_have():
    with pytest.raises(ConfigError, match="readable"):
        read_toml(Path("a\0b.toml"))
