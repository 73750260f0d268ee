"""Schedules: the step size, and settings that are refused."""

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.core.strict import merge
from auvdock.dataset.training import load_training_cfg
from auvdock.networks.schedule import learning_rate


def test_the_step_size_rises_falls_and_ends_as_told():
    cfg = load_training_cfg().schedule
    rates = np.array([learning_rate(cfg, step) for step in range(cfg.steps)])
    warm = cfg.warm_up_steps
    assert np.all(np.diff(rates[:warm]) > 0.0)
    assert np.all(np.diff(rates[warm:]) < 0.0)
    assert rates.max() == pytest.approx(cfg.learning_rate)
    assert rates[-1] == pytest.approx(cfg.final_share * cfg.learning_rate)
    assert rates[0] == pytest.approx(cfg.learning_rate / warm)
    half = warm + (cfg.steps - 1 - warm) / 2.0
    middle = np.interp(half, np.arange(cfg.steps), rates)
    assert middle == pytest.approx(cfg.learning_rate * (1.0 + cfg.final_share) / 2.0, rel=1e-3)


def test_the_last_batch_is_whole():
    cfg = merge(load_training_cfg().schedule, {"crops": 25, "batch": 12, "warm_up_steps": 1})
    assert cfg.steps == 3


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"crops": 0}, "crops"),
        ({"crops": 24, "batch": 24, "warm_up_steps": 2}, "warm_up_steps"),
        ({"average_decay": 1.0}, "average_decay"),
        ({"loss": {"box": -1.0}}, "loss.box"),
        ({"momentum": 0.9}, "momentum"),
    ],
)
def test_what_cannot_be_a_schedule_is_named(change, field):
    with pytest.raises(ConfigError) as refused:
        merge(load_training_cfg().schedule, change)
    assert refused.value.field == field
