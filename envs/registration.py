"""Registers the environments with Gymnasium; `import auvdock` calls it."""

from __future__ import annotations

import gymnasium

__all__ = ["register_envs"]


def register_envs() -> None:
    """Register `auvdock/ConicalDocking-v0`, `auvdock/RotatingBeaconDocking-v0` and `auvdock/LandingDocking-v0`.

    Doing it twice changes nothing.

    Time limits are the environment's own (`WorldCfg.limits.max_time_s`), so no `max_episode_steps` is set.
    """
    if "auvdock/ConicalDocking-v0" not in gymnasium.registry:
        gymnasium.register(id="auvdock/ConicalDocking-v0", entry_point="auvdock.envs.docking:DockingEnv")
    if "auvdock/RotatingBeaconDocking-v0" not in gymnasium.registry:
        gymnasium.register(
            id="auvdock/RotatingBeaconDocking-v0", entry_point="auvdock.envs.rotating_docking:RotatingDockingEnv"
        )
    if "auvdock/LandingDocking-v0" not in gymnasium.registry:
        gymnasium.register(id="auvdock/LandingDocking-v0", entry_point="auvdock.envs.landing:LandingEnv")
