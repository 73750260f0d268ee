"""`auvdock COMMAND ...`: finds and runs it; whatever goes wrong becomes one line and an exit code of its own."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from importlib import import_module

from auvdock.cli import exit_codes
from auvdock.cli.console import tell
from auvdock.cli.crash import report_crash
from auvdock.cli.notices import told_once, unusable_gl
from auvdock.cli.streams import forgiving_streams
from auvdock.core.errors import AuvdockError
from auvdock.core.memory import relax_collector

__all__ = ["COMMANDS", "find_run", "main"]

COMMANDS: dict[tuple[str, ...], tuple[str, str]] = {
    ("dock", "conical"): ("auvdock.cli.dock:run_conical", "dock into the conical station, one episode"),
    ("dock", "rotating"): ("auvdock.cli.dock_rotating:run_rotating", "dock by the rotating beacon, from any side"),
    ("dock", "landing"): ("auvdock.cli.dock_landing:run_landing", "land on the platform, one episode"),
    ("dock",): ("auvdock.cli.dock_from:run_from", "--from DIR#EPISODE: an episode of a campaign again"),
    ("sweep",): ("auvdock.cli.sweep:run", "run many episodes over currents, turbidity and more"),
    ("report",): ("auvdock.cli.report:run", "turn a campaign into one HTML page and tables for a paper"),
    ("perceive",): ("auvdock.cli.perceive:run", "perceive lights, tags and poses in footage of your own"),
    ("view",): ("auvdock.cli.view:run", "open a recording in the Rerun viewer"),
    ("plan",): ("auvdock.cli.plan:run", "tell where a station's lights can be seen"),
    ("reproduce", "guidance-space"): (
        "auvdock.cli.reproduce:run_guidance_space",
        "paper A's guidance-space tables beside ours",
    ),
    ("reproduce", "guidance-region"): (
        "auvdock.cli.reproduce:run_guidance_region",
        "the planned guidance space beside rendered frames",
    ),
    ("reproduce", "guidance-design"): (
        "auvdock.cli.plan_design:run_guidance_design",
        "optimised arrays against paper A's ring of six",
    ),
    ("reproduce", "azimuth"): (
        "auvdock.cli.reproduce_beacon:run_azimuth",
        "paper B's azimuth errors beside its method here and ours",
    ),
    ("reproduce", "deviation"): (
        "auvdock.cli.reproduce_beacon:run_deviation",
        "paper B's deviation-angle errors beside its method here and ours",
    ),
    ("reproduce", "rotating-docking"): (
        "auvdock.cli.reproduce_rotating:run_rotating_docking",
        "docking by the rotating beacon, with and without it",
    ),
    ("reproduce", "landing-trials"): (
        "auvdock.cli.landing_trials:run_landing_trials",
        "paper C's ten landings beside ours, each level alone and both",
    ),
    ("reproduce", "halo"): (
        "auvdock.cli.reproduce_halo:run_halo",
        "the light about a lamp against single photons",
    ),
    ("reproduce", "models"): (
        "auvdock.cli.reproduce_models:run_models",
        "sizes of the papers' networks and ablation rows beside ours",
    ),
    ("reproduce", "vehicle"): (
        "auvdock.cli.reproduce_vehicle:run_vehicle",
        "the vehicles' speeds, stability and turning beside published runs",
    ),
    ("reproduce", "detection-a"): (
        "auvdock.cli.reproduce_detection:run_detection_a",
        "paper A's detection of lights: threshold, blob and its network",
    ),
    ("bench",): ("auvdock.cli.bench:run", "measure this machine's speed"),
    ("fit-detector",): ("auvdock.cli.fit:run", "fit the beacons fidelity to a detector's behaviour on rendered frames"),
    ("fit-landing",): (
        "auvdock.cli.fit_landing:run",
        "fit the beacons fidelity of a landing to detectors of lights and tags",
    ),
    ("dataset",): ("auvdock.cli.dataset:run", "render labelled frames for learned detectors"),
    ("train",): ("auvdock.cli.train:run", "train a detection network on labelled frames"),
    ("export",): ("auvdock.cli.export:run", "write a trained network as an ONNX file"),
    ("doctor",): ("auvdock.cli.doctor:run", "tell what works on this machine and what to install"),
}
"""Words of a command: where it lives (imported only when asked for) and what it does."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line.

    Returns:
        One of `auvdock.cli.exit_codes`: 0 on success, 1 if an episode failed to dock, 2 on input that cannot be used,
        70 after an exception that nobody foresaw, 74 or 75 if something could not be written (0 or 1 otherwise), 130 if
        interrupted, 141 if nobody reads standard output any more.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    with forgiving_streams() as (out, _):
        code = _answer(words)
        out.flush()
        if out.error is None:
            return code
        if out.error.errno == errno.EPIPE:
            return exit_codes.BROKEN_PIPE
        tell(f"error: standard output could not be written: {out.error.strerror}")
        return exit_codes.with_unwritten(code)


def find_run(command: tuple[str, ...]) -> Callable[[Sequence[str], str], int]:
    """The function that runs one of `COMMANDS`, from the words after it and its name."""
    module, function = COMMANDS[command][0].split(":")
    return getattr(import_module(module), function)


def _answer(words: list[str]) -> int:
    try:
        command = _find(words)
        if command is None:
            return _usage(words)
        run = find_run(command)
        relax_collector()
        _find_modules_here()
        from auvdock.numeric.compiled import compiling  # half a second, not for a usage message

        with told_once(), nullcontext() if "--json" in words else compiling(_tell_of_compiling):
            code = run(words[len(command) :], "auvdock " + " ".join(command))
        unusable_gl()
        return code
    except AuvdockError as error:
        tell(f"error: {error}")
        return exit_codes.BAD_INPUT
    except KeyboardInterrupt:
        tell("interrupted")
        return exit_codes.INTERRUPTED
    except SystemExit as stop:  # tyro's, after --help
        if stop.code is None or isinstance(stop.code, int):
            return stop.code or exit_codes.DONE
        report_crash(stop, words)
        return exit_codes.FAULT
    except Exception as error:
        report_crash(error, words)
        return exit_codes.FAULT


def _find_modules_here() -> None:
    """Let detectors and pilots of one's own be found in the current folder, in worker processes too.

    After everything else: a file there must not stand in for a module of the same name that something here needs.
    """
    with suppress(OSError):  # the folder may be gone
        if (here := os.getcwd()) not in sys.path:
            sys.path.append(here)


def _tell_of_compiling() -> None:
    tell("compiling inner loops, once after an installation: up to a minute")


def _find(words: Sequence[str]) -> tuple[str, ...] | None:
    for command in COMMANDS:
        if tuple(words[: len(command)]) == command:
            return command
    return None


def _usage(words: Sequence[str]) -> int:
    asked = bool(words) and words[0] in ("-h", "--help")
    out = sys.stdout if asked else sys.stderr
    if words and words[0] == "--version":
        from auvdock import __version__

        print(__version__)
        return exit_codes.DONE
    if words and not asked:
        known = ", ".join(" ".join(command) for command in COMMANDS)
        tell(f"error: command: {' '.join(words[:2])!r} is unknown; give one of: {known}")
        return exit_codes.BAD_INPUT
    print("usage: auvdock COMMAND [--help] ...\n", file=out)
    for command, (_, summary) in COMMANDS.items():
        print(f"  {' '.join(command):26s} {summary}", file=out)
    return exit_codes.DONE if asked else exit_codes.BAD_INPUT
