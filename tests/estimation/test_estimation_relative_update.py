"""The relative filter's loops against the Kalman filter written out in matrices."""

import numpy as np
import pytest

from auvdock.estimation.relative_update import _fused, _move


def spread(rng, size):
    root = rng.normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


def test_prediction_is_f_p_ft_plus_q():
    rng = np.random.default_rng(1)
    covariance, process = spread(rng, 4), rng.random(4)
    move = np.eye(4)
    move[:2, 3] = 0.3, -0.7
    expected = move @ covariance @ move.T + np.diag(process)
    _move(covariance, 0.3, -0.7, process)
    assert covariance == pytest.approx(expected, rel=1e-12)


def test_update_is_the_kalman_filters():
    rng = np.random.default_rng(2)
    for _ in range(20):
        covariance, noise, floor = spread(rng, 4), spread(rng, 6), rng.random(6)
        innovation, turn = rng.normal(size=6), rng.normal(size=3)
        sensitivity = np.zeros((6, 4))
        sensitivity[:3, :3] = np.eye(3)
        sensitivity[3:, 3] = -turn
        total = sensitivity @ covariance @ sensitivity.T + 1.7 * noise + np.diag(floor)
        gain = covariance @ sensitivity.T @ np.linalg.inv(total)
        distance, shift, rest = _fused(covariance, innovation, turn, noise, 1.7, floor)
        assert distance == pytest.approx(innovation @ np.linalg.solve(total, innovation))
        assert shift == pytest.approx(gain @ innovation)
        assert rest == pytest.approx((np.eye(4) - gain @ sensitivity) @ covariance, abs=1e-9)
        assert np.array_equal(rest, rest.T)


def test_a_singular_innovation_is_refused():
    distance, _, rest = _fused(np.zeros((4, 4)), np.ones(6), np.ones(3), np.zeros((6, 6)), 1.0, np.zeros(6))
    assert distance == np.inf
    assert not rest.any()
