"""Errors that a user can act on."""

from __future__ import annotations

__all__ = ["AuvdockError", "AuvdockWarning", "ConfigError", "GraphicsError"]


class AuvdockError(Exception):
    """Anything that the user, not the code, can put right; the command line prints it on one line, exit code 2."""


class ConfigError(AuvdockError):
    """A setting that cannot be used.

    Args:
        field: dotted name of the setting, as the user wrote it.
        value: what was given.
        remedy: what would be right, as a phrase that completes "give ...".
    """

    def __init__(self, field: str, value: object, remedy: str) -> None:
        """Compose the one-line message."""
        self.field = field
        self.value = value
        self.remedy = remedy
        super().__init__(f"{field}: {value!r} cannot be used; give {remedy}")

    def __reduce__(self) -> tuple[type[ConfigError], tuple[str, object, str]]:
        """Pickle by the three arguments, so that worker processes can hand the error over."""
        return type(self), (self.field, self.value, self.remedy)


class GraphicsError(AuvdockError):
    """No OpenGL context could be had for offscreen rendering."""


class AuvdockWarning(UserWarning):
    """What works all the same but may want to be put right; the command line prints it on one line."""
