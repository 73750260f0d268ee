"""Things that users bring along by name, as "package.module:Name": a detector, a pilot."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

from auvdock.core.errors import ConfigError

__all__ = ["find_named"]


def find_named(field: str, name: str) -> Callable[..., Any]:
    """The class or function that "package.module:Name" names.

    Args:
        field: the setting that holds the name, for errors.
        name: module and attribute with a colon between them.

    Raises:
        ConfigError: no such module or attribute, or a module that fails when it is imported.
    """
    module_name, _, attribute = name.partition(":")
    try:
        module = importlib.import_module(module_name)
    except Exception as error:  # a module of one's own may fail in any way
        why = f"{type(error).__name__}: {' '.join(str(error).split())}"
        remedy = f"a module that can be imported, in the current folder, installed, or on PYTHONPATH ({why})"
        raise ConfigError(field, name, remedy) from error
    found = getattr(module, attribute, None)
    if not callable(found):
        raise ConfigError(field, name, f"a class or function that {module_name} has")
    return found
