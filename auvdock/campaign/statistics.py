"""Intervals and tests for success rates."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import bdtr

__all__ = ["McNemar", "Rate", "mcnemar", "wilson"]

Z_95 = 1.959963984540054
"""97.5 % quantile of the standard normal distribution."""


@dataclass(frozen=True)
class Rate:
    """A success rate with its interval.

    Attributes:
        successes: k.
        episodes: n, all of which were flown to an end.
        low: lower bound.
        high: upper bound.
        lost: episodes beside these that left no result (`LOST_REASONS`); neither success nor failure.
    """

    successes: int
    episodes: int
    low: float
    high: float
    lost: int = 0

    @property
    def rate(self) -> float | None:
        """k/n, None without episodes."""
        return self.successes / self.episodes if self.episodes else None

    @property
    def half_width(self) -> float:
        """Half the interval's width."""
        return (self.high - self.low) / 2.0


def wilson(successes: int, episodes: int, z: float = Z_95, lost: int = 0) -> Rate:
    """Wilson's score interval for a proportion (Wilson 1927; Brown, Cai and DasGupta 2001, equation 4).

    (k + z²/2)/(n + z²) ± z √n/(n + z²) √(p̂ (1 − p̂) + z²/(4 n)); without episodes it is [0, 1].

    Args:
        successes: k.
        episodes: n, of those that left a result.
        z: quantile of the standard normal distribution.
        lost: how many left none; told beside the rate, they do not enter it.

    Raises:
        ValueError: counts that cannot be.
    """
    if not 0 <= successes <= episodes or lost < 0:
        raise ValueError(f"{successes} successes of {episodes} episodes")
    if episodes == 0:
        return Rate(0, 0, 0.0, 1.0, lost)
    share = successes / episodes
    centre = (successes + z * z / 2.0) / (episodes + z * z)
    half = z * math.sqrt(episodes) / (episodes + z * z) * math.sqrt(share * (1.0 - share) + z * z / (4.0 * episodes))
    # At 0 and n the bound is 0 and 1 exactly; rounding must not move it.
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == episodes else min(1.0, centre + half)
    return Rate(successes, episodes, low, high, lost)


@dataclass(frozen=True)
class McNemar:
    """Two paired campaigns.

    Attributes:
        both: pairs in which both succeeded.
        only_first: pairs in which only the first did.
        only_second: pairs in which only the second did.
        neither: pairs in which both failed.
        p_value: two-sided, exact.
        difference: second's rate minus first's.
        low: lower 95 % bound of the difference.
        high: upper 95 % bound of the difference.
    """

    both: int
    only_first: int
    only_second: int
    neither: int
    p_value: float
    difference: float
    low: float
    high: float

    @property
    def pairs(self) -> int:
        """All pairs."""
        return self.both + self.only_first + self.only_second + self.neither


def mcnemar(both: int, only_first: int, only_second: int, neither: int) -> McNemar:
    """McNemar's test in its exact form: given a difference, either side is equally likely (McNemar 1947).

    The difference's interval is Newcombe's square-and-add method for paired proportions with Wilson's bounds
    (Newcombe 1998, "Improved confidence intervals for the difference between binomial proportions based on paired
    data", method 10).

    Raises:
        ValueError: no pairs at all.
    """
    pairs = both + only_first + only_second + neither
    if pairs == 0:
        raise ValueError("no pairs")
    discordant = only_first + only_second
    p_value = min(1.0, 2.0 * float(bdtr(min(only_first, only_second), discordant, 0.5)))
    one, two = wilson(both + only_first, pairs), wilson(both + only_second, pairs)
    share_one, share_two = one.successes / pairs, two.successes / pairs
    phi = _phi(both, only_first, only_second, neither)
    difference = share_two - share_one
    down_two, up_two = share_two - two.low, two.high - share_two
    down_one, up_one = share_one - one.low, one.high - share_one
    low = difference - math.sqrt(max(0.0, down_two**2 - 2.0 * phi * down_two * up_one + up_one**2))
    high = difference + math.sqrt(max(0.0, up_two**2 - 2.0 * phi * up_two * down_one + down_one**2))
    return McNemar(both, only_first, only_second, neither, p_value, difference, low, high)


def _phi(both: int, only_first: int, only_second: int, neither: int) -> float:
    """Newcombe's φ̂: correlation of the paired outcomes, with his continuity correction; 0 where a margin is empty."""
    pairs = both + only_first + only_second + neither
    margins = (both + only_first) * (only_second + neither) * (both + only_second) * (only_first + neither)
    if margins == 0:
        return 0.0
    product = both * neither - only_first * only_second
    if product > 0:
        product = max(product - pairs / 2.0, 0.0)
    return product / math.sqrt(margins)
