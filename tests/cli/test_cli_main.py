"""What every command does: tell that it compiles, unless nothing but JSON was asked for, and of what it left aside."""

import hashlib
import os
import subprocess
import sys
import warnings
from types import ModuleType

import pytest

from auvdock.cli import doctor
from auvdock.cli.main import COMMANDS, main
from auvdock.numeric.compiled import compiled
from auvdock.numeric.kept_code import FolderState, KeptCodeWarning
from auvdock.optics import gl_driver


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


def test_what_was_left_aside_is_said_once_on_one_line(monkeypatch, capsys):
    def run(argv, prog):
        for folder in ("one", "other"):
            warnings.warn(f"compiled code in {folder} is damaged", KeptCodeWarning, stacklevel=1)
        return 0

    module = ModuleType("warns")
    monkeypatch.setattr(module, "run", run, raising=False)
    monkeypatch.setitem(sys.modules, "warns", module)
    monkeypatch.setitem(COMMANDS, ("warn",), ("warns:run", "warn of something"))
    assert main(["warn"]) == 0
    assert capsys.readouterr().err == "auvdock: compiled code in one is damaged\n"


BUILDS = """
import sys
from auvdock.cli.main import COMMANDS, main

def run(argv, prog):
    import auvdock.cli.dock
    from auvdock.core.station import load_conical_station
    from auvdock.core.vehicle import load_vehicle
    from auvdock.sim.docks import make_dock
    from auvdock.sim.scene import build_model

    vehicle = load_vehicle("remus_hybrid")
    print(build_model(vehicle, make_dock(load_conical_station(), vehicle), 0.01).opt.timestep)
    return 1

COMMANDS["build",] = "__main__:run", "the physics of a docking, whose own loops take a minute to compile"
sys.exit(main(["build"]))
"""


def test_an_unusable_mujoco_gl_is_said_and_stops_nothing_that_needs_no_images():
    done = subprocess.run(
        [sys.executable, "-c", BUILDS],
        capture_output=True, text=True, timeout=120, check=False, env={**os.environ, "MUJOCO_GL": "bogus"},
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stdout == "0.01\n"
    assert len(done.stderr.splitlines()) == 1
    assert "MUJOCO_GL: 'bogus' cannot be used" in done.stderr
    assert "libegl1" in done.stderr


def test_doctor_tells_of_an_unusable_mujoco_gl(monkeypatch):
    monkeypatch.setattr(gl_driver, "GL_REFUSAL", "MUJOCO_GL: 'bogus' cannot be used")
    (check,) = [check for check in doctor.examine() if "OpenGL" in check.name]
    assert not check.ok
    assert "bogus" in check.remedy


def test_doctor_tells_the_truth_of_kept_code(tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "cache_folders", lambda value: (tmp_path,) if value is doctor.examine else ())
    check = doctor.compiled_loops()
    assert check.ok
    assert "none kept yet" in check.detail
    body = bytes(64)
    whole = tmp_path / f"module.function.{sys.implementation.cache_tag}-0123.nbc"
    whole.write_bytes(hashlib.sha256(body).digest() + body)
    assert doctor.compiled_loops().detail == f"1 kept under {tmp_path}"
    whole.with_stem(f"{whole.stem}4").write_bytes(b"")
    check = doctor.compiled_loops()
    assert not check.ok
    assert f"1 damaged in {tmp_path}" in check.detail
    (tmp_path / "file").touch()  # no folder can be made there, by nobody
    monkeypatch.setattr(doctor, "cache_folders", lambda value: (tmp_path / "file",) if value is doctor.examine else ())
    check = doctor.compiled_loops()
    assert not check.ok
    assert "nothing more can be kept" in check.detail
    assert "NUMBA_CACHE_DIR" in check.remedy


def test_doctor_takes_full_folders_that_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "cache_folders", lambda value: (tmp_path,) if value is doctor.examine else ())
    for state, ok in ((FolderState(5, 0, "Read-only file system"), True), (FolderState(0, 0, "No space"), False)):
        monkeypatch.setattr(doctor, "examine_folder", lambda folder, state=state: state)
        check = doctor.compiled_loops()
        assert check.ok is ok
        assert state.unwritable is not None
        assert state.unwritable in check.detail
