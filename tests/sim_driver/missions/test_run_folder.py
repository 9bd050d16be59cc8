"""Damaged run folders: one line that names the file, and what is whole is used."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import pytest

from mrslam.agent import check_saved_id
from mrslam.agent.pairs.belief import Status
from mrslam.sim_driver.missions.run_folder import (
    EventFile,
    read_config,
    read_events,
    read_metrics,
    read_robot,
    robots_of,
)
from mrslam.sim_driver.missions.usage import read_usage
from mrslam.spatial import InputError

PAIR = {
    "a": "r1",
    "b": "r2",
    "status": "accepted",
    "T_a_b": [0, 1, 2],
    "accepted_at_s": 3,
    "confidence": 0.9,
    "reason": "",
}
ROBOT = {
    "id": "r1",
    "mode": "distributed",
    "known_area_m2": 2,
    "team_area_m2": 2,
    "placed": {"r1": [0, 0, 0]},
    "pairs": [PAIR],
    "links": [],
}
METRICS = {"name": "x", "mission_s": 20.5, "robots_lost": [], "links": []}
CONFIG = {"mission": {}, "robots": [{"id": "r1"}], "settings": {}}
READERS = {
    "config.json": (CONFIG, read_config),
    "metrics.json": (METRICS, read_metrics),
    "robot.json": (ROBOT, read_robot),
}


@pytest.mark.parametrize("name", READERS)
def test_whole_files_are_returned_as_they_are(name: str, tmp_path: Path) -> None:
    table, read = READERS[name]
    (tmp_path / name).write_text(json.dumps({**table, "more": 1}))
    assert read(tmp_path) == {**table, "more": 1}


@pytest.mark.parametrize("status", get_args(Status))
def test_whatever_a_robot_believes_of_a_pair_can_be_read(status: str, tmp_path: Path) -> None:
    (tmp_path / "robot.json").write_text(json.dumps({**ROBOT, "pairs": [{**PAIR, "status": status}]}))
    assert read_robot(tmp_path)["pairs"][0]["status"] == status


def test_events_of_saved_maps_with_the_longest_names_are_read(tmp_path: Path) -> None:
    longest = f"{'o' * 64}@{'m' * 64}"
    check_saved_id(longest, "the name")
    pair = {"t": 1.0, "robot": "r1", "a": longest, "b": "r1"}
    events = [
        {"t": 1.0, "robot": "r1", "event": "map_updated", "robot_id": longest},
        {**pair, "event": "merged", "T_a_b": [0, 0, 0], "confidence": 0.9},
        {**pair, "event": "unmerged", "reason": "walls"},
    ]
    (tmp_path / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))
    read = read_events(tmp_path)
    assert read.events == events and not read.damage


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("raw", [b"", b"\x00" * 40, b"[]", b"null", b"{}", b'"text"', b"\xff\xfe{"])
def test_damaged_files_are_refused_in_one_line(name: str, raw: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(raw)
    with pytest.raises(InputError, match=rf"{name}: empty, cut off or damaged") as told:
        READERS[name][1](tmp_path)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("name", READERS)
def test_files_cut_off_anywhere_are_refused(name: str, tmp_path: Path) -> None:
    table, read = READERS[name]
    whole = json.dumps(table)
    for end in range(len(whole)):
        (tmp_path / name).write_text(whole[:end])
        with pytest.raises(InputError, match="empty, cut off or damaged"):
            read(tmp_path)


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        ("config.json", "robots", "r1"),
        ("config.json", "robots", [1]),
        ("config.json", "settings", []),
        ("metrics.json", "mission_s", "20"),
        ("metrics.json", "robots_lost", None),
        ("robot.json", "placed", {"r1": [0, 0]}),
        ("robot.json", "pairs", [{**PAIR, "T_a_b": "none"}]),
        ("robot.json", "pairs", [{**PAIR, "accepted_at_s": "3"}]),
        ("robot.json", "links", [{}]),
    ],
)
def test_values_of_other_types_are_refused(name: str, key: str, value: object, tmp_path: Path) -> None:
    table, read = READERS[name]
    (tmp_path / name).write_text(json.dumps({**table, key: value}))
    with pytest.raises(InputError, match=rf"{name}: .*{key}"):
        read(tmp_path)


def test_missing_files_say_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: no such folder"):
        read_config(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"not a run's folder \(config.json is missing\)"):
        read_config(tmp_path)
    with pytest.raises(InputError, match=r"the run did not finish \(no metrics.json\)"):
        read_metrics(tmp_path)
    assert read_robot(tmp_path) is None and robots_of(tmp_path) is None


def test_events_keep_what_is_whole(tmp_path: Path) -> None:
    assert read_events(tmp_path) == EventFile()
    good = [{"t": 1.0, "robot": "r1", "event": "mapped"}, {"t": 2, "robot": "r1", "event": "peer_seen", "peer": "r2"}]
    lines = [
        json.dumps(good[0]),
        "",
        "[1]",
        "null",
        '{"event": "mapped"}',
        '{"t": "1", "robot": "r1", "event": "x"}',
        '{"t": 1, "robot": "r1", "event": "peer_seen"}',
        json.dumps(good[1]),
    ]
    (tmp_path / "events.jsonl").write_bytes("\n".join(lines).encode() + b'\n{"t": 3, "ev\xff')
    found = read_events(tmp_path)
    assert found.events == good
    assert "events.jsonl: 5 lines cannot be used (line 3: " in found.damage


@pytest.mark.parametrize("raw", [b"", b"[1]", b"{", b"\xff"])
def test_usage_is_none_where_it_is_not_whole(raw: bytes, tmp_path: Path) -> None:
    assert read_usage(tmp_path) is None
    (tmp_path / "usage.json").write_bytes(raw)
    assert read_usage(tmp_path) is None
    (tmp_path / "usage.json").write_text('{"cpu_s": 1}')
    assert read_usage(tmp_path) == {"cpu_s": 1}


@pytest.mark.parametrize("robots", [["r1"], [{}], [{"id": ["r1"]}], [{"id": "r 1"}], [{"id": None}]])
def test_a_damaged_list_of_robots_makes_a_folder_that_of_no_run(robots: list[object], tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text(json.dumps({**CONFIG, "robots": robots}))
    assert robots_of(tmp_path) is None
