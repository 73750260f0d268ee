"""Flags that decide what the others mean, read before tyro reads them all: level, settings file, station, campaign."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NoReturn

from auvdock.cli.flag_errors import FlagError

__all__ = ["find_flags"]


class _Finder(argparse.ArgumentParser):
    """Raises instead of printing its usage and ending the program."""

    def error(self, message: str) -> NoReturn:
        raise FlagError(message)


def find_flags(argv: Sequence[str], *names: str) -> dict[str, str | None]:
    """The values of some flags, None for those that are not given; whatever else there is is left to others.

    Args:
        argv: what the user gave.
        names: of flags that take one value, without their dashes.

    Raises:
        FlagError: a flag without its value.
    """
    finder = _Finder(add_help=False, allow_abbrev=False)
    for name in names:
        finder.add_argument(f"--{name}", default=None)
    return vars(finder.parse_known_args(list(argv))[0])
