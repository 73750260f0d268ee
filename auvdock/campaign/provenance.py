"""Where results come from: versions and git revision."""

from __future__ import annotations

import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import auvdock
from auvdock.campaign.config import CampaignCfg
from auvdock.core.strict import to_plain
from auvdock.episode.runner import software_versions

__all__ = ["git_revision", "manifest_of"]


def manifest_of(cfg: CampaignCfg) -> dict[str, Any]:
    """What a campaign's manifest tells: the campaign, its resolved base configuration, and this session's software."""
    return {
        "campaign": to_plain(cfg),
        "base_config": to_plain(cfg.base(cfg.level)),
        "session": {
            "begun": datetime.now(UTC).isoformat(timespec="seconds"),
            "versions": software_versions(),
            "git_revision": git_revision(),
        },
    }


def git_revision() -> str | None:
    """Revision of the checkout that the package runs from, with "+changes" if it was edited; None if it is none."""
    package = Path(auvdock.__file__).resolve().parent
    top = _git(package, "rev-parse", "--show-toplevel")
    if top is None or Path(top).resolve() != package.parent:
        return None  # installed into somebody else's repository
    revision = _git(package, "rev-parse", "HEAD")
    changes = _git(package.parent, "status", "--porcelain", "--untracked-files=no")
    return f"{revision}+changes" if revision and changes else revision


def _git(folder: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words], capture_output=True, text=True, timeout=10, check=False
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
