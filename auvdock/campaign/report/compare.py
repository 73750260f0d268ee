"""Two campaigns of the same episodes, pair by pair."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.report.cells import Campaign
from auvdock.campaign.row import Row, outcome
from auvdock.campaign.statistics import McNemar, mcnemar

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two campaigns.

    Attributes:
        first: the one reported on.
        second: the one that it is held against.
        test: on the pairs.
        changed: pairs with different outcomes, first's and second's row.
        lost: pairs beside these of which one episode or both left no result.
    """

    first: Campaign
    second: Campaign
    test: McNemar
    changed: list[tuple[Row, Row]]
    lost: int


def compare(first: Campaign, second: Campaign) -> Comparison:
    """Pair episodes by number; pairs share seed and the axes that both campaigns vary.

    Raises:
        CampaignError: campaigns that have no pairs: other seeds or other values on a shared axis.
    """
    shared = [axis.name for axis in first.cfg.axes if axis.name in {axis.name for axis in second.cfg.axes}]
    others = {row["episode"]: row for row in second.rows}
    pairs = [(row, others[row["episode"]]) for row in first.rows if row["episode"] in others]
    for one, other in pairs:
        for name in ("seed", *shared):
            if one[name] != other[name]:
                raise CampaignError(
                    f"{second.folder}: episode {one['episode']} has {name} {other[name]}, in {first.folder} it is "
                    f"{one[name]}; only campaigns of one seed and the same grid can be compared"
                )
    flown = [pair for pair in pairs if None not in (outcome(pair[0]), outcome(pair[1]))]
    if not flown:
        raise CampaignError(f"{second.folder}: shares no episode that left a result with {first.folder}")
    outcomes = [(outcome(one), outcome(other)) for one, other in flown]
    test = mcnemar(*(outcomes.count(kind) for kind in ((True, True), (True, False), (False, True), (False, False))))
    changed = [pair for pair, (one, other) in zip(flown, outcomes, strict=True) if one != other]
    return Comparison(first, second, test, changed, len(pairs) - len(flown))
