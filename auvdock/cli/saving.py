"""What a command writes beside the result that it prints: a file that cannot be written does not cost the result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from auvdock.cli.console import tell
from auvdock.cli.exit_codes import with_unwritten
from auvdock.core.errors import AuvdockError

__all__ = ["Saving"]


class Saving:
    """Writes files; remembers which could not be written, for one line each and for the exit code."""

    def __init__(self) -> None:
        """Nothing is written yet."""
        self._errors: dict[Path, str | None] = {}

    @property
    def written(self) -> list[str]:
        """Files that are there."""
        return [str(path) for path, error in self._errors.items() if error is None]

    @property
    def errors(self) -> list[str]:
        """One line for each file that is missing or incomplete."""
        return [error for error in self._errors.values() if error is not None]

    def note(self, path: Path, error: str | None) -> None:
        """A file is there, or there is an error; of a file that is written several times the last counts."""
        self._errors[path] = error

    def attempt(self, path: Path, write: Callable[[Path], object]) -> None:
        """Write a file; an error of the file system, or one that the user can put right, is kept for later."""
        try:
            write(path)
        except OSError as error:
            self.note(path, f"{path} could not be written: {error.strerror or error}")
        except AuvdockError as error:
            self.note(path, str(error))
        else:
            self.note(path, None)

    def text(self, path: Path, text: str) -> None:
        """Write a text file."""
        self.attempt(path, lambda there: there.write_text(text, encoding="utf-8"))

    def finish(self, code: int) -> int:
        """Tell what is missing, after the result; the exit code of the command, which is `code` if nothing is."""
        for error in self.errors:
            tell(f"error: {error}")
        return with_unwritten(code) if self.errors else code
