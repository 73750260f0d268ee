"""What tyro says of flags that it does not understand, as one line; tyro itself draws a box of some ten lines."""

from __future__ import annotations

from auvdock.core.errors import AuvdockError

__all__ = ["FlagError", "one_line"]

_INDENT = 4
"""Columns by which tyro moves in the flags that it proposes; what it tells of each is further in."""


class FlagError(AuvdockError):
    """Flags that the command does not have, lacks, or cannot read."""


def one_line(said: str, prog: str) -> str:
    """The first part of tyro's box, which says what is wrong, and the flags that it proposes.

    Args:
        said: what tyro printed.
        prog: the command, for its help.
    """
    parts: list[list[str]] = [[]]
    for line in said.splitlines():
        if line[:2] not in ("│ ", "  "):  # where the terminal knows no UTF-8, the box has no sides
            continue  # the box's upper edge with a title, and the lower one
        inner = line[2:].removesuffix("│").rstrip()
        if inner and not inner.strip("─-"):
            parts.append([])
        else:
            parts[-1].append(inner)
    if not parts[0]:
        return " ".join(said.split())
    found = [_joined(parts[0])]
    for head, *rest in filter(None, parts[1:]):
        if head.startswith("Perhaps"):
            flags = [line.strip() for line in rest if len(line) - len(line.lstrip()) == _INDENT]
            found.append(f"perhaps you meant {', '.join(flags)}")
    return "; ".join([*found, f"see {prog} --help"])


def _joined(lines: list[str]) -> str:
    return " ".join(" ".join(lines).split()).removeprefix("Error parsing ").rstrip(".")
