"""Axes, designs, seeds and the strict TOML file of a campaign."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.campaign.axes import AxisCfg
from auvdock.campaign.axis_text import parse_axis
from auvdock.campaign.config import CampaignCfg, campaign_from_plain
from auvdock.campaign.files import load_campaign
from auvdock.campaign.plan import Plan
from auvdock.core.errors import ConfigError
from auvdock.core.strict import to_plain
from auvdock.episode.config import EpisodeCfg, level_cfg

CAMPAIGNS = sorted((Path(__file__).resolve().parents[2] / "experiments" / "campaigns").glob("*.toml"))


def points(cfg, name):
    plan = Plan(cfg)
    return [float(plan[index].point[name]) for index in range(len(plan))]


def test_a_range_is_low_high_count():
    assert parse_axis("current", "0:0.5:6", float).grid == (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
    assert parse_axis("attenuation", "0.2:1.2:6", float).grid == (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
    assert not parse_axis("current", "0:0.5", float).is_grid
    assert parse_axis("flicker", "none,severe", str).grid == ("none", "severe")
    assert parse_axis("current", "0.3", float).grid == (0.3,)


@pytest.mark.parametrize("text", ["", "0:1:2:3", "1:0:3", "0:1:0", "0:1:1", "a:b", "0:nan:3", "0:inf", "1,,2", "nan"])
def test_ranges_that_are_none_are_refused(text):
    with pytest.raises(ConfigError) as caught:
        parse_axis("current", text, float)
    assert "current" in caught.value.field


@given(st.integers(2, 5), st.integers(2, 5), st.integers(1, 60))
def test_every_prefix_of_a_grid_is_balanced(across, down, episodes):
    axes = (AxisCfg("current", low=0.0, high=0.5, count=across), AxisCfg("attenuation", low=0.2, high=1.2, count=down))
    plan = Plan(CampaignCfg(episodes=episodes, axes=axes))
    cells = [tuple(plan[index].point.values()) for index in range(episodes)]
    counts = [cells.count(cell) for cell in set(cells)]
    assert len(counts) == min(episodes, across * down)
    assert max(counts) - min(counts) <= 1


def test_seeds_are_numpy_s_spawned_children_and_differ():
    plan = Plan(CampaignCfg(episodes=2000, seed=17))
    seeds = [plan[index].seed for index in range(2000)]
    children = np.random.SeedSequence(17).spawn(1)[0].spawn(2000)
    assert seeds == [int(child.generate_state(1, np.uint64)[0]) >> 11 for child in children]
    assert len(set(seeds)) == 2000
    assert max(seeds) < 2**53


@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_an_episode_is_the_same_alone_and_in_any_order(sampling):
    axes = (AxisCfg("current", low=0.0, high=0.5), AxisCfg("flicker", ("none", "mild")))
    cfg = CampaignCfg(episodes=32, axes=axes, sampling=sampling)
    forward = [Plan(cfg)[index] for index in range(32)]
    backward = [Plan(cfg)[index] for index in reversed(range(32))]
    assert forward == backward[::-1]


def test_a_latin_hypercube_fills_every_interval_of_every_axis_once():
    axes = (AxisCfg("current", low=0.0, high=0.5), AxisCfg("attenuation", low=0.2, high=1.2))
    cfg = CampaignCfg(episodes=50, axes=axes, sampling="latin_hypercube")
    for name, low, width in (("current", 0.0, 0.5), ("attenuation", 0.2, 1.0)):
        cells = sorted(int((value - low) / width * 50) for value in points(cfg, name))
        assert cells == list(range(50))


def test_sobol_fills_every_elementary_interval_once_and_can_be_extended():
    axes = (AxisCfg("current", low=0.0, high=0.5), AxisCfg("attenuation", low=0.2, high=1.2))
    cfg = CampaignCfg(episodes=64, axes=axes, sampling="sobol")
    pairs = zip(points(cfg, "current"), points(cfg, "attenuation"), strict=True)
    cells = {(int(one / 0.5 * 8), int((other - 0.2) * 8)) for one, other in pairs}
    assert len(cells) == 64
    longer = dataclasses.replace(cfg, episodes=100)
    assert points(longer, "current")[:64] == points(cfg, "current")


@pytest.mark.parametrize("distribution", ["uniform", "log_uniform", "normal"])
def test_distributions_stay_within_their_bounds_and_have_their_middle(distribution):
    axis = AxisCfg("attenuation", low=0.2, high=1.2, distribution=distribution)
    assert axis.quantile(0.0) == pytest.approx(0.2)
    assert axis.quantile(1.0) == pytest.approx(1.2)
    middle = np.sqrt(0.2 * 1.2) if distribution == "log_uniform" else 0.7
    assert axis.quantile(0.5) == pytest.approx(middle)


def test_a_point_arrives_in_the_episode_s_configuration():
    axes = (
        AxisCfg("current", (0.25,)),
        AxisCfg("current_direction", (90.0,)),
        AxisCfg("attenuation", (0.8,)),
        AxisCfg("start_range", (18.0,)),
        AxisCfg("detector", ("blob",)),
        AxisCfg("world.limits.max_time_s", (30.0,)),
    )
    cfg = CampaignCfg(axes=axes, episode={"world": {"fidelity": "beacons"}})
    episode = Plan(cfg).config(Plan(cfg)[0])
    assert isinstance(episode, EpisodeCfg)
    assert episode.world.fidelity == "beacons"
    assert (episode.world.sim.current.speed_m_s, episode.world.sim.current.direction_deg) == (0.25, 90.0)
    assert not episode.world.start.random_current_direction
    assert episode.world.attenuation_per_m == 0.8
    assert (episode.world.start.min_range_m, episode.world.start.max_range_m) == (18.0, 18.0)
    assert episode.perception.detector == "blob"
    assert episode.world.limits.max_time_s == 30.0


def test_a_level_axis_starts_each_episode_from_its_level():
    cfg = CampaignCfg(episodes=5, axes=(AxisCfg("level", (0, 1, 2, 3, 4)),))
    plan = Plan(cfg)
    assert [plan.config(plan[index]) for index in range(5)] == [level_cfg(level) for level in range(5)]


@pytest.mark.parametrize(("station", "simulated_s"), [("conical", 240.0), ("rotating", 600.0), ("landing", 240.0)])
def test_a_slow_machine_may_finish_its_longest_episode(station, simulated_s):
    cfg = CampaignCfg(station=station)
    assert cfg.base(1).world.limits.max_time_s == simulated_s
    assert cfg.wall_limit_s == 5.0 * simulated_s
    brief = CampaignCfg(station=station, episode={"world": {"limits": {"max_time_s": 2.0}}})
    assert brief.wall_limit_s == 600.0
    assert CampaignCfg(station=station, episode_limit_s=7.0).wall_limit_s == 7.0
    with pytest.raises(ConfigError, match="episode_limit_s"):
        CampaignCfg(station=station, episode_limit_s=0.0)


def test_a_campaign_survives_its_manifest():
    axes = (
        AxisCfg("current", low=0.0, high=0.5, count=6),
        AxisCfg("flicker", ("none", "mild")),
        AxisCfg("level", (0, 3)),
    )
    cfg = CampaignCfg(axes=axes, until_ci=0.02, episode={"world": {"water": "pool"}})
    again = campaign_from_plain(to_plain(cfg))
    assert again == cfg
    assert [Plan(again)[index] for index in range(9)] == [Plan(cfg)[index] for index in range(9)]


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("episode = 5", "episode"),
        ("episodse = 5", "episodse"),
        ("episodes = 0", "episodes"),
        ("station = 'triangular'", "station"),
        ("sampling = 'grid'", "sampling"),
        ("[episode.world]\nwater = 'champagne'\n[[axes]]\nname = 'curent'\nvalues = [1.0]", "curent"),
        ("[[axes]]\nname = 'current'\nvalues = [9.0]", "speed_m_s"),
        ("[[axes]]\nname = 'current'\nlow = 0.0\nhigh = 0.5\ncuont = 6", "cuont"),
        ("[[axes]]\nname = 'level'\nvalues = [7]", "level"),
        ("[[axes]]\nname = 'current'\nlow = 0.0", "current"),
    ],
)
def test_mistakes_in_the_file_are_named(tmp_path, text, field):
    path = tmp_path / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_campaign(path)
    assert field in str(caught.value)


@pytest.mark.parametrize("path", CAMPAIGNS, ids=lambda path: path.stem)
def test_the_campaigns_that_come_along_can_be_planned(path):
    cfg = load_campaign(path)
    plan = Plan(cfg)
    for index in {0, len(plan) // 2, len(plan) - 1}:
        plan.config(plan[index])


def test_there_are_campaigns_to_begin_with():
    assert CAMPAIGNS
