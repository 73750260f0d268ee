"""OpenGL contexts: threads hand one over, a fork works or refuses at once, and what cannot draw is found out."""

import os
import re
import subprocess
import sys
import threading
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import auvdock
from auvdock.cli.dock_flags import working_fidelity
from auvdock.cli.doctor import _open_gl, _try
from auvdock.core.errors import GraphicsError
from auvdock.envs.chase import ChaseCamera
from auvdock.optics import gl_driver
from auvdock.optics.gl import StaticRenderer, probe_gl
from auvdock.optics.gl_driver import Driver
from auvdock.sim.mj import mujoco

WALL = '<mujoco><worldbody><geom type="box" pos="0 0 3" size="2 2 1" rgba="0.2 0.6 0.9 1"/></worldbody></mujoco>'


def renderer():
    return StaticRenderer(mujoco.MjModel.from_xml_string(WALL), 40, 30, 1.0, 0.75)


def in_thread(task):
    found = []

    def run():
        try:
            found.append(task())
        except Exception as error:
            found.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join(20.0)
    assert not thread.is_alive()
    return found[0]


FORKS = """
import os, sys
import numpy as np
from auvdock.core.errors import GraphicsError
from auvdock.optics.gl import StaticRenderer
from auvdock.sim.mj import mujoco

def draw(renderer):
    return renderer.render(np.eye(4))[0].tobytes()

def new():
    return StaticRenderer(mujoco.MjModel.from_xml_string({wall!r}), 40, 30, 1.0, 0.75)

kept, closed = new(), new()
image = draw(kept)
assert draw(closed) == image
closed.close()
print(kept.name, flush=True)
if os.fork() == 0:
    for renderer in (kept, closed, new()):
        try:
            print("same" if draw(renderer) == image else "other", flush=True)
        except GraphicsError as error:
            print(error, flush=True)
    sys.exit(0)  # as a program ends, with all that is to be done at its end
assert os.wait()[1] == 0
assert draw(kept) == image
"""


@pytest.mark.render
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on Windows")
@pytest.mark.parametrize("threads", [None, "2"])
def test_a_fork_draws_the_same_or_refuses(threads, monkeypatch):
    """The parent has drawn; its child draws with what it inherits and anew, and ends; it would have hung."""
    monkeypatch.delenv("LP_NUM_THREADS", raising=False)
    if threads is not None:
        monkeypatch.setenv("LP_NUM_THREADS", threads)
    script = FORKS.format(wall=WALL)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 0, done.stderr
    name, *children = done.stdout.splitlines()
    assert len(children) == 3
    if threads is None and name.startswith("llvmpipe"):
        assert children == ["same"] * 3
    else:
        for line in children:
            assert "forked" in line
            assert "context='spawn'" in line


@pytest.mark.parametrize(
    ("driver", "egl_display", "is_lost"),
    [
        (Driver(), None, False),
        (Driver(forkable=True), 1, False),
        (Driver(), 1, True),  # started by somebody else, or with threads
        (Driver(windowed=True), None, True),
        (Driver(lost=True), None, True),
    ],
)
def test_which_drivers_survive_a_fork(driver, egl_display, is_lost, monkeypatch):
    monkeypatch.setattr(gl_driver, "_driver", driver)
    monkeypatch.setitem(sys.modules, "mujoco.egl", SimpleNamespace(EGL_DISPLAY=egl_display))
    gl_driver.after_fork()
    assert driver.lost is is_lost
    if is_lost:
        with pytest.raises(GraphicsError, match="spawn"):
            renderer().render(np.eye(4))


@pytest.mark.render
def test_threads_take_a_context_one_after_the_other():
    unit = renderer()
    try:
        image = unit.render(np.eye(4))[0]
        for _ in range(2):
            assert np.array_equal(in_thread(lambda: unit.render(np.eye(4))[0]), image)
            assert np.array_equal(unit.render(np.eye(4))[0], image)
    finally:
        in_thread(unit.close)


@pytest.mark.render
def test_a_thread_that_comes_in_between_is_told_so_and_harms_nobody():
    unit = renderer()
    try:
        image = unit.render(np.eye(4))[0]
        offscreen = unit.drawn_by()[0]
        with offscreen.current():
            refusal = in_thread(lambda: unit.render(np.eye(4)))
        assert isinstance(refusal, GraphicsError)
        assert "another thread" in str(refusal)
        assert "\n" not in str(refusal)
        assert np.array_equal(unit.render(np.eye(4))[0], image)
        # The same where the driver itself refuses: somebody else has made our context current in his thread.
        with offscreen.gl.as_current():
            refusal = in_thread(lambda: unit.render(np.eye(4)))
        if type(offscreen.gl).__module__ == "mujoco.egl":
            assert isinstance(refusal, GraphicsError)
        assert np.array_equal(in_thread(lambda: unit.render(np.eye(4)))[0], image)
    finally:
        unit.close()


@pytest.mark.render
@pytest.mark.parametrize("display", [":77", ""])
def test_a_display_that_is_none_does_not_defeat_egl(display, monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("WAYLAND_DISPLAY", display)
    assert probe_gl()


class _Contextless:
    """A context that is never current, as GLFW's is without a display."""

    def __init__(self, width, height):
        pass

    def as_current(self):
        return nullcontext()

    def free(self):
        pass


@pytest.fixture
def no_context(monkeypatch):
    """Only a maker whose contexts are none."""
    module = ModuleType("contextless")
    monkeypatch.setattr(module, "GLContext", _Contextless, raising=False)
    monkeypatch.setitem(sys.modules, "contextless", module)
    monkeypatch.setattr(gl_driver, "_makers", lambda: ["contextless"])
    monkeypatch.setattr(gl_driver, "_driver", Driver())


def test_a_context_that_is_none_is_no_context(no_context, capsys):
    with pytest.raises(GraphicsError, match="contextless"):
        probe_gl()
    assert working_fidelity() == "beacons"
    assert capsys.readouterr().err.count("\n") == 1
    check = _try("OpenGL", False, _open_gl)
    assert not check.ok
    assert "libegl1" in check.remedy
    simulator: Any = SimpleNamespace(
        model=mujoco.MjModel.from_xml_string(WALL), truth=SimpleNamespace(T_world_body=np.eye(4)), station=None
    )
    simulator.data = mujoco.MjData(simulator.model)
    with pytest.raises(GraphicsError, match="contextless"):
        ChaseCamera(simulator).render()


@pytest.mark.parametrize("depth", [2.0, 3.0])
def test_a_context_that_draws_wrong_is_found_out(depth, monkeypatch):
    grey = np.full((16, 16, 3), 90 if depth == 2.0 else 0, dtype=np.uint8)
    monkeypatch.setattr(StaticRenderer, "name", "SomeDriver")
    monkeypatch.setattr(StaticRenderer, "render", lambda self, T: (grey, np.full((16, 16), depth, dtype=np.float32)))
    with pytest.raises(GraphicsError, match=r"SomeDriver.*orange"):
        probe_gl()


def test_contexts_are_made_in_one_place_only():
    """Whoever makes a context or MuJoCo's state on it himself has to see to threads, forks and missing drivers."""
    package = Path(auvdock.__file__).parent
    rooms = [package, *(package / room for room in ("envs", "controllers", "experiments", "assets"))]
    sources = {path.resolve() for room in rooms for path in room.rglob("*.py")}
    makes = re.compile(r"\b(MjrContext|GLContext|mujoco\.Renderer)\(")
    found = {path.name for path in sources if makes.search(path.read_text(encoding="utf-8"))}
    assert found == {"offscreen.py"}
    assert "GLContext" in (package / "optics" / "gl_driver.py").read_text(encoding="utf-8")
