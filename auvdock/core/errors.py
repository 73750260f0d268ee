"""Errors that a user can act on."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from auvdock.numeric.warning import AuvdockWarning

__all__ = ["AuvdockError", "AuvdockWarning", "ConfigError", "GraphicsError", "located"]


class AuvdockError(Exception):
    """Anything that the user, not the code, can put right; the command line prints it on one line, exit code 2."""


class ConfigError(AuvdockError):
    """A setting that cannot be used.

    Who checks a setting names it as seen from where it stands: a dataclass by its own field (`lateral_m`), one that
    relates two of its parts by their path from it (`camera.rate_hz`). Who knows where that part lies in the whole (the
    strict reader, the world that makes its camera) puts the way there before it; see `located`.

    Args:
        field: dotted name of the setting.
        value: what was given.
        remedy: what would be right, as a phrase that completes "give ...".
    """

    def __init__(self, field: str, value: object, remedy: str) -> None:
        """Compose the one-line message."""
        self.field = field
        self.value = value
        self.remedy = remedy
        super().__init__(f"{field}: {_shown(value)} cannot be used; give {remedy}")

    def __reduce__(self) -> tuple[type[ConfigError], tuple[str, object, str]]:
        """Pickle by the three arguments, so that worker processes can hand the error over."""
        return type(self), (self.field, self.value, self.remedy)


class GraphicsError(AuvdockError):
    """No OpenGL context could be had for offscreen rendering."""


@contextmanager
def located(path: str) -> Generator[None]:
    """Put `path` ("world.start.") before the field of every `ConfigError` that is raised inside and lacks it."""
    try:
        yield
    except ConfigError as error:
        if error.field.startswith(path):
            raise
        raise ConfigError(f"{path}{error.field}", error.value, error.remedy) from error


def _shown(value: object) -> str:
    try:
        return repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return f"a {type(value).__name__} with too many digits to show"
