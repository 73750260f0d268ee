"""A campaign's folder: a manifest, a journal of fresh rows, and Parquet shards.

Every row is appended to `journal.jsonl` as soon as its episode ends, so a killed process loses nothing that was
finished. Full journals become a shard: written under a temporary name, synced, renamed; then the journal is emptied. A
death between the two leaves rows in both, which reading takes once.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from auvdock.campaign.config import CampaignCfg, campaign_from_plain
from auvdock.campaign.errors import CampaignError
from auvdock.campaign.journal import Journal, read_journal, readable_errors
from auvdock.campaign.lock import FolderLock
from auvdock.campaign.row import Row, columns
from auvdock.core.errors import ConfigError

__all__ = ["Store", "read_manifest", "read_table"]

MANIFEST = "manifest.json"
JOURNAL = "journal.jsonl"
TEMPORARY = ".tmp-"
SHARDS = "rows-*.parquet"
FORMAT = 1
"""Of the folder; raised when its files change meaning."""

_TYPES: dict[type, pa.DataType] = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}


def schema(cfg: CampaignCfg) -> pa.Schema:
    """Arrow schema of a campaign's rows."""
    return pa.schema([pa.field(name, _TYPES[kind]) for name, kind in columns(cfg).items()])


def read_manifest(folder: Path) -> dict[str, Any]:
    """A campaign's manifest.

    Raises:
        CampaignError: there is none, or it cannot be read.
    """
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise CampaignError(f"{folder}: holds no campaign (no {MANIFEST}); give a folder that `sweep` wrote") from error
    except (OSError, ValueError) as error:
        raise CampaignError(f"{path}: cannot be read ({error})") from error
    if manifest.get("format") != FORMAT:
        raise CampaignError(f"{path}: has format {manifest.get('format')}, this version reads {FORMAT}")
    return manifest


def read_campaign(folder: Path) -> CampaignCfg:
    """The campaign of a folder.

    Raises:
        CampaignError: no readable manifest.
        ConfigError: a manifest of another version, whose settings no longer fit.
    """
    return campaign_from_plain(read_manifest(folder)["campaign"])


def read_table(folder: Path) -> pa.Table:
    """All finished episodes of a folder, one row each, sorted by `episode`.

    Raises:
        CampaignError: no manifest, or a shard or journal that cannot be read.
    """
    wanted = schema(read_campaign(folder))
    tables = [_read_shard(path, wanted) for path in sorted(folder.glob(SHARDS))]
    tables.append(pa.Table.from_pylist(read_journal(folder / JOURNAL), wanted))
    table = pa.concat_tables(tables)
    episodes, first = np.unique(table.column("episode").to_numpy(), return_index=True)
    return table.take(first) if len(episodes) else table


class Store:
    """A campaign's folder, open for writing by this process alone."""

    def __init__(self, folder: Path, cfg: CampaignCfg, manifest: dict[str, Any], resume: bool) -> None:
        """Create the folder, or go on with what is there.

        Args:
            folder: where the campaign lives.
            cfg: the campaign.
            manifest: what else is worth knowing (versions, revision); written with the campaign.
            resume: go on with a campaign that is there; without it, one that is there is an error.

        Raises:
            CampaignError: the folder cannot be used, is in use, or holds another campaign or a broken file.
        """
        self.folder = folder
        self._schema = schema(cfg)
        self._shard_rows = max(100, cfg.episodes // 100)
        with readable_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
        self._lock = FolderLock(folder)
        try:
            sessions: list[Any] = []
            if (folder / MANIFEST).exists():
                if not resume:
                    raise CampaignError(f"{folder}: holds a campaign; add --resume to go on, or give another --out")
                there = read_manifest(folder)
                _check_same(campaign_from_plain(there["campaign"]), cfg)
                if there["base_config"] != manifest["base_config"]:
                    raise CampaignError(f"{folder}: begun when level {cfg.level} was another; give another --out")
                sessions = there["sessions"]
            self.is_mixed = any(_software(session) != _software(manifest["session"]) for session in sessions)
            """Earlier rows come from other versions."""
            fixed = {name: value for name, value in manifest.items() if name != "session"}
            self._write_manifest({"format": FORMAT, **fixed, "sessions": [*sessions, manifest["session"]]})
            for leftover in folder.glob(f"{TEMPORARY}*"):
                leftover.unlink()
            rows = read_table(folder).column("episode").to_pylist() if resume else []
            self.finished: set[int] = set(rows)
            self._fresh = _without(read_journal(folder / JOURNAL), self._in_shards())
            self._journal = Journal(folder / JOURNAL)
            if self._fresh:
                self.flush()
            else:
                self._journal.empty()
        except BaseException:
            self._lock.release()
            raise

    def add(self, row: Row) -> None:
        """Keep one row.

        Raises:
            CampaignError: it cannot be written; what was written before stays.
        """
        self._journal.add(row)
        self._fresh.append(row)
        self.finished.add(int(row["episode"] or 0))
        if len(self._fresh) >= self._shard_rows:
            self.flush()

    def flush(self) -> None:
        """Turn the journal into a shard."""
        if not self._fresh:
            return
        numbers = [int(path.stem.removeprefix("rows-")) for path in self.folder.glob(SHARDS)]
        name = f"rows-{max(numbers, default=-1) + 1:06d}.parquet"
        temporary = self.folder / f"{TEMPORARY}{name}"
        ordered = sorted(self._fresh, key=lambda row: int(row["episode"] or 0))
        with readable_errors(self.folder):
            try:
                with temporary.open("wb") as file:  # Arrow takes no name that is not UTF-8
                    pq.write_table(pa.Table.from_pylist(ordered, self._schema), file)
                _sync(temporary)
                temporary.replace(self.folder / name)
                _sync(self.folder)
            except OSError:
                with suppress(OSError):
                    temporary.unlink(missing_ok=True)
                raise
        self._fresh = []
        self._journal.empty()

    def close(self) -> None:
        """Flush and give the folder free."""
        try:
            self.flush()
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Give the folder free as it is; the journal keeps what is in no shard."""
        self._journal.close()
        self._lock.release()

    def _write_manifest(self, manifest: dict[str, Any]) -> None:
        temporary = self.folder / f"{TEMPORARY}{MANIFEST}"
        with readable_errors(self.folder):
            temporary.write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
            _sync(temporary)
            temporary.replace(self.folder / MANIFEST)

    def _in_shards(self) -> set[int]:
        found: set[int] = set()
        for path in self.folder.glob(SHARDS):
            found.update(_read_shard(path, self._schema).column("episode").to_pylist())
        return found


def _read_shard(path: Path, wanted: pa.Schema) -> pa.Table:
    try:
        with path.open("rb") as file, pq.ParquetFile(file) as shard:  # ten times as fast as read_table on a small file
            table = shard.read()
    except (pa.ArrowException, OSError, ValueError) as error:
        short = str(error).splitlines()[0]
        raise CampaignError(f"{path}: is damaged ({short}); delete it, --resume runs its episodes again") from error
    if table.schema.names != wanted.names:
        raise CampaignError(f"{path}: has other columns than this version writes; use the version in {MANIFEST}")
    return table.cast(wanted)


def _without(rows: Iterable[Row], episodes: set[int]) -> list[Row]:
    kept: dict[int, Row] = {}
    for row in rows:
        episode = int(row["episode"] or 0)
        if episode not in episodes:
            kept.setdefault(episode, row)
    return list(kept.values())


def _check_same(there: CampaignCfg, wanted: CampaignCfg) -> None:
    for name in ("station", "seed", "axes", "sampling", "level", "episode", "waters"):
        if getattr(there, name) != getattr(wanted, name):
            raise ConfigError(
                name, getattr(wanted, name), f"{getattr(there, name)!r} as the campaign has it, to resume"
            )
    redrawn = wanted.sampling == "latin_hypercube" and any(not axis.is_grid for axis in wanted.axes)
    if redrawn and there.episodes != wanted.episodes:
        raise ConfigError("episodes", wanted.episodes, f"{there.episodes}: a Latin hypercube cannot be extended")


def _software(session: dict[str, Any]) -> tuple[object, object]:
    return session["versions"], session["git_revision"]


def _sync(path: Path) -> None:
    if os.name == "nt" and path.is_dir():  # Windows writes a folder's entries through, and opens no folder
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
