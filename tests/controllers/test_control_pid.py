"""PID: exact integral of a constant error, no derivative kick, bounded windup."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.controllers.control_law import pid_step
from auvdock.controllers.pid import PidGains
from auvdock.core.errors import ConfigError

finite = st.floats(-50.0, 50.0)


def test_integral_of_a_constant_error_is_exact():
    output = integral = 0.0
    for _ in range(90):
        output, integral = pid_step(2.0, 0.5, 1.0, integral, 0.1, 0.0, 0.0, 100.0, 1.0 / 30.0)
    assert integral == pytest.approx(0.5 * 0.1 * 3.0)
    assert output == pytest.approx(2.0 * 0.1 + integral)


def test_derivative_acts_on_the_measured_rate_alone():
    assert pid_step(0.0, 0.0, 3.0, 0.0, 40.0, 0.0, 0.0, 100.0, 0.1)[0] == 0.0
    assert pid_step(0.0, 0.0, 3.0, 0.0, 0.0, 2.0, 0.0, 100.0, 0.1)[0] == -6.0


@settings(deadline=None)  # the first call may compile
@given(error=finite, rate=finite, feed=finite, start=st.floats(-10.0, 10.0), limit=st.floats(0.1, 10.0))
def test_output_and_integral_stay_within_the_limit(error, rate, feed, start, limit):
    integral = max(-limit, min(limit, start))
    for _ in range(5):
        output, integral = pid_step(1.0, 5.0, 0.5, integral, error, rate, feed, limit, 0.1)
        assert abs(output) <= limit
        assert abs(integral) <= limit


@settings(deadline=None)  # the first call may compile
@given(error=finite, rate=finite, integral=st.floats(-5.0, 5.0), feed=finite)
def test_odd_symmetry(error, rate, integral, feed):
    gains = 1.5, 0.7, 0.3
    plus = pid_step(*gains, integral, error, rate, feed, 8.0, 0.05)
    minus = pid_step(*gains, -integral, -error, -rate, -feed, 8.0, 0.05)
    assert plus == pytest.approx((-minus[0], -minus[1]))


def test_saturated_loop_leaves_saturation_at_once():
    """Against a wall for a minute, then the error changes sign: conditional integration has nothing to unwind."""
    gains, integral, output = (1.0, 1.0, 0.0), 0.0, 0.0
    for _ in range(600):
        output, integral = pid_step(*gains, integral, 20.0, 0.0, 0.0, 5.0, 0.1)
    assert output == 5.0
    assert integral < 5.0
    assert pid_step(*gains, integral, -1.0, 0.0, 0.0, 5.0, 0.1)[0] < 5.0


def test_negative_gain_is_refused():
    with pytest.raises(ConfigError, match=r"^ki: "):
        PidGains(1.0, -1.0)
