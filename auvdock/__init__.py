"""auvdock: closed-loop camera docking of autonomous underwater vehicles in MuJoCo."""

from importlib.metadata import version

__version__ = version("auvdock")
