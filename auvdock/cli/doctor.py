"""`auvdock doctor`: what works on this machine and what to install for the rest."""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

from rich.table import Table
from rich.text import Text

from auvdock.cli.console import output
from auvdock.cli.parsing import parse
from auvdock.core.errors import AuvdockError
from auvdock.numeric.compiled import cache_folders
from auvdock.numeric.kept_code import examine_folder

__all__ = ["Check", "Doctor", "compiled_loops", "examine", "run"]

PACKAGES = (
    "mujoco",
    "gymnasium",
    "numpy",
    "scipy",
    "opencv-python-headless",
    "onnxruntime",
    "control",
    "numba",
    "filelock",
)


@dataclass(frozen=True)
class Doctor:
    """Tell what works here and what to install. Exit code 1 if something that every episode needs is missing."""

    json: bool = False
    """Print one JSON object and nothing else."""


@dataclass(frozen=True)
class Check:
    """One finding."""

    name: str
    ok: bool
    required: bool
    detail: str
    remedy: str = ""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Doctor, argv, prog)
    checks = examine()
    if args.json:
        print(json.dumps({"checks": [asdict(check) for check in checks]}))
    else:
        table = Table(title="auvdock doctor", title_justify="left")
        for column in ("part", "state", "detail", "remedy"):
            table.add_column(column)
        for check in checks:
            state = Text("ok", "green") if check.ok else Text("missing", "red") if check.required else "not ok"
            table.add_row(check.name, state, check.detail, check.remedy)
        output().print(table)
    return 1 if any(check.required and not check.ok for check in checks) else 0


def examine() -> list[Check]:
    """All findings."""
    python_ok = sys.version_info >= (3, 11)
    checks = [Check("Python", python_ok, True, platform.python_version(), "" if python_ok else "Python 3.11 or newer")]
    checks += [_package(name) for name in PACKAGES]
    checks.append(_try("OpenGL (fidelity pixels)", False, _open_gl))
    checks.append(_try("ONNX Runtime", True, _onnx))
    checks.append(compiled_loops())
    checks.append(_viewer())
    ray = importlib.util.find_spec("ray") is not None
    checks.append(Check("Ray (many machines)", ray, False, "importable" if ray else "not installed"))
    checks.append(Check("processor cores", True, True, str(os.cpu_count())))
    return checks


def _package(name: str) -> Check:
    try:
        return Check(name, True, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, True, "not installed", f"pip install {name}")


def _try(name: str, required: bool, probe: Callable[[], str]) -> Check:
    try:
        return Check(name, True, required, probe())
    except AuvdockError as error:
        return Check(name, False, required, "no context", str(error))
    except ImportError as error:
        return Check(name, False, required, "not importable", str(error))


def _open_gl() -> str:
    from auvdock.optics.gl import probe_gl

    return probe_gl()


def _onnx() -> str:
    import onnxruntime

    return ", ".join(onnxruntime.get_available_providers())


def compiled_loops() -> Check:
    """Read all that is kept of what an episode needs, and write to where the rest would go."""
    try:
        import_module("auvdock.episode.runner")  # loads what an episode needs
    except ImportError as error:
        return Check("compiled loops", False, False, f"not loaded ({error})")
    modules = [module for name, module in sys.modules.items() if name.startswith("auvdock.")]
    places = {cache_folders(value) for module in modules for value in vars(module).values()} - {()}
    whole = damaged = bare = 0
    used: list[str] = []
    closed: list[str] = []
    spoiled: list[str] = []
    for folders in sorted(places):
        why, before = "", whole
        for folder in folders:
            state = examine_folder(folder)
            whole, damaged = whole + state.whole, damaged + state.damaged
            used += [str(folder)] * (state.whole > 0)
            spoiled += [str(folder)] * (state.damaged > 0)
            if state.unwritable is None:
                break
            why = why or f"{folder}: {state.unwritable}"
        else:
            closed.append(why)
            bare += whole == before
    detail = f"{whole} kept under {os.path.commonpath(used)}" if whole else "none kept yet, the first run compiles them"
    remedies: list[str] = []
    if damaged:
        detail += f", {damaged} damaged in {', '.join(spoiled)}"
        remedies.append("what is damaged is left aside and compiled anew when needed; or delete it")
    if closed:
        detail += f"; nothing more can be kept ({closed[0]})"
        remedies.append(
            "what is missing is compiled in every process, up to a minute: make room or set NUMBA_CACHE_DIR"
        )
    # Full folders that cannot be written are as good as any: a read-only installation.
    return Check("compiled loops", not damaged and not bare, False, detail, "; ".join(remedies))


def _viewer() -> Check:
    found = shutil.which("rerun", path=os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", "")]))
    remedy = "" if found else "pip install rerun-sdk"
    return Check("Rerun viewer", found is not None, False, version("rerun-sdk") if found else "not found", remedy)
