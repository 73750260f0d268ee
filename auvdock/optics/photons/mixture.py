"""Names of mixed phase functions: "0.25*petzold-clear+0.75*petzold-coastal", each with its share of all scattering."""

from __future__ import annotations

import math
from collections.abc import Mapping

from auvdock.core.errors import ConfigError

__all__ = ["mixture_name", "shares_of"]


def mixture_name(shares: Mapping[str, float]) -> str:
    """The name of a mixture, from the share of b of each phase function; `shares_of` reads it back to the bit."""
    return "+".join(f"{share!r}*{name}" for name, share in shares.items())


def shares_of(name: str) -> dict[str, float]:
    """Shares of the phase functions in a name, in order; one that is not mixed has all.

    Raises:
        ConfigError: shares that are no numbers above 0 with the sum 1, or one name twice.
    """
    if "*" not in name:
        return {name: 1.0}
    shares: dict[str, float] = {}
    for part in name.split("+"):
        share, _, phase = part.strip().partition("*")
        try:
            shares[phase.strip()] = float(share)
        except ValueError:
            shares[phase.strip()] = math.nan
    if not (all(share > 0.0 for share in shares.values()) and abs(sum(shares.values()) - 1.0) < 1e-9):
        remedy = "a mixture such as 0.25*petzold-clear+0.75*petzold-coastal, its shares of scattering with the sum 1"
        raise ConfigError("phase", name, remedy)
    return shares
