import itertools
import math

import jerlov
import numpy as np
import pytest
from test_optics_water import JERLOV_KD, JERLOV_NM, PURE_ABSORPTION

from auvdock.core.errors import ConfigError
from auvdock.optics.bands import BANDS_NM
from auvdock.optics.photons.mixture import shares_of
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.table import photon_halo_of
from auvdock.optics.water import load_water, water_of

TYPES = tuple(JERLOV_KD)
MEASURED = ("IB", "II", "III", "1C", "3C", "5C")
"""Types of which Williamson & Hollins (2022) give a and b."""
# a and b at 450 nm, 1/m, as printed: Williamson & Hollins (2022), table 7; Solonenko & Mobley (2015), tables 4 to 8.
PRINTED = {
    "I": (0.018, 0.00381),
    "IA": (0.0221, 0.00631),
    "IB": (0.0407, 0.135),
    "II": (0.0623, 0.195),
    "III": (0.112, 0.309),
    "1C": (0.148, 0.455),
    "3C": (0.2, 0.686),
    "5C": (0.313, 1.27),
    "7C": (0.542, 3.3),
    "9C": (0.943, 4.39),
}
# Petzold (1972): c and b in 1/m at 530 nm, b_b / b, as printed.
STATIONS = {"clear": (0.151, 0.037, 0.044), "coastal": (0.398, 0.219, 0.013), "harbour": (1.92, 1.583, 0.019)}
PURE_SCATTERING = np.array([0.0045, 0.0022, 0.0011])
"""Pure sea water, Morel (1974)."""


def printed_kd(name):
    return np.interp(BANDS_NM, JERLOV_NM, JERLOV_KD[name])


@pytest.mark.parametrize("name", PRINTED)
def test_jerlov_types_are_as_printed(name):
    water, (a, b) = load_water(name), PRINTED[name]
    assert (water.absorption[0], water.scattering[0], water.attenuation[0]) == pytest.approx((a, b, a + b))
    assert ("Williamson" in water.source) == (name in MEASURED)
    assert ("Solonenko" in water.source) == (name not in MEASURED)


def test_turbidity_rises_through_the_jerlov_types():
    for band in range(3):
        c = [load_water(name).attenuation[band] for name in TYPES]
        assert all(low < high for low, high in itertools.pairwise(c))


@pytest.mark.parametrize("name", TYPES)
def test_diffuse_attenuation_lies_between_what_jerlov_printed_of_the_neighbours(name):
    # The types are defined by K_d; a and b were measured, or inverted by other authors, and know nothing of our Kirk.
    i, ours = TYPES.index(name), load_water(name).diffuse_attenuation
    clearer, murkier = printed_kd(TYPES[max(i - 1, 0)]), printed_kd(TYPES[min(i + 1, len(TYPES) - 1)])
    assert (0.97 if i == 0 else 1.0) * clearer[0] < ours[0] < murkier[0]
    assert ours[1:] == pytest.approx(printed_kd(name)[1:], rel=0.15)
    if name not in MEASURED:
        assert ours[0] == pytest.approx(printed_kd(name)[0], rel=0.15)


@pytest.mark.parametrize(("name", "rel"), [("I", 0.2), ("IA", 0.2), ("7C", 0.15), ("9C", 0.15)])
def test_diffuse_attenuation_is_near_that_of_radiative_transfer(name, rel):
    # HydroLight's K_d of just these a and b, Petzold's average particle, sun and sky (Solonenko & Mobley 2015).
    hydrolight = np.asarray(jerlov.water(name, "solonenko2015").kd_hydrolight(BANDS_NM))
    assert load_water(name).diffuse_attenuation == pytest.approx(hydrolight, rel=rel)


@pytest.mark.parametrize("name", STATIONS)
def test_petzolds_waters_are_as_printed_where_he_measured(name):
    water, (c, b, ratio) = load_water(f"petzold_{name}"), STATIONS[name]
    assert water.attenuation[1] == pytest.approx(c)
    assert water.scattering[1] == pytest.approx(b, abs=5e-4)
    assert water.backscattering[1] / water.scattering[1] == pytest.approx(ratio, abs=6e-4)
    assert water.phase == f"petzold-{name}"


@pytest.mark.parametrize("name", STATIONS)
def test_petzolds_waters_in_other_bands(name):
    water = load_water(f"petzold_{name}")
    # Austin & Petzold (1986), table IV: M is 1.4158, 0.6924 and 0.5380. Two pure waters differ by 2 % at 620 nm.
    excess = (water.absorption[1] - PURE_ABSORPTION[1]) * np.array([1.4158, 0.6924, 0.5380]) / 0.6924
    assert water.absorption == pytest.approx(PURE_ABSORPTION + excess, rel=0.03)
    # Particles of the measured types scatter as 1/λ^0.3 to 1/λ^0.6.
    particles = water.scattering - PURE_SCATTERING
    power = np.log(particles[:-1] / particles[1:]) / np.log(np.array(BANDS_NM[1:]) / BANDS_NM[:-1])
    assert np.all((power > 0.2) & (power < 0.7))


def turbid(c_530):
    return water_of("pool", turbidity_per_m=c_530)


@pytest.mark.parametrize("c_530", [0.151, 0.2, 0.398, 0.5, 1.0, 1.92])
def test_turbidity_is_the_attenuation_where_petzold_measured(c_530):
    assert turbid(c_530).attenuation[1] == pytest.approx(c_530)


@pytest.mark.parametrize("name", STATIONS)
def test_at_a_station_the_turbid_water_is_the_stations(name):
    turbidity, station = turbid(STATIONS[name][0]), load_water(f"petzold_{name}")
    assert turbidity.phase == station.phase
    assert (turbidity.absorption, turbidity.scattering) == (
        pytest.approx(station.absorption),
        pytest.approx(station.scattering),
    )


@pytest.mark.parametrize(("ends", "part"), [(("clear", "coastal"), 0.3), (("coastal", "harbour"), 0.7)])
def test_between_two_stations_it_scatters_as_both_waters_stirred_together(ends, part):
    one, other = (load_water(f"petzold_{name}") for name in ends)
    mixed = turbid(float((1.0 - part) * one.attenuation[1] + part * other.attenuation[1]))
    assert mixed.absorption == pytest.approx((1.0 - part) * one.absorption + part * other.absorption)
    assert mixed.scattering == pytest.approx((1.0 - part) * one.scattering + part * other.scattering)
    angle = np.radians([0.1, 1.0, 10.0, 90.0, 150.0])
    function = mixed.scattering[1] * load_phase(mixed.phase).density(angle)
    stirred = [
        share * water.scattering[1] * load_phase(water.phase).density(angle)
        for share, water in ((1.0 - part, one), (part, other))
    ]
    assert function == pytest.approx(np.sum(stirred, axis=0), rel=1e-3)


def test_a_turbid_waters_halo_lies_between_those_of_its_stations():
    angle = np.radians([0.2, 1.0, 5.0, 20.0])
    within = [photon_halo_of(turbid(c)).within(3.0, 0.3, angle) for c in (0.398, 0.5, 0.8, 1.3, 1.92)]
    assert np.all(np.diff(within, axis=0) * np.sign(within[-1] - within[0]) > 0.0)
    assert math.isclose(sum(shares_of(turbid(0.8).phase).values()), 1.0)


@pytest.mark.parametrize("c_530", [0.15, 1.921, 0.0, -1.0, math.nan, math.inf])
def test_beyond_petzolds_waters_a_turbidity_is_refused_with_their_range(c_530):
    with pytest.raises(ConfigError, match=r"0\.151 1/m.* 1\.92 1/m") as caught:
        turbid(c_530)
    assert caught.value.field == "turbidity_per_m"


def test_two_turbidities_are_refused():
    with pytest.raises(ConfigError, match="attenuation_per_m") as caught:
        water_of("pool", 0.5, 0.5)
    assert caught.value.field == "turbidity_per_m"
