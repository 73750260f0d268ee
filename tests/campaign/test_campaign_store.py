"""The store: nothing finished is lost, nothing is taken twice, and what is broken is named."""

import json
import resource
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from campaign_jobs import row

from auvdock.campaign.axes import AxisCfg
from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.errors import CampaignError
from auvdock.campaign.plan import Plan
from auvdock.campaign.provenance import manifest_of
from auvdock.campaign.store import JOURNAL, Store, read_campaign, read_table
from auvdock.core.errors import ConfigError

CFG = CampaignCfg(episodes=250, axes=(AxisCfg("current", low=0.0, high=0.5, count=3),))
PLAN = Plan(CFG)
ROWS = [row(PLAN[index], index % 7 != 0) for index in range(250)]


def opened(folder, cfg=CFG, resume=False):
    return Store(folder, cfg, manifest_of(cfg), resume)


def filled(folder, rows):
    store = opened(folder)
    for entry in rows:
        store.add(entry)
    return store


def test_rows_come_back_as_they_were_in_order(tmp_path):
    filled(tmp_path, reversed(ROWS)).close()
    assert read_table(tmp_path).to_pylist() == ROWS
    assert len(list(tmp_path.glob("rows-*.parquet"))) == 3


def test_a_store_that_was_never_closed_keeps_every_row(tmp_path):
    filled(tmp_path, ROWS[:130]).abandon()
    assert read_table(tmp_path).to_pylist() == ROWS[:130]
    store = opened(tmp_path, resume=True)
    assert store.finished == set(range(130))
    store.close()
    assert read_table(tmp_path).to_pylist() == ROWS[:130]


def test_a_last_line_that_was_cut_short_is_no_row(tmp_path):
    filled(tmp_path, ROWS[:10]).abandon()
    journal = tmp_path / JOURNAL
    journal.write_bytes(journal.read_bytes()[:-25])
    store = opened(tmp_path, resume=True)
    assert store.finished == set(range(9))
    store.add(ROWS[9])
    store.close()
    assert read_table(tmp_path).to_pylist() == ROWS[:10]


def test_a_death_between_shard_and_journal_counts_no_row_twice(tmp_path):
    filled(tmp_path, ROWS[:50]).abandon()
    before = (tmp_path / JOURNAL).read_bytes()
    opened(tmp_path, resume=True).close()
    (tmp_path / JOURNAL).write_bytes(before)  # the shard is there, the journal not yet emptied
    assert read_table(tmp_path).to_pylist() == ROWS[:50]
    store = opened(tmp_path, resume=True)
    store.add(ROWS[50])
    store.close()
    assert sum(pq.read_metadata(path).num_rows for path in tmp_path.glob("rows-*.parquet")) == 51


def test_a_half_written_shard_is_named_and_nothing_is_changed(tmp_path):
    filled(tmp_path, ROWS).close()
    shard = min(tmp_path.glob("rows-*.parquet"))
    shard.write_bytes(shard.read_bytes()[: shard.stat().st_size // 2])
    before = {path.name: path.read_bytes() for path in tmp_path.glob("rows-*")}
    for attempt in (lambda: read_table(tmp_path), lambda: opened(tmp_path, resume=True)):
        with pytest.raises(CampaignError, match=f"{shard.name}.*delete it"):
            attempt()
    assert {path.name: path.read_bytes() for path in tmp_path.glob("rows-*")} == before
    shard.unlink()
    store = opened(tmp_path, resume=True)
    missing = [entry for entry in ROWS if entry["episode"] not in store.finished]
    assert len(missing) == 100
    for entry in missing:
        store.add(entry)
    store.close()
    assert read_table(tmp_path).to_pylist() == ROWS


def test_leftovers_of_a_killed_writer_are_ignored(tmp_path):
    filled(tmp_path, ROWS[:10]).abandon()
    (tmp_path / ".tmp-rows-000000.parquet").write_bytes(b"PAR1 half")
    assert read_table(tmp_path).to_pylist() == ROWS[:10]
    opened(tmp_path, resume=True).close()
    assert not list(tmp_path.glob(".tmp-*"))


def test_a_damaged_line_in_the_middle_of_the_journal_is_named(tmp_path):
    filled(tmp_path, ROWS[:10]).abandon()
    lines = (tmp_path / JOURNAL).read_text(encoding="utf-8").splitlines()
    lines[4] = lines[4][:30]
    (tmp_path / JOURNAL).write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(CampaignError, match="line 5"):
        read_table(tmp_path)


def test_a_campaign_is_not_overwritten(tmp_path):
    filled(tmp_path, ROWS[:10]).close()
    with pytest.raises(CampaignError, match="--resume"):
        opened(tmp_path)


def test_another_campaign_cannot_resume_it(tmp_path):
    filled(tmp_path, ROWS[:10]).close()
    with pytest.raises(ConfigError, match="seed"):
        opened(tmp_path, CampaignCfg(episodes=250, axes=CFG.axes, seed=1), resume=True)


def test_a_grid_can_be_extended(tmp_path):
    filled(tmp_path, ROWS).close()
    longer = CampaignCfg(episodes=300, axes=CFG.axes)
    store = opened(tmp_path, longer, resume=True)
    assert len(store.finished) == 250
    store.close()
    assert read_campaign(tmp_path) == longer


def test_two_writers_are_kept_apart(tmp_path):
    store = filled(tmp_path, ROWS[:10])
    with pytest.raises(CampaignError, match="another sweep"):
        opened(tmp_path, resume=True)
    store.close()


def test_a_folder_that_cannot_be_written_is_named():
    with pytest.raises(CampaignError, match="cannot be written"):
        opened(Path("/sys/auvdock-campaign"))


def test_a_file_in_the_folder_s_place_is_named(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(CampaignError, match="cannot be written"):
        opened(tmp_path / "file" / "campaign")


FULL = """
import resource, signal, sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from test_campaign_store import ROWS, opened
from auvdock.campaign.errors import CampaignError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
store = opened(Path({folder!r}))
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
try:
    for count, row in enumerate(ROWS):
        store.add(row)
except CampaignError as error:
    store.abandon()
    print(count)
    sys.exit(str(error))
"""


def test_a_disk_that_fills_up_costs_no_finished_row(tmp_path):
    """The kernel cuts a write short in mid-line, as a full disk does."""
    script = FULL.format(tests=str(Path(__file__).parent), folder=str(tmp_path), limit=20_000)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert "cannot be written" in done.stderr
    assert "--resume" in done.stderr
    written = int(done.stdout)
    assert 10 < written < 100
    assert read_table(tmp_path).to_pylist() == ROWS[:written]
    store = opened(tmp_path, resume=True)
    for entry in ROWS[written:]:
        store.add(entry)
    store.close()
    assert read_table(tmp_path).to_pylist() == ROWS


def test_a_shard_that_finds_no_room_stays_in_the_journal(tmp_path):
    store = filled(tmp_path, ROWS[:99])
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    size = (tmp_path / JOURNAL).stat().st_size
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, hard))  # less than the shard needs
        with pytest.raises(CampaignError, match="cannot be written"):
            store.flush()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
        with suppress(CampaignError):
            store.abandon()
    assert (tmp_path / JOURNAL).stat().st_size == size
    assert not list(tmp_path.glob(".tmp-*"))
    assert read_table(tmp_path).to_pylist() == ROWS[:99]


def test_the_manifest_tells_versions_and_campaign(tmp_path):
    filled(tmp_path, ROWS[:10]).close()
    manifest = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))
    (session,) = manifest["sessions"]
    assert set(session["versions"]) >= {"auvdock", "mujoco", "numpy", "opencv", "python"}
    assert "git_revision" in session
    assert manifest["campaign"]["seed"] == 0
    assert manifest["base_config"]["world"]["sim"]["vehicle"] == "remus_hybrid"


def test_a_resume_with_other_software_is_noted(tmp_path):
    filled(tmp_path, ROWS[:10]).close()
    store = opened(tmp_path, resume=True)
    assert not store.is_mixed
    store.close()
    changed = manifest_of(CFG)
    changed["session"]["versions"] = {**changed["session"]["versions"], "mujoco": "0.0"}
    store = Store(tmp_path, CFG, changed, resume=True)
    assert store.is_mixed
    store.close()
    assert len(json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))["sessions"]) == 3
