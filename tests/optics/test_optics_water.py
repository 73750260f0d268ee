import math

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.core.strict import load_toml, merge
from auvdock.optics.photons.table import halo_names, photon_halo_of
from auvdock.optics.water import WaterCfg, load_water, water_names, with_attenuation

MIXED = "0.25*petzold-clear+0.75*petzold-coastal"
JERLOV_NM = np.array([450.0, 525.0, 550.0, 600.0, 625.0])
# Jerlov (1976), Marine Optics, table XXVII: K_d in 1/m at the wavelengths above.
JERLOV_KD = {
    "I": (0.019, 0.043, 0.063, 0.235, 0.305),
    "IA": (0.026, 0.048, 0.067, 0.24, 0.31),
    "IB": (0.036, 0.054, 0.072, 0.245, 0.315),
    "II": (0.068, 0.076, 0.089, 0.26, 0.335),
    "III": (0.135, 0.116, 0.12, 0.295, 0.375),
    "1C": (0.25, 0.13, 0.12, 0.3, 0.37),
    "3C": (0.39, 0.2, 0.19, 0.33, 0.4),
    "5C": (0.56, 0.31, 0.3, 0.4, 0.48),
    "7C": (0.89, 0.49, 0.46, 0.48, 0.54),
    "9C": (1.6, 0.78, 0.63, 0.6, 0.65),
}
# Pope & Fry (1997), pure water, at 450, 530 and 620 nm.
PURE_ABSORPTION = np.array([0.00922, 0.0434, 0.2755])


@pytest.mark.parametrize("name", water_names())
def test_presets_load_with_possible_coefficients(name):
    water = load_water(name)
    assert np.all(water.absorption >= 0.99 * PURE_ABSORPTION)
    assert np.all(water.scattering >= 0.0)
    assert water.source
    assert photon_halo_of(water).phase == water.phase


def test_all_waters_are_there():
    stations = {"petzold_clear", "petzold_coastal", "petzold_harbour"}
    assert set(water_names()) == {*JERLOV_KD, *stations, "clear", "pool", "lake"}


def test_named_attenuations():
    assert load_water("pool").attenuation[0] == pytest.approx(0.40)
    assert 0.10 <= load_water("clear").attenuation[0] <= 0.15


@pytest.mark.parametrize("c_450", [0.05, 0.1, 0.4, 2.0])
def test_attenuation_override_moves_scattering_only(c_450):
    water = load_water("pool")
    other = with_attenuation(water, c_450)
    assert other.attenuation[0] == pytest.approx(c_450)
    assert other.absorption_per_m == water.absorption_per_m
    ratio = other.scattering / water.scattering
    assert ratio == pytest.approx(np.full(3, ratio[0]))


def test_attenuation_of_a_water_without_scattering():
    clear = WaterCfg("distilled", "test", (0.02, 0.05, 0.28), (0.0, 0.0, 0.0))
    other = with_attenuation(clear, 0.1)
    assert other.attenuation[0] == pytest.approx(0.1)
    assert np.all(np.diff(other.scattering) < 0.0)


@pytest.mark.parametrize("c_450", [-1.0, math.nan, math.inf, 0.049])
def test_impossible_attenuation_is_refused(c_450):
    with pytest.raises(ConfigError) as caught:
        with_attenuation(load_water("pool"), c_450)
    assert caught.value.field == "attenuation_per_m"
    assert "0.05" in caught.value.remedy


@pytest.mark.parametrize("c_450", [101.0, 1e20, 1e308])
def test_no_water_is_darker_than_mud(c_450):
    with pytest.raises(ConfigError) as caught:
        with_attenuation(load_water("pool"), c_450)
    assert caught.value.field == "attenuation_per_m"
    with pytest.raises(ConfigError) as caught:
        WaterCfg("ink", "test", (0.02, c_450, 0.28), (0.0, 0.0, 0.0))
    assert caught.value.field == "absorption_per_m[1]"


def test_unknown_water_names_those_that_exist():
    with pytest.raises(ConfigError, match=r"9C.*petzold_harbour.*lake") as caught:
        load_water("soup")
    assert (caught.value.field, caught.value.value) == ("water", "soup")


def test_negative_coefficients_are_refused():
    with pytest.raises(ConfigError, match="absorption_per_m"):
        WaterCfg("x", "test", (-0.1, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", ["clear", "pool", "lake", "II", "9C"])
def test_without_a_measured_phase_function_it_is_petzolds_average(name):
    water = load_water(name)
    assert water.phase == "fournier-forand-0.018"
    # Mobley et al. (2002): Petzold's average particle has b_b / b = 0.0183.
    assert water.backscattering == pytest.approx(0.0183 * water.scattering, rel=5e-3)


def other(**changes):
    return merge(load_water("lake"), changes)


@pytest.mark.parametrize(("name", "ratio"), [("clear", 0.044), ("coastal", 0.013), ("harbour", 0.019)])
def test_backscattering_is_the_phase_functions_own(name, ratio):
    # Petzold (1972) prints the ratios.
    water = other(phase_function=f"petzold-{name}")
    assert water.backscattering / water.scattering == pytest.approx(np.full(3, ratio), abs=6e-4)
    assert other(phase_function=f"petzold-{name}", backscatter_ratio=ratio).phase == water.phase


def test_backscattering_of_a_mixture_is_that_of_its_parts():
    water = other(phase_function=MIXED)
    assert water.backscattering / water.scattering == pytest.approx(np.full(3, 0.25 * 0.044 + 0.75 * 0.013), abs=6e-4)


def test_a_phase_function_may_be_written_in_a_file(tmp_path):
    file = tmp_path / "bay.toml"
    file.write_text(
        'name = "bay"\nsource = "ours"\nabsorption_per_m = [0.2, 0.1, 0.3]\nscattering_per_m = [0.6, 0.5, 0.4]\n'
        f'phase_function = "{MIXED}"\n',
        encoding="utf-8",
    )
    assert load_water(str(file)) == load_toml(WaterCfg, file)
    assert photon_halo_of(load_water(str(file))).phase == MIXED


@pytest.mark.parametrize(
    "name",
    ["petzold", "fournier-forand-0.05", "0.5*petzold-clear", "0.5*petzold-clear+0.5*wells", "-1*wells+2*wells", ""],
)
def test_a_phase_function_without_a_table_is_refused(name):
    with pytest.raises(ConfigError) as caught:
        other(phase_function=name)
    assert (caught.value.field, caught.value.value) == ("phase_function", name)
    assert all(known in caught.value.remedy for known in (*halo_names(), "wells"))


def test_a_backscatter_ratio_without_a_table_is_refused():
    with pytest.raises(ConfigError) as caught:
        other(backscatter_ratio=0.05)
    assert (caught.value.field, caught.value.value) == ("backscatter_ratio", 0.05)
    assert "0.018" in caught.value.remedy


@pytest.mark.parametrize(("phase", "own"), [("petzold-harbour", "0.019"), ("wells", "0.018"), (MIXED, "0.021")])
def test_a_backscatter_ratio_that_is_not_the_phase_functions_is_refused(phase, own):
    with pytest.raises(ConfigError) as caught:
        other(phase_function=phase, backscatter_ratio=0.03)
    assert (caught.value.field, caught.value.value) == ("backscatter_ratio", 0.03)
    assert own in caught.value.remedy
