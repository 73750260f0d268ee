"""Opens a recording in Rerun's viewer."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from auvdock.core.errors import AuvdockError, ConfigError

__all__ = ["view"]

_MAGIC = b"RRF"
_LAUNCH = "import sys; from rerun_cli.__main__ import main; sys.exit(main())"
"""`python -m rerun_cli` would lose the viewer's exit code."""
_SOURCE_PLACE = re.compile(r"(os error at )?\S+\.rs:\d+: ")


def view(path: Path) -> None:
    """Show a recording and wait until its window is closed.

    If a viewer is open already, the recording opens in that one and the call returns at once.

    Raises:
        ConfigError: no such file, or not a recording.
        AuvdockError: the viewer could not be started, for want of a display as a rule.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(len(_MAGIC))
    except OSError as error:
        raise ConfigError("path", str(path), f"a recording that can be read ({error.strerror})") from error
    if magic != _MAGIC:
        raise ConfigError("path", str(path), "a recording in Rerun's format, as --record writes it")
    # The viewer listens for further recordings; on the loopback address only, not to the whole network.
    command = [sys.executable, "-c", _LAUNCH, "--bind", "127.0.0.1", str(path.resolve())]
    try:
        finished = subprocess.run(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace", check=False
        )
    except OSError as error:
        raise AuvdockError(f"Rerun's viewer cannot be started: {error}") from error
    if finished.returncode != 0:
        raise AuvdockError(
            f"Rerun's viewer stopped with code {finished.returncode}: {_reason(finished.stderr)}; it needs a display "
            "and a graphics driver: open the file on a machine that has them, or run `rerun --web-viewer FILE`"
        )


def _reason(stderr: str) -> str:
    """The line that says most: the last error, else the last line; without the places in the viewer's own source."""
    lines = [_SOURCE_PLACE.sub("", line).strip().rstrip(".") for line in stderr.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("Error")]
    return (errors or lines or ["no message"])[-1]
