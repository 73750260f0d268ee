"""Registers the environments with Gymnasium; `import auvdock` calls it."""

from __future__ import annotations

import gymnasium

__all__ = ["ENVIRONMENTS", "register_envs"]

ENVIRONMENTS = {
    "auvdock/ConicalDocking-v1": "auvdock.envs.docking:DockingEnv",
    "auvdock/RotatingBeaconDocking-v1": "auvdock.envs.rotating_docking:RotatingDockingEnv",
    "auvdock/LandingDocking-v1": "auvdock.envs.landing:LandingEnv",
}
"""Names of all environments and where each lives."""


def register_envs() -> None:
    """Register all environments; doing it twice changes nothing.

    Time limits are the environment's own (`WorldCfg.limits.max_time_s`), so no `max_episode_steps` is set.
    """
    for name, entry_point in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(id=name, entry_point=entry_point)
