"""Data that ships with auvdock: vehicles, stations, waters, levels, fitted models."""

from importlib.resources import files
from importlib.resources.abc import Traversable

from auvdock.core.errors import ConfigError

__all__ = ["asset", "asset_names"]


def asset_names(kind: str) -> tuple[str, ...]:
    """Names of the presets of one kind ("vehicles", "stations", "waters", "levels"), sorted."""
    folder = files("auvdock.assets").joinpath(kind)
    return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml")))


def asset(kind: str, name: str) -> Traversable:
    """The TOML file of a preset.

    Raises:
        ConfigError: no preset of that name; the message lists those that exist.
    """
    names = asset_names(kind)
    if name not in names:
        singular = kind.removesuffix("s")
        raise ConfigError(singular, name, f"one of {', '.join(names)}")
    return files("auvdock.assets").joinpath(kind, f"{name}.toml")
