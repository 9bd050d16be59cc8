"""When a robot first saw a place: from its scans, one at least wherever it moved or turned, at mission time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Sensed
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.trajectories import Trajectory
from mrslam.sim_driver.feeds import Reading
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.report import seen as module
from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.report.seen import first_seen_s, mission_trajectory, spread
from mrslam.spatial import Scan
from mrslam.spatial.files.tum import read_tum, write_tum

S = 1_000_000_000


def looking_ahead(stamp_ns: int) -> Scan:
    """A scan of one beam, 3 m long."""
    return Scan(
        stamp_ns=stamp_ns, ranges_m=np.full(1, 3.0, dtype=np.float32), angle_min_rad=0.0, angle_increment_rad=0.1,
        range_max_m=10.0,
    )  # fmt: skip


def run(
    poses: np.ndarray,
    log: str | None = None,
    began_s: float = 0.0,
    shell: str = "virtual",
    events: Sequence[dict[str, Any]] = (),
    way: Trajectory | None = None,
) -> Any:
    robot = SimpleNamespace(id="r1", log=log)
    mission = SimpleNamespace(robots=[robot], mission=SimpleNamespace(shell=shell))
    stamps = np.arange(len(poses)) * S
    way = (stamps, poses) if way is None else way
    return SimpleNamespace(
        mission=mission, trajectory=lambda robot: way, began_s=lambda robot: began_s, events={"r1": events}
    )


def test_a_robot_that_turns_on_the_spot_sees_what_is_around_it(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = np.array([[5.0, 5.0, turn] for turn in (0.0, 0.1, np.pi / 2, np.pi)])
    scans = [Sensed(k * S, looking_ahead(k * S), None) for k in range(4)]
    monkeypatch.setattr(module, "_scans", lambda run, robot: scans)
    layout = Layout("r1", "r1", {"r1": np.zeros(3)}, ("r1",), 0.25, np.zeros((40, 40), dtype=np.int8))
    seen = first_seen_s(run(poses), layout, "r1")
    assert [seen[20, 30], seen[30, 20], seen[20, 10]] == [0.0, 2.0, 3.0]
    assert not np.isfinite(seen[22, 31])  # turned too little to be looked at anew


@pytest.mark.parametrize(("log", "shell"), [("a.log", "virtual"), (None, "agents")])
def test_who_began_late_saw_nothing_before(log: str | None, shell: str) -> None:
    late = run(np.zeros((3, 3)), log, began_s=40.0, shell=shell)
    assert (mission_trajectory(late, "r1")[0] / S).tolist() == [40.0, 41.0, 42.0]
    assert (mission_trajectory(run(np.zeros((3, 3)), began_s=40.0), "r1")[0] / S).tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("rest_ns", [0, 357, 1500, 2500])
def test_scans_of_a_log_with_nanoseconds_find_their_poses_in_a_file_of_microseconds(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, rest_ns: int
) -> None:
    stamps_ns = 1_700_000_000 * S + np.arange(3) * S + rest_ns
    write_tum(tmp_path / "way.tum", stamps_ns, np.array([[5.1, 5.1, turn] for turn in (0.0, 1.57, 3.14)]))
    way = read_tum(tmp_path / "way.tum")
    scans = [Sensed((40 + k) * S, looking_ahead(int(stamp_ns)), None) for k, stamp_ns in enumerate(stamps_ns)]
    monkeypatch.setattr(module, "_scans", lambda run, robot: scans)
    layout = Layout("r1", "r1", {"r1": np.zeros(3)}, ("r1",), 0.25, np.zeros((40, 40), dtype=np.int8))
    seen = first_seen_s(run(way[1], "a.log", 40.0, way=way), layout, "r1")
    assert [seen[20, 30], seen[30, 20], seen[20, 10]] == [40.0, 41.0, 42.0]


def test_a_recorded_robot_that_gave_its_map_up_begins_its_way_where_its_last_map_began() -> None:
    events = [{"t": 0.5, "event": "mapped"}, {"t": 49.0, "event": "given_up"}, {"t": 50.0, "event": "mapped"}]
    for told, begun_s in ((events, 50.0), (events[:1], 40.0)):
        anew = run(np.zeros((3, 3)), "a.log", began_s=40.0, events=told)
        assert (mission_trajectory(anew, "r1")[0] / S).tolist() == [begun_s, begun_s + 1.0, begun_s + 2.0]


def test_beams_that_hit_nothing_show_nothing_and_short_steps_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = np.array([[2.1 + 0.1 * k, 5.1, 0.0] for k in range(6)])
    scans = [Sensed(k * S, looking_ahead(k * S), None) for k in range(6)]
    scans[0] = Sensed(0, replace(looking_ahead(0), ranges_m=np.full(1, np.inf, dtype=np.float32)), None)
    monkeypatch.setattr(module, "_scans", lambda run, robot: scans)
    layout = Layout("r1", "r1", {"r1": np.zeros(3)}, ("r1",), 0.25, np.zeros((40, 40), dtype=np.int8))
    seen = first_seen_s(run(poses), layout, "r1")
    assert sorted(set(seen[np.isfinite(seen)].tolist())) == [0.0, 3.0]  # cast every 0.25 m
    assert (seen == 0.0).sum() <= 2 and np.flatnonzero(seen[20] == 3.0)[-1] in (20, 21)  # 3 m ahead


def test_without_scans_a_place_is_seen_when_the_robot_is_first_near_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    poses = np.array([[1.0, 5.0, 0.0], [4.0, 5.0, 0.0], [1.0, 5.0, 0.0]])
    bare = run(poses)
    bare.mission.replay, bare.folder = None, tmp_path
    layout = Layout("r1", "r1", {"r1": np.zeros(3)}, ("r1",), 0.25, np.zeros((40, 80), dtype=np.int8))
    seen = first_seen_s(bare, layout, "r1")
    assert (seen[20, 4], seen[20, 16], seen[20, 8]) == (0.0, 1.0, 0.0)
    reach = module.SIGHT_M / 2 / 0.25
    assert np.isfinite(seen[20, round(16 + reach) - 1]) and not np.isfinite(seen[20, round(16 + reach) + 2])


def test_scans_of_a_run_that_was_played_again_are_those_of_the_first(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    (first / "r1").mkdir(parents=True)
    (first / "r1" / module.SCANS_FILE).touch()
    monkeypatch.setattr(module, "read_recording", lambda path: [path])
    bare = run(np.zeros((1, 3)))
    bare.folder, bare.mission.replay, bare.tried = again, first, lambda path, reader, otherwise, keep: reader(path)
    assert module._scans(bare, "r1") == [first / "r1" / module.SCANS_FILE]
    bare.mission.replay = None
    assert module._scans(bare, "r1") == []


def results(folder: Path, log: str) -> RunResults:
    """A run of two robots that played a log and left nothing."""
    robots = [{"id": f"r{k}", "log": log} for k in (1, 2)]
    mission = make_mission({"robots": robots, "truth": {"relations": "gone.relations"}}, folder / "two.toml")
    return RunResults(folder, mission, {}, {})


def test_a_log_that_was_moved_or_is_another_one_now_is_noted_once(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    moved = results(tmp_path, "gone.log")
    assert [module._scans(moved, robot) for robot in ("r1", "r2")] == [[], []]
    assert len(moved.damage) == 1 and moved.damage[0].startswith("gone.log: not found in")
    (tmp_path / "short.log").touch()
    monkeypatch.setattr(module, "shared_readings", lambda path: [])
    other = results(tmp_path, "short.log")
    assert module._scans(other, "r1") == [] and "holds no scan" in other.damage[0]


def test_scans_of_a_log_are_not_kept_once_they_are_cast(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "some.log").touch()
    readings = [Reading(looking_ahead(k * S), None) for k in range(3)]
    monkeypatch.setattr(module, "shared_readings", lambda path: readings)
    run = results(tmp_path, "some.log")
    assert len(module._scans(run, "r1")) == 3 and not run._kept and not run.damage


def test_only_known_places_between_the_beams_take_the_time_of_their_neighbours() -> None:
    seen = np.full((3, 5), np.inf, dtype=np.float32)
    seen[1, 0], seen[1, 4] = 2.0, 7.0
    known = np.zeros((3, 5), dtype=bool)
    known[1, :4] = True
    filled = spread(seen, known)
    assert filled[1].tolist()[:2] == [2.0, 2.0] and filled[1, 3:].tolist() == [7.0, 7.0]
    assert not np.isfinite(filled[[0, 2]]).any()
