import itertools
import math

import numpy as np
import pytest

from auvdock.assets import asset_names
from auvdock.core.errors import ConfigError
from auvdock.optics.bands import BANDS_NM
from auvdock.optics.water import WaterCfg, load_water, with_attenuation

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


@pytest.mark.parametrize("name", asset_names("waters"))
def test_presets_load_with_possible_coefficients(name):
    water = load_water(name)
    assert np.all(water.absorption >= 0.99 * PURE_ABSORPTION)
    assert np.all(water.scattering >= 0.0)
    assert water.source


def test_all_waters_are_there():
    assert {*JERLOV_KD, "clear", "pool", "lake"} <= set(asset_names("waters"))


@pytest.mark.parametrize("name", JERLOV_KD)
def test_diffuse_attenuation_is_jerlovs(name):
    expected = np.interp(BANDS_NM, JERLOV_NM, JERLOV_KD[name])
    assert load_water(name).diffuse_attenuation == pytest.approx(expected, rel=0.01)


def test_turbidity_rises_through_the_jerlov_types():
    c_450 = [load_water(name).attenuation[0] for name in JERLOV_KD]
    assert all(low < high for low, high in itertools.pairwise(c_450))


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
    with pytest.raises(ConfigError, match="lake"):
        load_water("soup")


def test_negative_coefficients_are_refused():
    with pytest.raises(ConfigError, match="absorption_per_m"):
        WaterCfg("x", "test", (-0.1, 0.0, 0.0), (0.0, 0.0, 0.0))
