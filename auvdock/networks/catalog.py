"""Models by name: `assets/networks/models.toml` says of which graph and which changes each is made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from importlib.resources.abc import Traversable
from typing import Annotated

from auvdock.assets import asset
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.limits import Count, at_least
from auvdock.core.reader import from_mapping
from auvdock.core.strict import load_toml, read_toml
from auvdock.networks.config import ChangeCfg, NetworkCfg

__all__ = ["ModelCfg", "load_model", "model_names"]


@dataclass(frozen=True)
class ModelCfg(Checked):
    """One model."""

    graph: str
    """Name of a file in `assets/networks/graphs`."""
    changes: tuple[str, ...] = ()
    """Names of files in `assets/networks/changes`, made one after the other."""
    classes: Count = 1
    """How many kinds of objects."""
    keypoints: Annotated[int, at_least(0)] = 1
    """Keypoints of an object."""

    def network(self) -> NetworkCfg:
        """The graph with its changes, classes and keypoints.

        Raises:
            ConfigError: no such graph or change, or one that does not fit.
        """
        cfg = load_toml(NetworkCfg, _file("graphs", self.graph))
        for name in self.changes:
            with located(f"{name}."):
                cfg = cfg.changed(load_toml(ChangeCfg, _file("changes", name)))
        return replace(cfg, head=replace(cfg.head, classes=self.classes, keypoints=self.keypoints))


def model_names() -> tuple[str, ...]:
    """All models, in the order of the papers."""
    return tuple(_models())


def load_model(name: str) -> NetworkCfg:
    """A model by name.

    Raises:
        ConfigError: no such model.
    """
    models = _models()
    if name not in models:
        raise ConfigError("model", name, f"one of {', '.join(models)}")
    return models[name].network()


@cache
def _models() -> dict[str, ModelCfg]:
    tables = read_toml(asset("networks", "models"))
    return {name: from_mapping(ModelCfg, table, f"{name}.") for name, table in tables.items()}


def _file(kind: str, name: str) -> Traversable:
    return asset(f"networks/{kind}", name)
