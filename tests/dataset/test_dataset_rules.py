"""The rules of the labels on pictures of round lights."""

import numpy as np
import pytest
from dataset_scenes import HEIGHT, RADII_PX, RED_LIGHT, SCALE, WIDTH, light, picture
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.errors import ConfigError
from auvdock.dataset.rules import LabelRules, label_lights

RULES = LabelRules()


def labels_of(lights, background_e=50.0, rules=RULES):
    return label_lights(picture(lights, background_e), SCALE, lights, RADII_PX, rules)


def owners_of(labels):
    return {label.lamps[0] for label in labels if not label.ignored}


@settings(max_examples=150, deadline=None)
@given(
    places=st.lists(
        st.tuples(st.floats(24.0, 72.0), st.floats(20.0, 44.0), st.floats(3.0, 9.0), st.booleans()),
        min_size=1,
        max_size=5,
    ),
    background_e=st.floats(0.0, 3000.0),
    sigma_px=st.floats(0.7, 3.0),
)
def test_a_light_of_twice_the_brightness_keeps_its_label(places, background_e, sigma_px):
    # Up to 8,100 electrons each: five in one place, one of them doubled, do not saturate.
    colours = [RED_LIGHT if is_red else (0.02, 0.3, 1.0) for *_, is_red in places]
    lights = [
        light(f"L{k}", x, y, float(np.exp(level)), sigma_px=sigma_px, colour=colours[k])
        for k, (x, y, level, _) in enumerate(places)
    ]
    before = owners_of(labels_of(lights, background_e))
    for k, (x, y, level, _) in enumerate(places):
        brighter = light(f"L{k}", x, y, 2.0 * float(np.exp(level)), sigma_px=sigma_px, colour=colours[k])
        after = owners_of(labels_of([*lights[:k], brighter, *lights[k + 1 :]], background_e))
        assert f"L{k}" not in before or f"L{k}" in after


@pytest.mark.parametrize("apart_px", [0.0, 1.0, 1.5])
def test_lights_without_a_dip_between_them_are_one_box_of_the_brighter(apart_px):
    lights = [light("dark", 40.0, 30.0, 4000.0), light("bright", 40.0 + apart_px, 30.0, 5000.0)]
    (label,) = labels_of(lights)
    assert label.lamps == ("bright", "dark")
    assert label.centre_px == (40.0 + apart_px, 30.0)


def test_lights_with_a_dip_between_them_are_two():
    apart = labels_of([light("one", 40.0, 30.0, 4000.0), light("other", 48.0, 30.0, 5000.0)])
    assert [label.lamps for label in sorted(apart, key=lambda label: label.centre_px)] == [("one",), ("other",)]


def test_a_dip_in_one_channel_is_enough():
    # Blue is burnt out from one light to the other; red, at a fiftieth of the light, is not.
    lights = [light("one", 40.0, 30.0, 4e5, sigma_px=3.0), light("other", 52.0, 30.0, 5e5, sigma_px=3.0)]
    image = picture(lights)
    assert (SCALE.codes(image[30, 40:53, 2].astype(float)) >= 255.0).all()
    assert owners_of(labels_of(lights)) == {"one", "other"}
    grey = [
        light(item.name, item.pixel[0], item.pixel[1], item.profile_e.max(), sigma_px=3.0, colour=(1.0, 1.0, 1.0))
        for item in lights
    ]
    assert len(owners_of(labels_of(grey))) == 1


def test_a_light_is_absent_then_ignored_then_counts_as_it_brightens():
    told = []
    for peak_e in np.geomspace(1.0, 200.0, 40):
        labels = labels_of([light("lamp", 40.0, 30.0, float(peak_e))], background_e=400.0)
        # √(e + σ²) has noise of one half, and rounding to codes a twelfth (Anscombe 1948).
        codes = SCALE.codes(np.array([400.0, 400.0 + peak_e]))
        snr = (codes[1] - codes[0]) / np.sqrt(0.25 * SCALE.dn_per_root**2 + 1.0 / 12.0)
        reason = labels[0].ignored if labels else "absent"
        told.append(reason)
        if labels:
            assert labels[0].snr == pytest.approx(snr, rel=0.07)
            assert labels[0].visibility == (1 if reason else 2)
    assert list(dict.fromkeys(told)) == ["absent", "dim", ""]


def test_mirror_images_and_strangers_of_like_colour_are_ignored_and_others_are_negatives():
    lights = [
        light("own", 20.0, 20.0, 4000.0),
        light("mirror", 70.0, 20.0, 4000.0, foreign="mirror"),
        light("blue", 20.0, 50.0, 4000.0, foreign="stranger"),
        light("green", 70.0, 50.0, 4000.0, foreign="negative"),
    ]
    assert {label.lamps[0]: label.ignored for label in labels_of(lights)} == {
        "own": "",
        "mirror": "mirror",
        "blue": "stranger",
    }


def test_a_light_hidden_by_a_strangers_is_ignored():
    lights = [light("green", 40.0, 30.0, 9000.0, foreign="negative"), light("own", 40.5, 30.0, 3000.0)]
    (label,) = labels_of(lights)
    assert label.ignored == "stranger"


@settings(max_examples=100, deadline=None)
@given(
    x=st.floats(-12.0, WIDTH + 12.0),
    y=st.floats(-12.0, HEIGHT + 12.0),
    sigma_px=st.floats(0.6, 40.0),
    peak_e=st.floats(200.0, 1e6),
)
def test_boxes_stay_within_floor_cap_and_picture_and_hold_their_centre(x, y, sigma_px, peak_e):
    for label in labels_of([light("lamp", x, y, peak_e, sigma_px=sigma_px)]):
        left, top, right, bottom = label.xyxy
        assert -0.5 <= left <= label.centre_px[0] <= right <= WIDTH - 0.5
        assert -0.5 <= top <= label.centre_px[1] <= bottom <= HEIGHT - 0.5
        assert max(right - left, bottom - top) <= RULES.cap_px + 1e-9
        if not label.ignored:
            assert (right - left) * (bottom - top) >= RULES.edge_share * RULES.floor_px**2 - 1e-9
            assert label.centre_px == (pytest.approx(x), pytest.approx(y))


def test_a_box_spans_half_of_the_contrast():
    # Linear codes: half of a Gaussian's peak is at 1.177 σ; the tabulated radii are a tenth apart.
    (label,) = labels_of([light("lamp", 48.0, 32.0, 300.0, sigma_px=6.0)], background_e=20000.0)
    assert label.side_px == pytest.approx(2.0 * 1.177 * 6.0, rel=0.15)


def test_a_light_cut_by_the_border_is_ignored():
    (label,) = labels_of([light("lamp", 0.0, 30.0, 4000.0)])
    assert label.ignored == "edge"


@pytest.mark.parametrize(("name", "value"), [("dim_sigma", 4.0), ("floor_px", 40.0), ("edge_share", 1.5)])
def test_rules_that_cross_are_refused(name, value):
    with pytest.raises(ConfigError, match=name):
        LabelRules(**{name: value})
