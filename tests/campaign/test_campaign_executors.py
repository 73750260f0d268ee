"""Executors: the same rows everywhere; deaths, hangs and exceptions stay the episode's own."""

import dataclasses
from pathlib import Path

import pytest
from campaign_jobs import Bernoulli, ByCell, Raising, Troubled

from auvdock.campaign.axes import AxisCfg
from auvdock.campaign.campaign import CampaignSummary, Tally, run_campaign
from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.errors import CampaignError
from auvdock.campaign.executor import SerialExecutor
from auvdock.campaign.job import DockingJob
from auvdock.campaign.plan import Plan
from auvdock.campaign.process import ProcessExecutor
from auvdock.campaign.provenance import manifest_of
from auvdock.campaign.statistics import wilson
from auvdock.campaign.store import Store, read_table
from auvdock.cli.sweep import plain_summary, print_summary
from auvdock.core.errors import ConfigError

AXES = (AxisCfg("current", low=0.0, high=0.5, count=3), AxisCfg("attenuation", low=0.2, high=1.2))
SHORT = {"world": {"fidelity": "beacons", "limits": {"max_time_s": 2.0}}}


class Silent:
    """Watches nothing, counts."""

    def __init__(self):
        self.planned = self.before = self.rows = 0

    def on_start(self, planned, tally):
        self.planned, self.before = planned, tally.episodes

    def on_row(self, row, tally):
        self.rows += 1

    def close(self):
        pass


def swept(folder, cfg, job, executor, resume=False):
    store = Store(folder, cfg, manifest_of(cfg), resume)
    summary = run_campaign(cfg, job, store, executor, Silent())
    return summary, read_table(folder).to_pylist()


def test_real_episodes_are_the_same_in_any_executor_number_of_workers_and_order(tmp_path):
    cfg = CampaignCfg(episodes=6, axes=AXES, episode=SHORT)
    _, serial = swept(tmp_path / "serial", cfg, DockingJob(cfg), SerialExecutor(60.0))
    assert [row["episode"] for row in serial] == list(range(6))
    assert len({row["path_length_m"] for row in serial}) == 6
    for workers in (1, 3):
        _, rows = swept(tmp_path / f"process{workers}", cfg, DockingJob(cfg), ProcessExecutor(workers, 60.0))
        assert rows == serial
    plan, run = Plan(cfg), DockingJob(cfg, cached_runners=2).build()
    assert [run(plan[index]) for index in reversed(range(6))] == serial[::-1]


def test_ray_gives_the_same_rows(tmp_path):
    pytest.importorskip("ray")
    from auvdock.campaign.ray_executor import RayExecutor

    cfg = CampaignCfg(episodes=4, axes=AXES, episode=SHORT)
    _, serial = swept(tmp_path / "serial", cfg, DockingJob(cfg), SerialExecutor(60.0))
    _, rows = swept(tmp_path / "ray", cfg, DockingJob(cfg), RayExecutor(2, 60.0, None))
    assert rows == serial


def test_an_unreachable_ray_cluster_is_named():
    pytest.importorskip("ray")
    from auvdock.campaign.ray_executor import RayExecutor

    with pytest.raises(ConfigError, match="address"):
        RayExecutor(2, 60.0, "no-such-scheme://nowhere")


def test_deaths_hangs_and_exceptions_cost_one_episode_each(tmp_path):
    cfg = CampaignCfg(episodes=12, axes=AXES)
    executor = ProcessExecutor(2, limit_s=3.0)
    summary, rows = swept(tmp_path / "out", cfg, Troubled(str(tmp_path)), executor)
    assert [row["episode"] for row in rows] == list(range(12))
    failed = {row["episode"]: row["failure_reason"] for row in rows if not row["success"]}
    assert failed == {1: "crashed", 3: "hung", 4: "crashed"}
    assert "signal 9" in rows[1]["error"]
    assert "3 s" in rows[3]["error"]
    assert rows[4]["error"] == "ZeroDivisionError: no light"
    assert summary.failures == {}
    assert summary.lost == {"crashed": 2, "hung": 1}
    assert summary.rate == wilson(9, 9, lost=3)
    assert summary.ran == 12


def test_the_serial_executor_ends_a_hanging_episode_too(tmp_path):
    cfg = CampaignCfg(episodes=3)
    _, rows = swept(tmp_path, cfg, Bernoulli(1.0, pause_s=30.0), SerialExecutor(limit_s=0.1))
    assert [row["failure_reason"] for row in rows] == ["hung"] * 3


def test_a_campaign_whose_every_episode_raises_stops(tmp_path):
    cfg = CampaignCfg(episodes=500)
    with pytest.raises(CampaignError, match="ZeroDivisionError: no light"):
        swept(tmp_path, cfg, Raising(), SerialExecutor(60.0))
    assert read_table(tmp_path).num_rows == 10


def test_what_the_user_can_mend_stops_the_campaign(tmp_path):
    cfg = CampaignCfg(episodes=500)
    for executor in (SerialExecutor(60.0), ProcessExecutor(1, 60.0)):
        with pytest.raises(ConfigError, match="detector"):
            swept(tmp_path / type(executor).__name__, cfg, Raising(refuse=True), executor)


def test_a_resumed_campaign_runs_only_what_is_missing(tmp_path):
    cfg = CampaignCfg(episodes=60, axes=AXES)
    log = tmp_path / "log"
    swept(tmp_path / "out", cfg, Bernoulli(0.7, log=str(log)), SerialExecutor(60.0))
    whole = read_table(tmp_path / "out").to_pylist()
    longer = CampaignCfg(episodes=90, axes=AXES)
    summary, rows = swept(tmp_path / "out", longer, Bernoulli(0.7, log=str(log)), SerialExecutor(60.0), resume=True)
    assert sorted(int(line) for line in log.read_text(encoding="utf-8").split()) == list(range(90))
    assert summary.ran == 30
    assert rows[:60] == whole


@pytest.mark.parametrize("probability", [1.0, 0.9])
def test_the_adaptive_stop_ends_at_the_first_prefix_that_is_known_well_enough(tmp_path, probability):
    cfg = CampaignCfg(episodes=5000, until_ci=0.03)
    summary, rows = swept(tmp_path / "whole", cfg, Bernoulli(probability), SerialExecutor(60.0))
    assert summary.rate.half_width <= 0.03
    assert [row["episode"] for row in rows] == list(range(len(rows)))
    earlier = Tally()
    for row in rows[:-100]:
        earlier.add(row["success"] is True, row["failure_reason"])
    assert earlier.rate.half_width > 0.03
    assert len(rows) < 700  # of 5,000
    interrupted = CampaignCfg(episodes=130, until_ci=0.03)
    swept(tmp_path / "parts", interrupted, Bernoulli(probability), SerialExecutor(60.0))
    _, again = swept(tmp_path / "parts", cfg, Bernoulli(probability), SerialExecutor(60.0), resume=True)
    assert again == rows


def test_cells_stop_one_by_one_and_the_same_in_any_number_of_workers_and_after_a_kill(tmp_path):
    """Each cell stops at its own first look with a narrow interval: sure cells early, doubtful ones late or never."""
    cfg = CampaignCfg(episodes=3000, until_ci=0.1, until_ci_per_cell=True, axes=(AxisCfg("current", (0.0, 0.25, 0.5)),))
    job = ByCell((1.0, 0.9, 0.5))
    summary, rows = swept(tmp_path / "whole", cfg, job, SerialExecutor(60.0))
    cells = [[row["success"] for row in rows if row["current"] == value] for value in (0.0, 0.25, 0.5)]
    for cell in cells:
        assert len(cell) % 20 == 0
        assert wilson(sum(cell), len(cell)).half_width <= 0.1
        assert wilson(sum(cell[:-20]), len(cell) - 20).half_width > 0.1
    assert len(cells[0]) < len(cells[1]) < len(cells[2])
    assert summary.rate.episodes == len(rows) == sum(map(len, cells))
    part = dataclasses.replace(cfg, episodes=100)
    swept(tmp_path / "parts", part, job, SerialExecutor(60.0))
    _, resumed = swept(tmp_path / "parts", cfg, job, SerialExecutor(60.0), resume=True)
    assert resumed == rows
    _, elsewhere = swept(tmp_path / "process", cfg, job, ProcessExecutor(2, 60.0))
    assert elsewhere == rows


def test_a_cell_gets_its_share_of_the_episodes_and_no_more(tmp_path):
    cfg = CampaignCfg(episodes=50, until_ci=0.01, until_ci_per_cell=True, axes=(AxisCfg("current", (0.0, 0.5)),))
    _, rows = swept(tmp_path, cfg, Bernoulli(0.5), SerialExecutor(60.0))
    assert [row["episode"] for row in rows] == list(range(50))


def test_cells_without_a_width_to_reach_are_refused():
    with pytest.raises(ConfigError, match="until_ci"):
        CampaignCfg(until_ci_per_cell=True)


def test_a_row_without_a_result_neither_narrows_nor_shifts_the_adaptive_stop(tmp_path):
    """Every fourth episode raises: the campaign stops as soon as those that were flown are known well enough."""
    cfg = CampaignCfg(episodes=2000, until_ci=0.03)
    summary, rows = swept(tmp_path, cfg, Bernoulli(1.0, raise_every=4), SerialExecutor(60.0))
    flown = sum(row["error"] is None for row in rows)
    assert (summary.rate, summary.lost) == (
        wilson(flown, flown, lost=len(rows) - flown),
        {"crashed": len(rows) - flown},
    )
    assert summary.rate.half_width <= 0.03 < wilson(flown - 75, flown - 75).half_width


def test_the_sweep_says_loudly_what_left_no_result(capsys):
    rate = wilson(3, 4, lost=2)
    summary = CampaignSummary(rate, {"near": 1}, {"crashed": 2}, 6, 1.0, 100.0)
    print_summary(summary, Path("out"))
    told = capsys.readouterr().out
    assert "campaign of 6 episodes" in told
    assert "success rate of 4 with a result" in told
    assert "75.0 %" in told
    assert "NO RESULT: crashed (in no rate)" in told
    assert "[" not in told
    plain = plain_summary(summary)
    assert (plain["success_rate"], plain["episodes"], plain["lost"]) == (0.75, 4, {"crashed": 2})
    assert plain["failures"] == {"near": 1}
