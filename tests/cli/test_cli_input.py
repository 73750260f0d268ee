"""Bad input: one line on standard error that names the field and the remedy, exit code 2, no traceback."""

import json
import os
import subprocess
import sys

import pytest

from auvdock.cli.main import main
from auvdock.envs import vehicle_world


def run(*words, **more):
    return subprocess.run(
        [sys.executable, "-m", "auvdock.cli", *words], capture_output=True, text=True, timeout=120, check=False, **more
    )


FOUR_BEACONS = """
[world.station]
array_count = 0
beacons = [{beacons}]
"""
BEACON = (
    '{{name = "L{n}", role = "array", position_m = [0.0, {n}.0, 0.0], axis = [1.0, 0.0, 0.0], '
    "wavelength_nm = 450.0, power_w = 10.0, efficiency = 0.3, beam_angle_deg = 45.0}}"
)


@pytest.mark.parametrize(
    ("words", "field", "remedy"),
    [
        (["--water", "champagne"], "water", "pool"),
        (["--current", "nan"], "current", "finite"),
        (["--attenuation", "-1"], "attenuation", "1/m"),
        (["--current-direction", "north"], "current-direction", "random"),
        (["--detector", "oracle"], "detector", "threshold"),
        (["--level", "9"], "level", "0"),
        (["--seed", "-1"], "seed", "0 or more"),
        (["--world.camera.width-px", "0"], "width_px", "16"),
        (["--record", "/nonexistent/folder/run.rrd"], "record", "folder"),
        (["--controller", "oracle"], "controller", "own"),
        (["--seed", "9" * 20], "seed", "64 bits"),
        (["--attenuation", "1e308"], "attenuation", "at most 100 1/m"),
        (["--turbidity", "0.1"], "turbidity_per_m", "0.151 1/m, Petzold's clear ocean, to 1.92 1/m"),
        (["--turbidity", "0.5", "--attenuation", "0.5"], "turbidity_per_m", "attenuation_per_m"),
        (["--turbidity", "0.5", "--water", "pool"], "turbidity", "--water"),
        (["--world.start.max-range-m", "1e20"], "world.start.max_range_m", "at most 11000 m"),
        (["--world.station.depth-m", "1e20"], "world.station.depth_m", "at most 11000 m"),
        (["--world.station.depth-m", "inf"], "world.station.depth_m", "finite"),
        (["--world.station.array-count", "9" * 20], "world.station.array_count", "64 bits"),
        (["--world.station.array-count", "65"], "world.station.array_count", "0 to 64"),
        (["--config", "/nonexistent.toml"], "file", "readable"),
    ],
)
def test_bad_flags(words, field, remedy, capsys, monkeypatch):
    def compile_loops(*anything):
        pytest.fail("a simulator is made, for which a minute is compiled, before the input is refused")

    monkeypatch.setattr(vehicle_world, "Simulator", compile_loops)
    code = main(["dock", "conical", "--fidelity", "beacons", *words])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert field in captured.err
    assert remedy in captured.err


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("speed = = 1", "file"),
        ("[world]\nwaetr = 'pool'", "water"),
        (FOUR_BEACONS.format(beacons=", ".join(BEACON.format(n=n) for n in range(3))), "beacons"),
        ("[world.camera]\nwidth_px = 0", "width_px"),
        ("[world]\ncontrol_hz = 7.0", "control_hz"),
    ],
)
def test_bad_files(text, field, tmp_path, capsys):
    path = tmp_path / "episode.toml"
    path.write_text(text, encoding="utf-8")
    assert main(["dock", "conical", "--fidelity", "beacons", "--config", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert field in captured.err


def test_unknown_command_lists_the_known_ones(capsys):
    assert main(["undock"]) == 2
    assert "dock conical" in capsys.readouterr().err


def test_no_traceback_and_exit_code_in_a_process_of_its_own():
    done = run("dock", "conical", "--fidelity", "beacons", "--water", "champagne")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


def test_flag_of_the_wrong_type_exits_with_2():
    done = run("dock", "conical", "--seed", "many")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_missing_open_gl_names_the_package_and_the_way_round():
    done = run(
        "dock", "conical", "--fidelity", "pixels", env={**os.environ, "MUJOCO_GL": "osmesa", "PYOPENGL_PLATFORM": "egl"}
    )
    assert done.returncode == 2
    assert "--fidelity beacons" in done.stderr
    assert "Traceback" not in done.stderr


def test_help_names_the_common_flags():
    done = run("dock", "conical", "--help")
    assert done.returncode == 0
    for flag in ("--seed", "--fidelity", "--detector", "--water", "--attenuation", "--current", "--level", "--record"):
        assert flag in done.stdout


def test_doctor_prints_one_json_object():
    done = run("doctor", "--json")
    checks = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
    assert checks["mujoco"]["ok"]
    assert done.returncode == 0
