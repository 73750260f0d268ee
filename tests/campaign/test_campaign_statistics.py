"""Intervals and tests against outside references, and the intervals' coverage."""

import dataclasses

import pytest
from campaign_jobs import Bernoulli
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, binomtest

from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.executor import SerialExecutor
from auvdock.campaign.plan import Plan
from auvdock.campaign.report.cells import rate_of
from auvdock.campaign.row import Row
from auvdock.campaign.statistics import mcnemar, wilson
from auvdock.episode.result import LOST_REASONS


@given(st.integers(1, 3000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_scipy_s(counts):
    successes, episodes = counts
    reference = binomtest(successes, episodes).proportion_ci(0.95, method="wilson")
    found = wilson(successes, episodes)
    assert (found.low, found.high) == pytest.approx((reference.low, reference.high), abs=1e-12)
    assert found.low <= successes / episodes <= found.high


@given(st.integers(0, 30), st.integers(0, 30), st.lists(st.sampled_from(LOST_REASONS), max_size=30))
def test_what_left_no_result_moves_no_rate_and_is_told(successes, failures, lost):
    flown: list[Row] = [{"success": True, "failure_reason": None}] * successes
    flown += [{"success": False, "failure_reason": "near"}] * failures
    found = rate_of([*flown, *({"success": False, "failure_reason": reason} for reason in lost)])
    assert dataclasses.replace(found, lost=0) == rate_of(flown) == wilson(successes, successes + failures)
    assert found.lost == len(lost)


def test_without_episodes_everything_is_possible():
    found = wilson(0, 0)
    assert (found.rate, found.low, found.high) == (None, 0.0, 1.0)


def test_intervals_cover_the_known_rate_in_93_to_97_percent_of_2000_campaigns():
    probability, episodes, campaigns = 0.8, 50, 2000
    executor = SerialExecutor(limit_s=60.0)
    executor.start(Bernoulli(probability))
    covered = 0
    for seed in range(campaigns):
        plan = Plan(CampaignCfg(episodes=episodes, seed=seed))
        rows = list(executor.run(plan[index] for index in range(episodes)))
        found = wilson(sum(row["success"] is True for row in rows), episodes)
        covered += found.low <= probability <= found.high
    assert 0.93 <= covered / campaigns <= 0.97
    # What the share should be, from the binomial distribution alone; 2,000 campaigns scatter by 0.5 %.
    inside = [k for k in range(episodes + 1) if wilson(k, episodes).low <= probability <= wilson(k, episodes).high]
    exact = float(binom.pmf(inside, episodes, probability).sum())
    assert covered / campaigns == pytest.approx(exact, abs=0.02)


def test_mcnemar_is_the_binomial_test_of_the_discordant_pairs():
    found = mcnemar(both=59, only_first=6, only_second=16, neither=80)
    assert found.p_value == pytest.approx(2.0 * float(binom.cdf(6, 22, 0.5)))
    assert found.pairs == 161
    assert found.difference == pytest.approx(10 / 161)
    assert mcnemar(5, 0, 0, 2).p_value == 1.0


def test_the_paired_interval_is_newcombe_s_own_example():
    """Newcombe 1998, table II: 36, 12, 2 and 0 pairs of 50, method 10: 0.0569 to 0.3404."""
    found = mcnemar(both=36, only_first=2, only_second=12, neither=0)
    assert found.difference == pytest.approx(0.2)
    assert (found.low, found.high) == pytest.approx((0.0569, 0.3404), abs=1e-4)


@given(*[st.integers(0, 200)] * 4)
def test_the_paired_interval_holds_the_difference_and_turns_with_it(both, first, second, neither):
    if both + first + second + neither == 0:
        return
    found, turned = mcnemar(both, first, second, neither), mcnemar(both, second, first, neither)
    assert -1.0 <= found.low <= found.difference <= found.high <= 1.0
    assert (turned.low, turned.high) == pytest.approx((-found.high, -found.low), abs=1e-12)
