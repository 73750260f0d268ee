"""Whether the optional extra that networks need is installed."""

from __future__ import annotations

from importlib import import_module

from auvdock.core.errors import AuvdockError

__all__ = ["need_torch"]


def need_torch() -> None:
    """Tell in one line what to install where PyTorch is missing; called before what needs it is imported.

    Raises:
        AuvdockError: PyTorch cannot be imported.
    """
    try:
        import_module("torch")
    except ImportError as error:
        remedy = "pip install 'auvdock[train]'"
        raise AuvdockError(f"networks need PyTorch, which cannot be imported ({error}); {remedy}") from error
