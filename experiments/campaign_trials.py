"""Trials of campaigns at full episode length: kills, executors, lost nodes, full disks, memory, scaling.

`python -m auvdock.experiments.campaign_trials TRIAL --folder DIR [--episodes N]` prints one JSON object. They take
minutes, so the tests have short forms of them; these are what the figures in docs/campaigns.md come from.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from auvdock.campaign.store import read_table

__all__ = ["TRIALS", "executors", "kills", "main", "memory", "ray_nodes", "scaling", "store"]

CONDITIONS = ("--station", "conical", "--fidelity", "beacons", "--current", "0:0.5:2", "--attenuation", "0.2:1.2:2")
KILLS = 10
START_LIMIT_S = 180.0


def kills(folder: Path, episodes: int, seed: int = 0) -> dict[str, Any]:
    """Kill -9 one campaign ten times at random moments, resume it each time, and compare with an undisturbed run.

    Every other kill takes the whole process group, the others the parent alone, whose workers must end by themselves.
    """
    whole = _table(folder / "whole", "--episodes", str(episodes))
    out, rng = folder / "killed", np.random.default_rng(seed)
    found: list[int] = []
    kept: dict[int, dict[str, Any]] = {}
    lost = 0
    while len(found) < KILLS:
        resume = ["--resume"] if (out / "manifest.json").exists() else []
        process = subprocess.Popen(
            _sweep(out, "--episodes", str(episodes), *resume),
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        before, wanted = _finished(out), int(rng.integers(0, max(2, 2 * episodes // (KILLS + 1))))
        while _finished(out) < min(before + wanted, episodes - 1) and process.poll() is None:
            time.sleep(0.01)
        time.sleep(float(rng.uniform(0.0, 3.0)))
        if process.poll() is not None:
            break  # it ended before it was killed: too few episodes for ten kills
        (os.killpg if len(found) % 2 else os.kill)(process.pid, signal.SIGKILL)
        process.wait()
        rows = {row["episode"]: row for row in read_table(out).to_pylist()} if (out / "manifest.json").exists() else {}
        lost += sum(rows.get(episode) != row for episode, row in kept.items())
        kept = rows
        found.append(len(rows))
    table = _table(out, "--episodes", str(episodes), "--resume")
    return {
        "episodes": episodes,
        "kills": len(found),
        "rows_after_each_kill": found,
        "finished_rows_lost_or_changed": lost + sum(table.to_pylist()[episode] != row for episode, row in kept.items()),
        "rows_stored_twice": _finished(out) - table.num_rows,
        "equals_undisturbed": bool(table.equals(whole)),
    }


def executors(folder: Path, episodes: int) -> dict[str, Any]:
    """The same campaign in every executor; the rows must be the same, bit for bit."""
    runs = {
        "serial": ("--executor", "serial"),
        "process 1": ("--workers", "1"),
        "process 2": ("--workers", "2"),
        "process 4": ("--workers", "4"),
        "ray 2": ("--executor", "ray", "--workers", "2"),
    }
    tables = {
        name: _table(folder / name.replace(" ", "-"), "--episodes", str(episodes), *f) for name, f in runs.items()
    }
    first = tables["serial"]
    return {"episodes": episodes, "equals_serial": {name: bool(table.equals(first)) for name, table in tables.items()}}


def ray_nodes(folder: Path, episodes: int) -> dict[str, Any]:
    """A cluster of two nodes on this machine, one of which is killed in the middle of the campaign."""
    os.environ["RAY_AUTH_MODE"] = "disabled"
    ray, port = str(Path(sys.executable).with_name("ray")), "6399"
    address = f"127.0.0.1:{port}"
    head = [ray, "start", "--head", "--port", port, "--num-cpus", "1", "--include-dashboard", "false", "--block"]
    second = [ray, "start", "--address", address, "--num-cpus", "1", "--block"]
    nodes = [_background(head)]
    try:
        _await_nodes(ray, address, 1)
        nodes.append(_background(second))
        _await_nodes(ray, address, 2)
        out = folder / "cluster"
        flags = ("--episodes", str(episodes), "--executor", "ray", "--address", address, "--workers", "2")
        process = subprocess.Popen(_sweep(out, *flags), stdout=subprocess.PIPE, text=True)
        while _finished(out) < episodes // 3 and process.poll() is None:
            time.sleep(0.05)
        at = _finished(out)
        os.killpg(nodes[1].pid, signal.SIGKILL)
        printed = process.communicate()[0]
    finally:
        for node in nodes:
            if node.poll() is None:
                os.killpg(node.pid, signal.SIGTERM)
    if process.returncode:
        raise RuntimeError(f"the campaign ended with {process.returncode} after {at} episodes")
    table, summary = read_table(out), json.loads(printed)
    whole = _table(folder / "whole", "--episodes", str(episodes))
    return {
        "episodes": table.num_rows,
        "finished_when_the_node_died": at,
        "exit": process.returncode,
        "equals_undisturbed": bool(table.equals(whole)),
        "failures": summary["failures"],
    }


def store(folder: Path, episodes: int) -> dict[str, Any]:
    """A full disk, a read-only folder and a half-written shard; needs to be root, for a small tmpfs."""
    found: dict[str, Any] = {}
    small = folder / "small"
    small.mkdir(parents=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(small)], check=True)
    try:
        flags = ("--episodes", str(episodes), "--world.limits.max-time-s", "1")
        done = _run(small / "out", *flags)
        found["disk full"] = {"exit": done.returncode, "says": done.stderr.strip().splitlines()[-1:]}
        kept = read_table(small / "out").num_rows
        subprocess.run(["mount", "-o", "remount,size=64m", str(small)], check=True)
        done = _run(small / "out", *flags, "--resume")
        found["room made"] = {"exit": done.returncode, "kept": kept, "rows": read_table(small / "out").num_rows}
        subprocess.run(["mount", "-o", "remount,ro", str(small)], check=True)
        done = _run(small / "other", *flags)
        found["read-only"] = {"exit": done.returncode, "says": done.stderr.strip().splitlines()[-1:]}
        subprocess.run(["mount", "-o", "remount,rw", str(small)], check=True)
        shard = sorted((small / "out").glob("rows-*.parquet"))[0]
        whole = read_table(small / "out")
        shard.write_bytes(shard.read_bytes()[: shard.stat().st_size // 2])
        done = _run(small / "out", *flags, "--resume")
        found["half shard"] = {"exit": done.returncode, "says": done.stderr.strip().splitlines()[-1:]}
        shard.unlink()
        done = _run(small / "out", *flags, "--resume")
        found["shard deleted"] = {"exit": done.returncode, "equal": bool(read_table(small / "out").equals(whole))}
    finally:
        subprocess.run(["umount", str(small)], check=True)
    return found


def memory(folder: Path, episodes: int) -> dict[str, Any]:
    """Peak memory of the default grid of 36 cells after a tenth of the episodes, and after all of them."""
    flags = ("--station", "conical", "--fidelity", "beacons", "--current", "0:0.5:6", "--attenuation", "0.2:1.2:6")
    peaks: dict[int, float] = {}
    for count in (episodes // 10, episodes):
        words = [*_PROGRAM, *flags, "--episodes", str(count), "--out", str(folder / f"memory-{count}"), "--json"]
        peaks[count] = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)[
            "peak_rss_mb"
        ]
    return {"peak_rss_mb": peaks}


def scaling(folder: Path, episodes: int) -> dict[str, Any]:
    """Wall-clock time with one and two workers; efficiency is the first over twice the second."""
    walls = [
        json.loads(_run(folder / f"scaling-{n}", "--episodes", str(episodes), "--workers", str(n)).stdout)["wall_s"]
        for n in (1, 2)
    ]
    return {"episodes": episodes, "wall_s": walls, "efficiency": walls[0] / (2.0 * walls[1])}


TRIALS: dict[str, Callable[[Path, int], dict[str, Any]]] = {
    "kills": kills,
    "executors": executors,
    "ray-nodes": ray_nodes,
    "store": store,
    "memory": memory,
    "scaling": scaling,
}
"""Trials by name."""

_PROGRAM = (sys.executable, "-m", "auvdock.cli", "sweep")


def _sweep(out: Path, *flags: str) -> list[str]:
    return [*_PROGRAM, *CONDITIONS, *flags, "--out", str(out), "--json"]


def _run(out: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(_sweep(out, *flags), capture_output=True, text=True, check=False)


def _table(out: Path, *flags: str) -> Any:  # noqa: ANN401 - pyarrow has no types
    done = _run(out, *flags)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return read_table(out)


def _background(words: Sequence[str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(words, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _await_nodes(ray: str, address: str, count: int) -> None:
    deadline = time.monotonic() + START_LIMIT_S
    while time.monotonic() < deadline:
        words = [ray, "status", "--address", address]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.stdout.count(" node_") >= count:
            return
        time.sleep(1.0)
    raise RuntimeError(f"no {count} nodes at {address} within {START_LIMIT_S:g} s")


def _finished(out: Path) -> int:
    """Rows in shards and journal, as they lie there."""
    journal = out / "journal.jsonl"
    return _sharded(out) + (journal.read_bytes().count(b"\n") if journal.exists() else 0)


def _sharded(out: Path) -> int:
    return sum(pq.ParquetFile(path).metadata.num_rows for path in out.glob("rows-*.parquet"))


def main(argv: Sequence[str] | None = None) -> dict[str, Any]:
    """Run one trial."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trial", choices=sorted(TRIALS))
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--episodes", type=int, default=33)
    args = parser.parse_args(argv)
    args.folder.mkdir(parents=True, exist_ok=True)
    return TRIALS[args.trial](args.folder, args.episodes)


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main()) + "\n")
