"""Errors of a campaign that its user can put right."""

from __future__ import annotations

from auvdock.core.errors import AuvdockError

__all__ = ["CampaignError"]


class CampaignError(AuvdockError):
    """The store cannot be used, the workers cannot run, or all episodes fail in the same way."""
