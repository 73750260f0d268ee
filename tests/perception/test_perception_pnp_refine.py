"""Projection and derivatives of the refinement against OpenCV's, and what follows from its result."""

import cv2
import numpy as np
import pytest

from auvdock.numeric.lights import Light, Pose, Solution
from auvdock.numeric.rotations import left_jacobian, rotation_of, vector_of
from auvdock.perception.pnp_refine import image_lights, solve_from

LENS = (350.0, 347.0, 321.0, 177.5)
MATRIX = np.array([[350.0, 0.0, 321.0], [0.0, 347.0, 177.5], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.31, 0.12, 0.0, 0.0, -0.02), (-0.2, 0.1, 0.003, -0.002, 0.01)])
def test_pixels_and_derivatives_are_opencvs(distortion):
    rng = np.random.default_rng(5)
    terms = np.array(distortion)
    for _ in range(20):
        pose = np.concatenate([rng.normal(size=3), rng.uniform((-1.0, -1.0, 3.0), (1.0, 1.0, 9.0))])
        points, lights = rng.uniform(-1.0, 1.0, (7, 3)), Light.zeros(7)
        lights["place_m"] = points
        pixels, jacobian = np.empty((7, 2)), np.empty((7, 2, 6))
        image_lights(pose, lights, np.array([*LENS, *distortion]), pixels, jacobian)
        wanted, derivatives = cv2.projectPoints(points, pose[:3], pose[3:], MATRIX, terms)
        assert pixels == pytest.approx(wanted.reshape(7, 2), abs=1e-9)
        assert jacobian.reshape(14, 6) == pytest.approx(derivatives[:, :6], rel=1e-9, abs=1e-7)


def imaged(lights, pose):
    """(n, 2) images by OpenCV."""
    return cv2.projectPoints(lights["place_m"].copy(), pose[:3], pose[3:], MATRIX, np.zeros(5))[0].reshape(-1, 2)


def refined(pose, lights, prior, weight, heading_weight, decrement):
    solution, lens = Solution.zeros(), np.array([*LENS, *np.zeros(5)])
    start = Pose(pose[:3], pose[3:]).packed()
    solve_from(start, lights, prior, lens, weight, heading_weight, decrement, solution)
    return Solution.read(solution)


def scene(rng, count):
    """Lights with σ and the pose that they are seen from, with a prior some degrees off."""
    pose = np.concatenate([rng.normal(size=3), rng.uniform((-1.0, -1.0, 3.0), (1.0, 1.0, 9.0))])
    lights = Light.zeros(count)
    lights["place_m"] = rng.uniform(-1.0, 1.0, (count, 3))
    lights["centre_px"] = imaged(lights, pose) + rng.normal(0.0, 0.3, (count, 2))
    lights["sigma_px"], lights["is_seen"] = rng.uniform(0.3, 1.0, count), True
    prior = rotation_of(rng.normal(0.0, 0.05, 3)) @ rotation_of(pose[:3])
    return pose, lights, prior


@pytest.mark.parametrize("heading_weight", [200.0, 3.0])
@pytest.mark.parametrize("unseen", [0, 2, 7])
def test_all_that_follows_from_a_pose(unseen, heading_weight):
    """The rest of a result, by NumPy and OpenCV, from the pose in it; that pose is where the gradient vanishes."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        pose, lights, prior = scene(rng, 7)
        lights["is_seen"][:unseen] = False
        result = refined(pose, lights, prior, 200.0, heading_weight, 1e-12)
        r, t = result.pose.rotation_vector, result.pose.translation_m
        rotation = result.rotation
        assert rotation == pytest.approx(cv2.Rodrigues(r)[0], abs=1e-12)
        assert result.T_station_camera @ np.vstack([np.column_stack([rotation, t]), [0, 0, 0, 1]]) == pytest.approx(
            np.eye(4), abs=1e-12
        )
        image, derivatives = cv2.projectPoints(lights["place_m"].copy(), r, t, MATRIX, np.zeros(5))
        gap = image.reshape(-1, 2) - lights["centre_px"]
        residual = np.linalg.norm(gap, axis=1)
        counted = lights["is_seen"] if unseen < 7 else np.ones(7, dtype=bool)
        assert result.error_px == pytest.approx(residual[counted].mean(), abs=1e-4)
        angle = np.linalg.norm(cv2.Rodrigues(rotation @ prior.T)[0])
        assert result.attitude_error_rad == pytest.approx(angle, abs=1e-7)
        # The prior: 200 about any axis but the station's upright one.
        up = prior[:, 2]
        turned = left_jacobian(vector_of(prior))
        weight = turned.T @ (200.0 * np.eye(3) + (heading_weight - 200.0) * np.outer(up, up)) @ turned
        off = r - vector_of(prior)
        assert result.cost == pytest.approx(np.sum((residual / lights["sigma_px"]) ** 2) + off @ weight @ off, rel=1e-5)
        jacobian = derivatives[:, :6] / np.repeat(lights["sigma_px"], 2)[:, None]
        normal = jacobian.T @ jacobian
        normal[:3, :3] += weight
        gradient = jacobian.T @ (gap / lights["sigma_px"][:, None]).ravel()
        gradient[:3] += weight @ off
        assert gradient @ np.linalg.solve(normal, gradient) < 1e-6
        # Position -Rᵀ t and the camera's turn, by differences.
        to = np.empty((6, 6))
        for k, step in enumerate(1e-6 * np.eye(6)):
            high, low = cv2.Rodrigues(r + step[:3])[0], cv2.Rodrigues(r - step[:3])[0]
            to[:3, k] = (-high.T @ (t + step[3:]) + low.T @ (t - step[3:])) / 2e-6
            turn = high @ low.T
            to[3:, k] = -0.5 * (turn - turn.T)[[2, 0, 1], [1, 2, 0]] / 2e-6
        wanted = to @ np.linalg.inv(normal) @ to.T
        assert result.covariance == pytest.approx(wanted, rel=1e-3, abs=1e-4 * wanted.max())


def test_a_pose_behind_the_camera_has_no_cost():
    pose, lights, prior = scene(np.random.default_rng(9), 5)
    pose[5] = -pose[5]
    lights["centre_px"] = imaged(lights, pose)
    result = refined(pose, lights, prior, 0.0, 0.0, 1e-9)
    assert np.isnan(result.cost)
