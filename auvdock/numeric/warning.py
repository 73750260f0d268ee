"""What the package's warnings have in common; here since kept code warns too."""

from __future__ import annotations

__all__ = ["AuvdockWarning"]


class AuvdockWarning(UserWarning):
    """What works all the same but may want to be put right; the command line prints it on one line."""
