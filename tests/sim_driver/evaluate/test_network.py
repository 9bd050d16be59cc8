"""What links were like over a mission, by what the robots noted of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.evaluate.network import link_rows
from mrslam.sim_driver.evaluate.results import RunResults, link_totals
from mrslam.sim_driver.missions.mission import make_mission

TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual"},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1"}, {"id": "r2"}, {"id": "r3"}],
    "comms": {"link_threshold": 0.6},
}


def row_of(tmp_path: Path, *noted: dict[str, Any], end_s: float = 100.0) -> dict[str, Any]:
    """Return the row of the link between r1 and r2, of which r1 noted this."""
    (tmp_path / "r1").mkdir()
    lines = [json.dumps({"robot": "r1", **event}) for event in noted]
    (tmp_path / "r1" / "events.jsonl").write_text("\n".join(lines) + "\n")
    run = RunResults.of(make_mission(TABLES, tmp_path / "links.toml"), tmp_path)
    run.metrics["mission_s"] = end_s
    assert not run.damage
    return next(row for row in link_rows(run) if (row["a"], row["b"]) == ("r1", "r2"))


def seen(t: float, peer: str = "r2") -> dict[str, Any]:
    return {"t": t, "event": "peer_seen", "peer": peer}


def gone(t: float, peer: str = "r2") -> dict[str, Any]:
    return {"t": t, "event": "peer_gone", "peer": peer, "reason": "silent"}


def quality(t: float, value: float, peer: str = "r2") -> dict[str, Any]:
    return {"t": t, "event": "link_changed", "peer": peer, "quality": value}


def test_quality_is_weighed_by_time_and_nothing_while_the_peer_is_out_of_sight(tmp_path: Path) -> None:
    row = row_of(tmp_path, quality(10.0, 0.8), quality(20.0, 1.0, "r3"), quality(30.0, 0.4), gone(50.0))
    assert row["quality_mean"] == pytest.approx(0.8 * 0.2 + 0.4 * 0.2)  # of 100 s: 20 and 20
    assert row["share_strong"] == pytest.approx(0.2)


def test_what_was_noted_after_the_missions_end_does_not_count(tmp_path: Path) -> None:
    row = row_of(tmp_path, quality(10.0, 0.8), quality(104.0, 0.4))
    assert (row["quality_mean"], row["share_strong"]) == (pytest.approx(0.8 * 0.9), pytest.approx(0.9))


def test_time_in_sight_ends_when_the_peer_is_gone_or_the_mission_ends(tmp_path: Path) -> None:
    row = row_of(tmp_path, seen(10.0), seen(20.0, "r3"), gone(30.0), gone(40.0, "r3"), gone(50.0), seen(90.0))
    assert row["in_sight_s"] == 30.0


def test_exchanges_are_counted_by_peer_and_by_who_opened_them(tmp_path: Path) -> None:
    sizes = {"bytes_sent": 1, "bytes_received": 1, "bytes_full_lz4": 2, "bytes_full_raw": 3}
    begun = [
        {"t": t, "event": "exchange_started", "peer": peer, "opened_by_me": mine}
        for t, peer, mine in ((1.0, "r2", True), (2.0, "r3", True), (3.0, "r2", False), (4.0, "r2", False))
    ]
    ended = [
        {"t": t, "event": f"exchange_{kind}", "peer": "r2", "reason": "", **sizes}
        for t, kind in ((5.0, "done"), (6.0, "done"), (7.0, "failed"))
    ]
    assert row_of(tmp_path, *begun, *ended)["exchanges"] == {"started": 3, "done": 2, "failed": 1, "opened": 1}


def test_the_totals_of_a_link_are_of_both_directions() -> None:
    def link(peer: str, exchanges: int, sent: int) -> dict[str, Any]:
        sizes = {"bytes_sent": sent, "bytes_full_lz4": 2 * sent, "bytes_full_raw": 3 * sent}
        return {"peer": peer, "exchanges": exchanges, **sizes}

    robots = {"r1": {"links": [link("r3", 9, 900), link("r2", 4, 100)]}, "r2": {"links": [link("r1", 3, 20)]}}
    assert link_totals(robots, "r1", "r2") == {
        "a": "r1", "b": "r2", "exchanges": 4, "bytes_sent": 120, "bytes_full_lz4": 240, "bytes_full_raw": 360,
    }  # fmt: skip
