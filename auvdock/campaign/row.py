"""One row per episode: what the store holds and the report reads. Nothing in it depends on the clock."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, get_args, get_type_hints

from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.plan import EpisodeSpec
from auvdock.episode.result import LOST_REASONS, EpisodeResult

__all__ = ["RESULT_COLUMNS", "Row", "Value", "columns", "differences", "lost_row", "outcome", "row_of"]

Value = bool | int | float | str | None
Row = dict[str, Value]
"""Column name to value; None where the episode has none."""

_KEPT_ELSEWHERE = {*EpisodeResult.WALL_CLOCK_FIELDS, "versions", "config", "seed"}
_AS_JSON = "poses_by_solver"
"""Column that holds a mapping, as JSON."""


def _result_columns() -> dict[str, type]:
    hints = get_type_hints(EpisodeResult)
    kinds: dict[str, type] = {}
    for entry in fields(EpisodeResult):
        if entry.name not in _KEPT_ELSEWHERE:
            if entry.name == _AS_JSON:
                kinds[entry.name] = str
                continue
            options = [option for option in get_args(hints[entry.name]) if option is not type(None)]
            kinds[entry.name] = options[0] if options else hints[entry.name]
    return kinds


RESULT_COLUMNS: Mapping[str, type] = _result_columns()
"""Columns that come from `EpisodeResult`: all of its fields but clock, versions, configuration and seed."""


def columns(cfg: CampaignCfg) -> dict[str, type]:
    """All columns of a campaign's rows, in order: key, seed, axes, result, and what went wrong with a lost episode."""
    axes: dict[str, type] = {axis.name: cfg.kind(axis) for axis in cfg.axes}
    return {"episode": int, "seed": int, **axes, **RESULT_COLUMNS, "error": str}


def row_of(spec: EpisodeSpec, result: EpisodeResult) -> Row:
    """The row of a finished episode."""
    measured: Row = {name: getattr(result, name) for name in RESULT_COLUMNS}
    measured[_AS_JSON] = json.dumps(result.poses_by_solver)
    return {"episode": spec.episode, "seed": spec.seed, **spec.point, **measured, "error": None}


def lost_row(spec: EpisodeSpec, reason: str, error: str) -> Row:
    """The row of an episode that left no result: `hung` or `crashed`, with the reason in words."""
    nothing: Row = dict.fromkeys(RESULT_COLUMNS)
    outcome: Row = {"success": False, "failure_reason": reason}
    return {"episode": spec.episode, "seed": spec.seed, **spec.point, **nothing, **outcome, "error": error}


def outcome(row: Mapping[str, Any]) -> bool | None:
    """Whether an episode was a success; None if it left no result, which is neither success nor failure."""
    return None if row["failure_reason"] in LOST_REASONS else row["success"] is True


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Columns in which two rows differ, bit for bit."""
    names = dict.fromkeys([*one, *other])
    return [name for name in names if name not in one or name not in other or one[name] != other[name]]
