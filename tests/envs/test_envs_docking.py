"""The conical environment: its reward and its starts; what every environment keeps stands in the conformance tests."""

import numpy as np

from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.envs.docking import DockingEnv


def test_progress_towards_the_latch_is_rewarded():
    env = DockingEnv(WorldCfg(start=StartCfg(heading_deg=0.0, lateral_m=0.0, vertical_m=0.0)))
    ahead, astern = np.zeros(7, dtype=np.float32), np.zeros(7, dtype=np.float32)
    ahead[0], astern[0] = 1.0, -1.0

    def total(action):
        env.reset(seed=0)
        return sum(float(env.step(action)[1]) for _ in range(60))

    assert total(ahead) > 0.0 > total(astern)


def test_start_lies_within_the_configured_ranges():
    cfg = StartCfg()
    env = DockingEnv(WorldCfg(start=cfg))
    starts = np.array([env.reset(seed=seed)[0] for seed in range(50)])
    nose_to_centre_m = 0.7
    assert np.all(starts[:, 0] > cfg.min_range_m - nose_to_centre_m)
    assert np.all(starts[:, 0] < cfg.max_range_m + nose_to_centre_m)
    assert np.all(np.abs(starts[:, 1]) < cfg.lateral_m + nose_to_centre_m)
    assert np.all(np.abs(starts[:, 2]) < cfg.vertical_m + nose_to_centre_m)
    assert np.ptp(starts[:, 0]) > 0.5 * (cfg.max_range_m - cfg.min_range_m)
