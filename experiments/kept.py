"""Finished pieces of a long experiment, kept in a folder, so that a run that was killed goes on where it stopped.

A piece is found again by everything that it depends on, the versions of the software among them. The git revision is
written beside it but not asked for: a page of documentation would throw hours away. `revisions` tells of a mixture.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.journal import Journal, read_journal
from auvdock.campaign.provenance import git_revision
from auvdock.core.strict import from_mapping, to_plain
from auvdock.episode.runner import software_versions

__all__ = ["Kept"]

T = TypeVar("T")


class Kept:
    """One file of pieces, or none: then nothing is found and nothing kept."""

    def __init__(self, path: Path | None = None) -> None:
        """Read what is there.

        Raises:
            CampaignError: the file cannot be read or written, or holds a damaged line.
        """
        self._versions = software_versions()
        self._revision = git_revision()
        self._pieces: dict[str, tuple[Any, str | None]] = {}
        self.revisions: set[str | None] = set()
        """Git revisions of the pieces that were found or added."""
        if path is not None:
            for number, row in enumerate(read_journal(path), start=1):
                if not {"key", "value", "revision"} <= set(row):
                    raise CampaignError(f"{path}: line {number} holds no finished piece; delete it")
                self._pieces[_text(row["key"])] = row["value"], row["revision"]
        self._journal = Journal(path) if path is not None else None

    def find(self, cls: type[T], key: Mapping[str, Any]) -> T | None:
        """The piece of a key, a dataclass; None if it was not finished."""
        value, revision = self._pieces.get(_text(self._whole(key)), (None, None))
        if value is None:
            return None
        self.revisions.add(revision)
        return from_mapping(cls, value)

    def add(self, key: Mapping[str, Any], piece: Any) -> None:  # noqa: ANN401 - any dataclass
        """Keep a piece.

        Raises:
            CampaignError: it cannot be written.
        """
        self.revisions.add(self._revision)
        if self._journal is not None:
            row = {"key": to_plain(self._whole(key)), "value": to_plain(piece), "revision": self._revision}
            self._journal.add(row)

    def close(self) -> None:
        """Close the file."""
        if self._journal is not None:
            self._journal.close()

    def _whole(self, key: Mapping[str, Any]) -> dict[str, Any]:
        return {**key, "versions": self._versions}


def _text(key: Mapping[str, Any]) -> str:
    return json.dumps(to_plain(key), sort_keys=True)
