"""Every package is listed, every link resolves, and no room imports one that comes after it."""

import ast
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ORDER = (
    "numeric",
    "core",
    "assets",
    "sim",
    "optics",
    "perception",
    "networks",
    "estimation",
    "planning",
    "controllers",
    "metrics",
    "envs",
    "episode",
    "footage",
    "campaign",
    "dataset",
    "recording",
    "experiments",
    "cli",
)
MAPPED = ("assets", "controllers", "envs", "experiments")
EXCEPTIONS = {("assets", "core"), ("core", "assets")}  # presets and their errors know each other
BLIND = {room: {"sim", "optics"} for room in ("perception", "networks", "estimation", "controllers")}


def folder(room):
    return ROOT / room if room in MAPPED else ROOT / "auvdock" / room


def packages():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]


def test_every_package_is_listed_and_mapped():
    listed = set(packages()["packages"])
    found = {"auvdock"}
    for room in ORDER:
        for init in folder(room).rglob("__init__.py"):
            found.add(".".join(("auvdock", room, *init.parent.relative_to(folder(room)).parts)))
    assert listed == found
    assert packages()["package-dir"] == {f"auvdock.{name}": name for name in MAPPED}


@pytest.mark.parametrize("name", MAPPED)
def test_links_resolve(name):
    link = ROOT / "auvdock" / name
    assert link.is_symlink()
    assert not Path(link.readlink()).is_absolute()
    assert link.resolve() == ROOT / name


def imported_rooms(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            parts = name.split(".")
            if parts[0] == "auvdock" and len(parts) > 1:
                yield parts[1]


@pytest.mark.parametrize("room", ORDER)
def test_rooms_import_only_what_stands_before_them(room):
    allowed = set(ORDER[: ORDER.index(room) + 1]) - BLIND.get(room, set())
    for path in folder(room).rglob("*.py"):
        for other in imported_rooms(path):
            assert other in allowed or (room, other) in EXCEPTIONS, f"{path.name} imports auvdock.{other}"


def test_no_python_file_is_longer_than_400_lines():
    for path in [*ROOT.glob("auvdock/**/*.py"), *ROOT.glob("tests/**/*.py")]:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 400, path


def test_constraints_are_names_and_versions_only():
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            name, _, version = line.partition("==")
            assert name
            assert version
            assert "/" not in line
            assert "@" not in line
