"""`auvdock reproduce halo`: one case, a small check with its picture, and what it refuses."""

import json
import math

import numpy as np
import pytest

from auvdock.cli.main import main
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.single import SingleScattering
from auvdock.optics.photons.table import load_halo

ANGLES = ["0.2", "0.5", "1", "2", "5", "10", "20", "40"]


def run_json(capsys, *words):
    code = main(["reproduce", "halo", *words, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_one_case_is_core_and_halo(capsys):
    code, found = run_json(capsys, "--water", "pool", "--range", "20")
    assert code == 0
    assert list(found["within"]) == ANGLES
    within = np.array([found["within"][angle] for angle in ANGLES])
    halo = np.array([found["halo_within"][angle] for angle in ANGLES])
    assert found["core"] == pytest.approx(math.exp(-0.4 * 20.0))
    assert within - halo == pytest.approx(found["core"])
    read = load_halo("fournier-forand-0.018").within(7.0, 0.05 / 0.35, np.radians([float(angle) for angle in ANGLES]))
    assert halo == pytest.approx(math.exp(-1.0) * read)
    assert found["wavelength_nm"] == 450.0
    assert found["comparison"]["model"] == "Wells 1973"


def test_attenuation_moves_scattering_alone(capsys):
    _, found = run_json(capsys, "--water", "lake", "--range", "2", "--attenuation", "1.2")
    assert found["absorption_per_m"] == pytest.approx(0.25)
    assert found["scattering_per_m"] == pytest.approx(0.95)


def test_a_turbid_water_and_a_station_have_their_own_phase_functions(capsys):
    # Petzold (1972): c of his harbour at 530 nm is 1.92 1/m, b is 1.583.
    words = ("--range", "2", "--wavelength-nm", "530")
    _, harbour = run_json(capsys, "--water", "petzold_harbour", *words)
    _, turbid = run_json(capsys, "--turbidity", "1.92", *words)
    assert harbour["phase_function"] == turbid["phase_function"] == "petzold-harbour"
    assert harbour["scattering_per_m"] == pytest.approx(1.583, abs=5e-4)
    assert harbour["core"] == pytest.approx(math.exp(-2 * 1.92))
    assert turbid["within"] == harbour["within"]
    _, between = run_json(capsys, "--turbidity", "1", *words)
    assert between["core"] == pytest.approx(math.exp(-2.0))
    assert all(share in between["phase_function"] for share in ("*petzold-coastal", "*petzold-harbour"))


def test_thin_water_is_single_scattering(capsys):
    _, found = run_json(capsys, "--water", "clear", "--range", "0.2", "--wavelength-nm", "530")
    once = SingleScattering(load_phase("fournier-forand-0.018"))
    expected = once.within(0.072 * 0.2, 0.06 / 0.072, np.radians([10.0])) * math.exp(-0.06 * 0.2)
    assert found["halo_within"]["10"] == pytest.approx(float(expected[0]), rel=0.03)


def test_a_small_check_says_what_it_could_judge(capsys, tmp_path):
    code, found = run_json(
        capsys,
        *("--phases", "fournier-forand-0.018", "--photons", "10000", "--seed", "4", "--out", str(tmp_path)),
        *("--beam-deg", "10,60", "--off-axis-deg", "0,10,20"),
    )
    (row,) = found["phases"]
    assert 0 < row["judged"] < row["readings"]
    assert row["rms_deviation"] < 0.05
    narrow, wide = row["beams"]
    assert (narrow["beam_deg"], wide["beam_deg"]) == (10.0, 60.0)
    assert narrow["readings"] == 9 * 5 * 3
    for beam in (narrow, wide):
        assert beam["judged"] > 60
        assert beam["rms_deviation"] < 0.04
        pool = [found for found in beam["wells_over_photons"] if found["scattering_angle_rad"] == 0.02]
        assert [found["off_axis_deg"] for found in pool] == [0.0, 10.0, 20.0]
        assert all(found["least"] < found["most"] for found in pool)
    good = all(verdict["greatest_deviation"] <= 0.1 for verdict in (row, narrow, wide))
    assert code == (0 if good else 1)
    for picture in ("halo.png", "beam.png"):
        assert (tmp_path / picture).stat().st_size > 20_000


def test_a_beam_in_one_case(capsys):
    words = [
        "--water",
        "clear",
        "--range",
        "0.5",
        "--beam-deg",
        "60",
        "--off-axis-deg",
        "0",
        "30",
        "--photons",
        "40000",
    ]
    _, found = run_json(capsys, *words)
    (beam,) = found["beams"]
    on, off = beam["off_axis"]
    assert (on["off_axis_deg"], off["off_axis_deg"]) == (0.0, 30.0)
    # At half the beam's angle half the light, little as it is scattered.
    assert off["core"] == pytest.approx(0.5 * on["core"])
    assert on["core"] == pytest.approx(found["core"])
    assert list(on["within"]) == ANGLES
    for row in (on, off):
        for angle in ANGLES:
            assert row["within"][angle] - row["halo_within"][angle] == pytest.approx(row["core"])
        off_by = abs(row["scattered"] / row["scattered_by_table"] - 1.0)
        assert off_by < 5.0 * row["scattered_standard_error"] + 0.01
        assert row["scattered_in_front"] < row["scattered"]
    # An isotropic lamp is no darker; what a fixed lamp is given is that times its profile.
    assert on["halo_within"]["40"] < found["halo_within"]["40"]
    for row, profile in ((on, 1.0), (off, 0.5)):
        given = [row["isotropic_halo_times_profile"][angle] for angle in ANGLES]
        assert given == pytest.approx([profile * found["halo_within"][angle] for angle in ANGLES])


@pytest.mark.parametrize(
    "words",
    [
        ["--water", "pool"],
        ["--water", "none", "--range", "5"],
        ["--water", "pool", "--range", "-1"],
        ["--water", "pool", "--range", "nan"],
        ["--water", "pool", "--range", "500"],
        ["--water", "pool", "--range", "5", "--attenuation", "0.01"],
        ["--water", "pool", "--range", "5", "--attenuation", "0.05"],
        ["--water", "pool", "--range", "5", "--wavelength-nm", "5"],
        ["--water", "pool", "--range", "5", "--turbidity", "1"],
        ["--turbidity", "0.1", "--range", "5"],
        ["--turbidity", "1", "--attenuation", "1", "--range", "5"],
        ["--range", "5"],
        ["--photons", "3"],
        ["--seed", "-1"],
        ["--beam-deg", "2"],
        ["--beam-deg", "10,x"],
        ["--beam-deg", "10", "--off-axis-deg", "-5"],
        ["--phases", "henyey"],
        ["--phases", "fournier-forand-0.03"],
    ],
)
def test_what_cannot_be_used_is_one_line(words, capsys):
    assert main(["reproduce", "halo", *words]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert len(printed.err.splitlines()) == 1
