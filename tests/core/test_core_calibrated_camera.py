import itertools

import cv2
import numpy as np
import pytest

from auvdock.core.calibrated_camera import (
    CalibratedCameraCfg,
    fit_opencv_distortion,
    ideal_coordinates,
    make_calibrated_camera,
)
from auvdock.core.errors import ConfigError
from auvdock.core.strict import from_mapping

CFG = CalibratedCameraCfg()
DOWN, FORWARD = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])


def camera():
    return make_calibrated_camera(CFG, np.array([0.2, 0.0, -0.1]), DOWN, FORWARD)


def sensor_grid(columns=161, rows=121):
    return np.stack(np.meshgrid(np.linspace(-0.5, 799.5, columns), np.linspace(-0.5, 599.5, rows)), axis=2).reshape(
        -1, 2
    )


def test_intrinsics_are_the_published_ones():
    matrix = camera().matrix
    assert matrix[0, 0] == pytest.approx(857.5, abs=0.05)
    assert matrix[1, 1] == pytest.approx(856.5, abs=0.05)
    assert matrix[:2, 2] == pytest.approx([417.582, 285.199])
    assert (camera().width_px, camera().height_px, camera().rate_hz) == (800, 600, 20.0)


def test_published_coefficients_in_normalised_units():
    f = CFG.focal_length_m
    assert [abs(k) * f ** (2 * n) for n, k in enumerate(CFG.radial, 1)] == pytest.approx(
        [0.358, 0.0101, 0.501], rel=3e-3
    )
    assert [p * f for p in CFG.tangential] == pytest.approx([1.8e-4, 2.7e-3], rel=0.02)


def test_opencv_re_expression_equals_the_metric_polynomial():
    pixels = sensor_grid()
    ideal = ideal_coordinates(CFG, pixels)
    back = camera().project(np.column_stack([ideal, np.ones(len(ideal))]))
    miss = np.linalg.norm(back - pixels, axis=1)
    # OpenCV's five terms are no exact inverse of a polynomial: the remainder sits in the outermost corner.
    assert float(np.sqrt(np.mean(miss**2))) < 0.12
    assert float(np.percentile(miss, 99.0)) < 0.27
    assert float(miss.max()) < 0.85


def test_project_is_opencvs():
    points = np.column_stack([ideal_coordinates(CFG, sensor_grid(21, 16)), np.ones(21 * 16)]) * 2.5
    unit = camera()
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), unit.matrix, unit.distortion)
    assert np.abs(theirs.reshape(-1, 2) - unit.project(points)).max() < 1e-9


def test_project_and_normalise_are_inverse_over_the_whole_image():
    pixels = sensor_grid()
    unit = camera()
    rays = np.column_stack([unit.normalise(pixels), np.ones(len(pixels))])
    assert np.abs(unit.project(rays) - pixels).max() < 1e-6
    assert unit.normalise(np.zeros((0, 2))).shape == (0, 2)
    assert unit.in_view(unit.rays(pixels[:-1])[:: 161 + 1]).any()


def test_signs_are_those_of_a_flat_port():
    # A flat port's own distortion, s / √(1 + (n² - 1) s²), and each of the eight sign patterns of |k1|, |k2|, |k3|.
    f = CFG.focal_length_m
    s = np.linspace(0.0, 0.61, 300)
    port = s / np.sqrt(1.0 + (1.33**2 - 1.0) * s**2)
    misfit = {}
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        k1, k2, k3 = (
            sign * abs(k) * f ** (2 * n) for n, (sign, k) in enumerate(zip(signs, CFG.radial, strict=True), 1)
        )
        curve = s * (1.0 + k1 * s**2 + k2 * s**4 + k3 * s**6)
        assert np.all(np.diff(curve) > 0.0)
        misfit[signs] = 857.5 * float(np.sqrt(np.average((curve - port) ** 2, weights=s)))
    chosen = tuple(float(np.sign(k)) for k in CFG.radial)
    assert min(misfit, key=lambda signs: misfit[signs]) == chosen
    assert misfit[chosen] < 2.0


def test_no_distortion_is_no_distortion():
    plain = CalibratedCameraCfg(radial=(0.0, 0.0, 0.0), tangential=(0.0, 0.0))
    assert np.abs(fit_opencv_distortion(plain)).max() < 1e-9


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"width_px": 8}, "width_px"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"focal_length_m": -1.0}, "focal_length_m"),
        ({"principal_point_px": [900.0, 10.0]}, "principal_point_px"),
        ({"radial": [-40000.0, 0.0, 0.0]}, "radial"),
        ({"focal_lenght_m": 0.007}, "focal_lenght_m"),
    ],
)
def test_impossible_cameras_are_refused(change, field):
    with pytest.raises(ConfigError) as caught:
        from_mapping(CalibratedCameraCfg, change)
    assert caught.value.field == field


def test_looks_down_with_forward_up():
    T_body_camera = camera().T_body_camera
    assert T_body_camera[:3, 2] == pytest.approx([0.0, 0.0, -1.0])
    # Image up is forward, image right is starboard (y to port is left).
    assert T_body_camera[:3, 1] == pytest.approx([-1.0, 0.0, 0.0])
    assert T_body_camera[:3, 0] == pytest.approx([0.0, -1.0, 0.0])
