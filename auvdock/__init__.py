"""auvdock: closed-loop camera docking of autonomous underwater vehicles in MuJoCo.

Importing it registers the environments, so that `gymnasium.make("auvdock/ConicalDocking-v1")` finds them.
"""

from importlib.metadata import version

from auvdock.envs.registration import register_envs

__all__ = ["__version__"]

__version__ = version("auvdock")

register_envs()
