"""Data that ships: vehicles, thrusters, stations, waters, levels, fitted models, scattering, halos and networks."""

from importlib.resources import files
from importlib.resources.abc import Traversable

from auvdock.core.errors import ConfigError

__all__ = ["asset", "asset_names"]


def asset_names(kind: str, ending: str = ".toml") -> tuple[str, ...]:
    """Names of the presets of one kind ("vehicles", "stations", "waters", "levels"), sorted."""
    folder = files("auvdock.assets").joinpath(kind)
    return tuple(sorted(entry.name.removesuffix(ending) for entry in folder.iterdir() if entry.name.endswith(ending)))


def asset(kind: str, name: str, ending: str = ".toml") -> Traversable:
    """The file of a preset: TOML, but for the tables of halos (".npz") and trained networks (".onnx").

    Raises:
        ConfigError: no preset of that name; the message lists those that exist.
    """
    names = asset_names(kind, ending)
    if name not in names:
        singular = kind.removesuffix("s")
        raise ConfigError(singular, name, f"one of {', '.join(names)}")
    return files("auvdock.assets").joinpath(kind, f"{name}{ending}")
