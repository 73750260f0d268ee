"""Every module can be imported where Python has only what it has everywhere; all but networks without PyTorch."""

import subprocess
import sys

SCRIPT = """
import importlib, os, pkgutil, signal, sys
import auvdock
# Other people's packages first: what they need here is their business.
import control, cv2, filelock, gymnasium, matplotlib.pyplot, mujoco.egl, numba, onnxruntime, pyarrow.parquet
import rerun, rich, scipy.optimize, scipy.spatial, tyro
import multiprocessing.connection, subprocess
for name in [name for name in sys.modules if name.partition(".")[0] == "auvdock"]:
    del sys.modules[name]
POSIX = ("crypt", "curses", "fcntl", "grp", "nis", "posix", "pty", "pwd", "readline", "resource", "spwd", "syslog",
         "termios", "tty")
sys.modules.update(dict.fromkeys(POSIX))  # None: the import fails
for name in ("EX_OK", "fork", "getpgid", "getuid", "geteuid", "killpg", "mkfifo", "register_at_fork",
             "sched_getaffinity", "sched_setaffinity", "setsid", "statvfs", "uname", "wait4", "WNOHANG"):
    delattr(os, name)
for name in ("SIGALRM", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGUSR1", "alarm", "setitimer", "ITIMER_REAL"):
    delattr(signal, name)
class NoTorch:
    def find_spec(self, name, path=None, target=None):
        if name == "torch":  # an extra: networks alone may need it
            raise ModuleNotFoundError(name, name=name)
sys.modules.pop("torch", None)
sys.meta_path.insert(0, NoTorch())
import auvdock
found = ["auvdock", *(module.name for module in pkgutil.walk_packages(auvdock.__path__, "auvdock."))]
failed = []
for name in found:
    if name.endswith("__main__"):
        continue
    try:
        importlib.import_module(name)
    except ImportError as error:
        if not (name.startswith("auvdock.networks.") and error.name == "torch"):
            failed.append(f"{name}: {error}")
    except BaseException as error:
        failed.append(f"{name}: {type(error).__name__}: {error}")
print(len(found))
sys.exit("\\n".join(failed) or 0)
"""


def test_no_module_needs_posix_or_pytorch_to_be_imported():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 200
