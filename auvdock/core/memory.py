"""How a process of our own collects garbage. Only entry points call this, never a library function."""

from __future__ import annotations

import gc

__all__ = ["relax_collector"]

_YOUNG = 20_000


def relax_collector() -> None:
    """Look for reference cycles more rarely, and never again among what is there already.

    An episode makes thousands of short-lived tuples a second and hardly a cycle; with Python's own thresholds the
    search for cycles takes some 5 % of the `beacons` loop. Reference counting frees all that is no cycle at once.
    """
    gc.freeze()
    gc.set_threshold(_YOUNG, 20, 100)
