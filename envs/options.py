"""The arguments that all environments take, and how they change a world's configuration."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, TypeVar

from auvdock.core.errors import ConfigError
from auvdock.core.strict import merge
from auvdock.envs.reward import RewardCfg
from auvdock.envs.vehicle_world import AnyWorldCfg

__all__ = ["OBSERVATIONS", "check_options", "reward_settings", "world_settings"]

OBSERVATIONS = ("state", "pose", "image")

W = TypeVar("W", bound=AnyWorldCfg)
T = TypeVar("T")


def world_settings(
    default: W, cfg: object, observation: str, fidelity: str | None, start: object, time_limit_s: float | None
) -> W:
    """The world that an environment's arguments ask for.

    Args:
        default: the world where no `cfg` is given.
        cfg: the world, of the default's kind.
        observation: one of `OBSERVATIONS`.
        fidelity: in place of the `cfg`'s; without either, "pixels" for images and "beacons" for the rest.
        start: of the kind of the `cfg`'s and in its place, or a mapping that changes only the fields that it names.
        time_limit_s: in place of `cfg.limits.max_time_s`.

    Raises:
        ConfigError: an argument that cannot be used, by its name.
    """
    if cfg is None:
        world = dataclasses.replace(default, fidelity="pixels" if observation == "image" else "beacons")
    elif isinstance(cfg, type(default)):
        world = cfg
    else:
        raise ConfigError("cfg", type(cfg).__name__, f"a {type(default).__name__}")
    if fidelity is not None:
        world = dataclasses.replace(world, fidelity=fidelity)
    if start is not None:
        world = dataclasses.replace(world, start=_changed("start", world.start, start))
    if time_limit_s is not None:
        limits = dataclasses.replace(world.limits, max_time_s=_seconds(time_limit_s))
        world = dataclasses.replace(world, limits=limits)
    return world


def reward_settings(reward: RewardCfg | Mapping[str, Any] | None) -> RewardCfg:
    """The reward that an environment's argument asks for: all of it, or changes to the default.

    Raises:
        ConfigError: a part that does not exist or a value that does not fit.
    """
    return RewardCfg() if reward is None else _changed("reward", RewardCfg(), reward)


def check_options(
    observation: str, fidelity: str | None, render_mode: str | None, camera: str, cameras: tuple[str, str]
) -> None:
    """Refuse options that do not exist or do not fit each other.

    Raises:
        ConfigError: the first such option.
    """
    if observation not in OBSERVATIONS:
        raise ConfigError("observation", observation, f"one of {', '.join(OBSERVATIONS)}")
    if render_mode not in (None, "rgb_array"):
        raise ConfigError("render_mode", render_mode, "'rgb_array' or None")
    if camera not in cameras:
        raise ConfigError("render_camera", camera, " or ".join(repr(name) for name in cameras))
    if observation == "image" and fidelity != "pixels":
        raise ConfigError("fidelity", fidelity, "'pixels', image observations need rendered frames")


def _changed(name: str, now: T, wanted: object) -> T:
    """`wanted` itself if it is of the kind of `now`, or `now` with what a mapping names changed."""
    if isinstance(wanted, type(now)):
        return wanted
    if isinstance(wanted, Mapping):
        return merge(now, wanted, f"{name}.")
    raise ConfigError(name, wanted, f"a {type(now).__name__} or a mapping of its fields")


def _seconds(value: object) -> float:
    """A time limit, checked."""
    if isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < math.inf:
        return float(value)
    raise ConfigError("time_limit_s", value, "a number of seconds above 0")
