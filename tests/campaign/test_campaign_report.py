"""The report: complete, self-contained, and its figures are those of the rows."""

import csv
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from campaign_jobs import Bernoulli
from test_campaign_executors import swept

from auvdock.campaign.axes import AxisCfg
from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.errors import CampaignError
from auvdock.campaign.executor import SerialExecutor
from auvdock.campaign.report.cells import load, success_map
from auvdock.campaign.report.compare import compare
from auvdock.campaign.report.figures import cause_figure, distribution_figure, map_figure
from auvdock.campaign.report.page import html_page, recording_path
from auvdock.campaign.report.tables import csv_table, latex_table
from auvdock.campaign.row import RESULT_COLUMNS
from auvdock.campaign.statistics import wilson
from auvdock.cli.main import main
from auvdock.episode.result import FAILURE_REASONS

GRID = (AxisCfg("current", low=0.0, high=0.5, count=3), AxisCfg("attenuation", low=0.2, high=1.2, count=2))


def made(folder, cfg, probability):
    swept(folder, cfg, Bernoulli(probability), SerialExecutor(60.0))
    return load(folder)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    cfg = CampaignCfg(name="a <b> & c", episodes=120, axes=GRID)
    return made(tmp_path_factory.mktemp("report") / "one", cfg, 0.75)


class Checker(HTMLParser):
    """Notes what the page loads and whether its elements nest."""

    VOID = frozenset({"meta", "br", "link", "img", "input", "hr"})

    def __init__(self):
        super().__init__()
        self.open, self.loads, self.wrong = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "src" or (name == "href" and tag in ("link", "script")) or tag in ("script", "iframe"):
                self.loads.append((tag, value))

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def test_the_page_needs_nothing_else_and_its_elements_nest(campaign):
    page = html_page(campaign, None)
    checker = Checker()
    checker.feed(page)
    assert (checker.loads, checker.wrong, checker.open) == ([], [], [])
    assert "url(http" not in page
    assert "a &lt;b&gt; &amp; c" in page
    assert page.count("<svg") == 4


def test_the_page_tells_rate_interval_and_every_failure(campaign):
    page = html_page(campaign, None)
    successes = sum(row["success"] is True for row in campaign.rows)
    rate = wilson(successes, 120)
    assert f"{100 * successes / 120:.1f} %" in page
    assert f"{100 * rate.low:.1f} to {100 * rate.high:.1f} %" in page
    assert "crashed or hung" not in page
    for row in campaign.rows:
        assert (f"#{row['episode']}&#x27;" in page) == (not row["success"] or row["episode"] == 0)


def test_the_same_rows_give_the_same_page(campaign):
    assert html_page(campaign, None) == html_page(load(campaign.folder), None)


def test_the_page_tells_what_was_varied(tmp_path):
    cfg = CampaignCfg(
        episodes=4, axes=(AxisCfg("level", values=(0.0, 2.0)), AxisCfg("flicker", values=("none", "mild")))
    )
    assert "Varied: level 0, 2; flicker none, mild." in html_page(made(tmp_path / "out", cfg, 0.5), None)


def test_every_cause_of_failure_can_be_drawn(campaign):
    failed = [row for row in campaign.rows if row["success"] is False]
    assert len(failed) >= len(FAILURE_REASONS)
    rows = [{**row, "failure_reason": cause} for row, cause in zip(failed, FAILURE_REASONS, strict=False)]
    drawn = cause_figure(replace(campaign, rows=rows))
    assert all(f">{cause}<" in drawn for cause in FAILURE_REASONS)


@pytest.fixture(scope="module")
def troubled(campaign):
    """The same campaign, of which every ninth episode crashed or hung."""
    nothing = dict.fromkeys(RESULT_COLUMNS) | {"success": False, "error": "ZeroDivisionError: no light"}
    reasons = {0: "crashed", 9: "hung"}
    rows = [
        {**row, **nothing, "failure_reason": reasons[place % 18]} if place % 9 == 0 else row
        for place, row in enumerate(campaign.rows)
    ]
    return replace(campaign, rows=rows)


def test_lost_episodes_are_told_and_enter_no_rate(campaign, troubled):
    """Page, map, CSV and LaTeX: as of the others alone, with how many are lost beside it."""
    left = replace(campaign, rows=[row for row in troubled.rows if row["error"] is None])
    lost = len(campaign.rows) - len(left.rows)
    assert (troubled.rate.lost, troubled.rate.episodes) == (lost, len(left.rows))
    assert (troubled.rate.rate, troubled.rate.low) == (left.rate.rate, left.rate.low)
    page = html_page(troubled, None)
    assert f">{lost}</span></b>crashed or hung" in page
    assert f"<b>{left.rate.episodes}</b>episodes with a result" in page
    for line, clean in zip(*(csv.DictReader(io.StringIO(csv_table(one))) for one in (troubled, left)), strict=True):
        for name in ("episodes", "successes", "success_rate", "ci_low", "ci_high"):
            assert line[name] == clean[name]
        assert int(line["lost"]) == int(line["failed_crashed"]) + int(line["failed_hung"])
        assert clean["lost"] == "0"
    whole, found = success_map(left), success_map(troubled)
    assert whole is not None
    assert found is not None
    for line, clean in zip(found.rates, whole.rates, strict=True):
        assert [replace(rate, lost=0) for rate in line] == clean
    assert sum(rate.lost for line in found.rates for rate in line) == lost
    assert " lost" in map_figure(found)
    assert " lost" not in map_figure(whole)
    assert f"and {lost} without a result" in latex_table(troubled)


def test_pairs_with_a_lost_episode_are_left_out_and_told(campaign, troubled):
    found = compare(troubled, campaign)
    assert found.lost == troubled.rate.lost
    assert found.test.pairs == 120 - found.lost
    assert (found.test.only_first, found.test.only_second, found.changed) == (0, 0, [])
    assert f"Left out: {found.lost} pairs" in html_page(troubled, found)


def test_only_what_the_station_has_is_drawn(campaign):
    landing = ("touchdown_speed_m_s", "final_position_error_m", "final_heading_error_rad")
    bare = [{**row, **dict.fromkeys(landing)} for row in campaign.rows]
    assert "touchdown" not in distribution_figure(bare)
    drawn = distribution_figure([{**row, "touchdown_speed_m_s": 0.05, "final_position_error_m": 0.002} for row in bare])
    assert "touchdown speed" in drawn
    assert "final position error" in drawn
    assert "final heading error" not in drawn


def test_a_recording_that_is_there_is_linked(campaign):
    failed = next(row["episode"] for row in campaign.rows if not row["success"])
    path = recording_path(campaign.folder, failed)
    path.write_bytes(b"")
    page = html_page(campaign, None)
    (link,) = re.findall(r'href="([^"]*)"', page.replace('xlink:href="', 'x="'))
    assert (campaign.folder / link).samefile(path)
    path.unlink()


def test_map_and_tables_count_every_episode_once(campaign):
    found = success_map(campaign)
    assert found is not None
    assert (len(found.rates), len(found.rates[0])) == (3, 2)
    assert sum(rate.episodes for line in found.rates for rate in line) == 120
    table = list(csv.DictReader(io.StringIO(csv_table(campaign))))
    assert len(table) == 6
    assert sum(int(line["episodes"]) for line in table) == 120
    for line in table:
        inside = [row for row in campaign.rows if f"{row['current']:.3g}" == line["current"]]
        inside = [row for row in inside if f"{row['attenuation']:.3g}" == line["attenuation"]]
        assert int(line["successes"]) == sum(row["success"] is True for row in inside)
        reference = wilson(int(line["successes"]), len(inside))
        assert float(line["ci_low"]) == pytest.approx(reference.low, abs=1e-5)
        assert int(line["failed_near"]) == len(inside) - int(line["successes"])


def test_the_latex_table_has_as_many_cells_in_each_line(campaign):
    text = latex_table(campaign)
    body = [line for line in text.splitlines() if line.endswith("\\\\")]
    assert [line.count("&") for line in body] == [1, 2, 2, 2, 2]
    assert text.count("\\begin") == text.count("\\end") == 2
    assert "a <b> \\& c" in text


@pytest.mark.parametrize(
    "axes",
    [
        (),
        (AxisCfg("current", low=0.0, high=0.5),),
        (AxisCfg("current", low=0.0, high=0.5), AxisCfg("attenuation", low=0.2, high=1.5, distribution="log_uniform")),
        (AxisCfg("detector", ("threshold", "blob")), AxisCfg("flicker", ("none", "mild")), AxisCfg("gust", (0.1,))),
    ],
    ids=["nothing", "one drawn axis", "two drawn axes", "names"],
)
@pytest.mark.parametrize("probability", [0.0, 1.0])
def test_any_campaign_can_be_reported(tmp_path, axes, probability):
    found = made(tmp_path, CampaignCfg(episodes=20, axes=axes), probability)
    html_page(found, compare(found, found))
    latex_table(found)
    assert sum(int(line["episodes"]) for line in csv.DictReader(io.StringIO(csv_table(found)))) == 20


def test_two_campaigns_are_compared_pair_by_pair(campaign, tmp_path):
    better = made(tmp_path / "better", campaign.cfg, 0.95)
    found = compare(campaign, better)
    pairs = list(zip(campaign.rows, better.rows, strict=True))
    assert found.test.pairs == 120
    assert found.test.only_second == sum(two["success"] is True and one["success"] is False for one, two in pairs)
    assert found.test.only_first == 0  # the same draw lies below 0.75 and above 0.95 for no seed
    assert found.test.p_value < 0.001
    assert "McNemar" in html_page(campaign, found)


def test_campaigns_of_other_seeds_are_not_compared(campaign, tmp_path):
    other = made(tmp_path / "other", CampaignCfg(episodes=120, axes=GRID, seed=1), 0.75)
    with pytest.raises(CampaignError, match="seed"):
        compare(campaign, other)


def test_the_command_writes_page_and_tables(campaign, capsys):
    assert main(["report", str(campaign.folder), "--against", str(campaign.folder)]) == 0
    for name in ("report.html", "report.csv", "report.tex"):
        assert (campaign.folder / name).stat().st_size > 100
    assert "success" in capsys.readouterr().out


def test_a_folder_without_a_campaign_is_named(tmp_path, capsys):
    assert main(["report", str(tmp_path)]) == 2
    assert "manifest.json" in capsys.readouterr().err
