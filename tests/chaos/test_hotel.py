"""What `bench.hotel` counts: wrong places and for how long, robots that met, and what the missions of a run give."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench import hotel
from bench.chaos.scene import Frames
from mrslam.agent.pairs.hints import Hints
from mrslam.spatial import se2

ARENA = {
    "world": {"name": "arena2"},
    "robots": [{"id": "r1", "laser": "lidar-360"}, {"id": "r2", "laser": "lidar-360"}],
}
PLAN = hotel.Plan("hotel", 2, 20.0, 0, False, ARENA)


def test_robots_that_met_and_merged_rightly_are_counted() -> None:
    row = hotel.play(4, PLAN)
    assert (row["wrong_s"], row["wrong_met_s"], row["wrong_at_end"]) == (0.0, 0.0, [])
    assert (row["met"], row["met_merged"], row["placed_at_end"]) == (2, 2, 2)
    assert 0.0 <= max(row["merge_s"]) <= PLAN.seconds
    assert 0.0 < row["first_merge_s"] < PLAN.seconds
    assert row["bytes"]["bulk"] > row["bytes"]["of_beacons_sightings"] > 0


def test_wrong_places_are_counted_by_robot_and_time(monkeypatch: pytest.MonkeyPatch) -> None:
    def elsewhere(frames: Frames, robot_id: str, epoch: int) -> Any:
        frame = of(frames, robot_id, epoch)
        return frame if frame is None or robot_id == "r1" else se2.compose(frame, np.array([0.6, 0.0, 0.0]))

    merged_s = hotel.play(4, PLAN)["first_merge_s"]
    of = Frames.of
    monkeypatch.setattr(Frames, "of", elsewhere)
    row = hotel.play(4, PLAN)
    assert row["wrong_at_end"] == ["r1-r2", "r2-r1"]
    assert (row["met"], row["met_merged"], row["placed_at_end"]) == (2, 0, 2)
    assert row["merge_s"] == [np.inf, np.inf]
    held_s = PLAN.seconds - merged_s
    assert row["wrong_met_s"] == pytest.approx(held_s, abs=1.0)
    assert row["wrong_met_s"] <= row["wrong_s"] <= 2.0 * held_s + 1.0


def test_the_lines_figures_are_those_of_all_missions_that_did_not_die() -> None:
    row = {"seed": 1, "robots": 2, "wrong_s": 3.0, "wrong_met_s": 1.0, "wrong_at_end": [], "placed_at_end": 2, "met": 2}
    row |= {"met_merged": 2, "merge_s": [0.0, 4.0], "first_merge_s": 5.0}
    other = row | {"seed": 3, "wrong_met_s": 7.5, "wrong_at_end": ["r1-r2"], "merge_s": [6.0, np.inf], "met_merged": 1}
    rows = [
        row | {"bytes": {"bulk": 60, "beacon": 35, "of_beacons_sightings": 5}},
        hotel.died(2),
        other | {"bytes": {}},
    ]
    line = hotel.summary(rows, "hotel")
    assert line["missions"] == 2
    assert line["died_seeds"] == [2]
    assert (line["wrong_s"], line["wrong_met_s"], line["wrong_at_end"], line["wrong_seeds"]) == (6.0, 7.5, 1, [3])
    assert (line["robots"], line["placed_at_end"], line["met"], line["met_merged"]) == (4, 4, 4, 3)
    assert line["merge_s"] == [6.0, None]
    assert line["first_merge_s"] == 5.0
    assert (line["bytes"], line["sightings_share"]) == (95, round(5 / 95, 4))


@pytest.mark.parametrize("last", [{"died": True}, None])
def test_a_run_that_lost_a_mission_fails_and_keeps_the_others(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, last: dict[str, Any] | None
) -> None:
    whole = hotel.play(4, hotel.Plan("hotel", 2, 1.0, 0, False, ARENA))
    rows = [whole | {"seed": 0, "bytes": dict(whole["bytes"])}, (last or whole) | {"seed": 1}]
    monkeypatch.setattr(hotel, "play_all", lambda play, seeds, workers, died: iter(rows))
    monkeypatch.setattr("sys.argv", ["hotel", "--missions", "2", "--rows", str(tmp_path / "rows")])
    assert hotel.main() == int(last is not None)
    assert [json.loads(row)["seed"] for row in (tmp_path / "rows").read_text().splitlines()] == [0, 1]
    line = json.loads(capsys.readouterr().out)
    assert (line["missions"], line["died_seeds"]) == ((1, [1]) if last else (2, []))


def test_a_liar_says_places_away_from_the_right_ones_every_few_seconds() -> None:
    beliefs: Any = {("r1", "r2"): None, ("r2", "r3"): None}
    lies = hotel.Lies("r1")
    lies._found = lambda _: [("r2", np.array([5.0, 1.0, 0.0]))]  # type: ignore[method-assign,assignment]
    assert isinstance(lies, Hints)
    assert lies.news(beliefs, hotel.LIE_NS + 1) == []
    ((robot, said),) = lies.news(beliefs, hotel.LIE_NS)
    assert robot == "r2"
    assert 0.0 < np.hypot(*(said[:2] - [5.0, 1.0])) <= 4.0 * np.sqrt(2.0)
    assert not np.array_equal(lies.news(beliefs, 2 * hotel.LIE_NS)[0][1], said)
