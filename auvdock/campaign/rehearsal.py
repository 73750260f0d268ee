"""What a campaign's episodes refuse, found before anything is written."""

from __future__ import annotations

from auvdock.campaign.config import CampaignCfg
from auvdock.core.errors import AuvdockError
from auvdock.episode.runner import EpisodeRunner

__all__ = ["rehearse"]


def rehearse(cfg: CampaignCfg) -> None:
    """Make world, detector and pilot for every value of every axis, as the workers will, and fly nothing.

    Names of waters, detectors and pilots, and what only fits some of them, are known when these are made. No OpenGL
    context is made; a world takes some hundredths of a second, a landing's a quarter of one.

    Raises:
        AuvdockError: what some episode refuses.
    """
    for point in cfg.points():
        level = dict(zip((axis.name for axis in cfg.axes), point, strict=True)).get("level", cfg.level)
        episode = cfg.base(int(level)).override(cfg.changes_at(point))
        try:
            EpisodeRunner(episode).world.close()
        except AuvdockError:
            raise
        except Exception:  # a detector or pilot of one's own may fail in any way; its episodes' rows will tell
            continue
