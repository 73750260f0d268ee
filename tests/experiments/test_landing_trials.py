"""Landing trials without a flight: bins, intervals and verdicts on made-up errors; the command's refusals."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from auvdock.cli.landing_trials import run_landing_trials
from auvdock.core.errors import ConfigError
from auvdock.experiments.landing_ranges import EDGES_M, compare, range_cells
from auvdock.experiments.landing_trials import LandingTrial, summarise, trial_cfg
from auvdock.experiments.landing_trials_pictures import draw_curves_16, draw_paths_15, draw_ranges


class Result:
    """What the experiment reads of an episode's result."""

    def __init__(self, success: bool) -> None:
        self.success = success
        self.failure_reason = None if success else "near"
        self.final_position_error_m = 0.004
        self.final_heading_error_rad = 0.01


def trial(seed: int, sigma_mm: dict[str, float], success: bool = True) -> LandingTrial:
    """A flight from 5 m to 0.2 m whose errors have the given standard deviation per coordinate."""
    rng = np.random.default_rng(seed)
    n = 400
    errors = {
        name: np.column_stack([rng.normal(0.0, s / 1000.0, (n, 3)), rng.normal(0.0, 1e-3, n)])
        for name, s in sigma_mm.items()
    }
    true = np.column_stack(
        [np.linspace(1.0, 0.0, n), np.linspace(-0.5, 0.0, n), np.linspace(-5.0, 0.0, n), np.zeros(n)]
    )
    return LandingTrial(
        seed=seed,
        levels="both",
        result=cast(Any, Result(success)),
        time_s=np.arange(n) / 20.0,
        true=true,
        estimated=true + errors["both"],
        aligned=(np.arange(n) > 200).astype(np.float64),
        range_m=np.linspace(5.0, 0.2, n),
        errors=errors,
        measured={name: np.ones(n) for name in sigma_mm},
    )


def test_errors_are_found_again():
    """rms √3 σ in every bin, within its interval; fused is called worse where it is, and only there."""
    good = [trial(seed, {"both": 2.0, "lights": 4.0, "tag": 6.0}) for seed in range(8)]
    for cell in range_cells(good):
        expected = {"both": 2.0, "lights": 4.0, "tag": 6.0}[cell.levels] * np.sqrt(3.0) / 1000.0
        assert cell.measured == 1.0
        if cell.position_m is not None:
            assert cell.position_m == pytest.approx(expected, rel=0.2)
            assert cell.position_95 is not None
            assert cell.position_95[0] <= cell.position_m <= cell.position_95[1]
    verdicts = [verdict for verdict in compare(good) if verdict.quantity == "position"]
    assert len(verdicts) >= len(EDGES_M) - 3
    assert {verdict.better for verdict in verdicts} == {"lights"}
    assert not any(verdict.worse for verdict in verdicts)
    bad = compare([trial(seed, {"both": 8.0, "lights": 4.0, "tag": 6.0}) for seed in range(8)])
    assert all(verdict.worse for verdict in bad if verdict.quantity == "position")


def test_frames_without_a_measurement_do_not_count():
    one = trial(0, {"both": 2.0, "lights": 4.0, "tag": 6.0})
    one.measured["tag"][:] = 0.0
    cells = [cell for cell in range_cells([one]) if cell.levels == "tag"]
    assert all(cell.measured == 0.0 and cell.position_m is None for cell in cells)
    assert {verdict.better for verdict in compare([one])} == {"lights"}


def test_summary():
    summary = summarise(
        [trial(0, {"both": 2.0, "lights": 4.0, "tag": 6.0}, seed_ok) for seed_ok in (True, False)], "both"
    )
    assert (summary.docked.successes, summary.docked.episodes) == (1, 2)
    assert summary.failures == {0: "near"}
    assert summary.within_paper == 1.0
    assert summary.position_p95_m == pytest.approx(0.005, abs=0.001)
    assert summarise([], "both").docked.episodes == 0
    assert range_cells([]) == []
    assert compare([]) == []


def test_pictures(tmp_path: Any):
    flights = [trial(seed, {"both": 2.0, "lights": 4.0, "tag": 6.0}) for seed in range(2)]
    draw_paths_15(tmp_path / "a.png", flights)
    draw_curves_16(tmp_path / "b.png", flights)
    draw_ranges(tmp_path / "c.png", range_cells(flights), "errors")
    assert all((tmp_path / f"{name}.png").stat().st_size > 5000 for name in "abc")


@pytest.mark.parametrize(
    ("words", "field"),
    [
        (["--fidelity", "words"], "fidelity"),
        (["--trials", "0"], "trials"),
        (["--seed", "-1"], "seed"),
        (["--levels", "sonar"], "levels"),
        (["--water", "milk"], ""),
    ],
)
def test_refusals(words: list[str], field: str):
    with pytest.raises(ConfigError) as error:
        run_landing_trials(words, "auvdock reproduce landing-trials")
    assert error.value.field.startswith(field)


def test_task():
    cfg = trial_cfg("beacons", {"world": {"water": "pool"}})
    assert (cfg.world.fidelity, cfg.world.water, cfg.world.sim.current.speed_m_s) == ("beacons", "pool", 0.1)
