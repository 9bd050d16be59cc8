"""The judge of relocalisation (``bench/relocalise.py``): a right place is right, a wrong one is found and counted."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench import relocalise
from bench.relocalise import DRIVEN_M, KNOWN_M, NEAR_S, at, judge, referred, related, stays, verdict
from mrslam.spatial import se2, write_tum
from mrslam.spatial.se2 import Transform

S = 1_000_000_000
STAMPS = np.arange(0, 30 * S, S // 5) + 100 * S
T_BASE_LASER = se2.transform(0.2, 0.0, 0.1)
FOUND_S = 8.0


def drive(start: Transform, turn_rad_s: float = 0.15) -> Transform:
    """Return poses ``(N, 3)`` in the world of a base that drives 0.5 m/s in an arc, at ``STAMPS``."""
    poses = [start]
    for _ in STAMPS[1:]:
        poses.append(se2.compose(poses[-1], se2.transform(0.1, 0.0, 0.2 * turn_rad_s)))
    return np.array(poses)


TRUE_SAVED, TRUE_OWN = drive(se2.transform(2.0, 2.0, 1.0)), drive(se2.transform(2.6, 3.0, 0.3))
"""Where the base was in the world on both drives."""


def write_run(folder: Path, true_base: Transform, events: Sequence[dict[str, Any]] = (), *, simulated: bool) -> Path:
    """Write what a run leaves of its drive: the laser's poses in its own map, which begins where the base did."""
    folder.mkdir(parents=True)
    write_tum(folder / "trajectory.tum", STAMPS, se2.compose(se2.between(true_base[0], true_base), T_BASE_LASER))
    if simulated:
        write_tum(folder / "truth.tum", STAMPS, true_base)
    (folder / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))
    state = {"state": "here" if events else "not yet", "reason": "little was seen"}
    (folder / "robot.json").write_text(json.dumps({"saved_maps": [state]}))
    return folder


def localised(off: Transform, t_s: float = FOUND_S) -> dict[str, Any]:
    """Return the event of a robot that takes itself to be ``off`` its true place in the saved map."""
    true = TRUE_OWN[np.searchsorted(STAMPS, STAMPS[0] + t_s * S)]
    x, y, theta = se2.compose(se2.between(TRUE_SAVED[0], true), off).tolist()
    return {"t": t_s, "event": "localised", "x_m": x, "y_m": y, "theta_rad": theta}


def judged(tmp_path: Path, events: list[dict[str, Any]], name: str = "office:1", **how: Any) -> dict[str, Any]:
    simulated = ":" in name
    saved = write_run(tmp_path / "out" / "saved" / "r1", TRUE_SAVED, simulated=simulated)
    robot = write_run(tmp_path / "out" / "own" / "r1", TRUE_OWN, events, simulated=simulated)
    return judge(name, saved, robot, tmp_path, **{"is_foreign": False, **how})


def row(**values: Any) -> dict[str, Any]:
    """Return a row of a robot that was found at once and rightly, but for ``values``."""
    return {"map": "own", "found": True, "known_m": 1.0, "seconds": 5.0, "metres": 2.0, "error_m": 0.1,
            "error_deg": 1.0, "stayed_m": 12.0, **values}  # fmt: skip


@pytest.mark.parametrize(
    ("off", "is_wrong"),
    [
        ((0.0, 0.0, 0.0), False),
        ((0.0, 0.25, 0.0), False),
        ((0.45, 0.0, 0.0), True),
        ((0.0, -0.35, 0.0), True),
        ((0.0, 0.0, 0.15), True),
    ],
)
def test_a_simulated_robot_is_held_against_the_truth(off: tuple[float, ...], is_wrong: bool, tmp_path: Path) -> None:
    found = judged(tmp_path, [localised(np.array(off))])
    assert found["found"] and found["seconds"] == FOUND_S
    assert found["metres"] == pytest.approx(0.5 * FOUND_S, abs=0.05)
    apart = TRUE_SAVED[:, :2] - TRUE_OWN[0, :2]
    assert found["known_m"] == pytest.approx(np.hypot(*apart.T).min(), abs=0.01)
    assert found["stayed_m"] == pytest.approx(4.6, abs=0.05)  # 3 m off the saved drive for the first time
    assert found["error_deg"] <= np.degrees(abs(off[2])) + 2.0  # of the poses around the event the nearest counts
    assert verdict([{"map": "own", **found}])["wrong"] == is_wrong
    assert verdict([{"map": "own", **found}])["in_time_and_right"] == (not is_wrong)


@pytest.mark.parametrize("before_s", [4.0, 1.0])
def test_a_place_that_lies_on_the_way_but_not_where_the_robot_is_then_is_wrong(tmp_path: Path, before_s: float) -> None:
    earlier = localised(np.zeros(3), FOUND_S - before_s)
    assert judged(tmp_path, [{**earlier, "t": FOUND_S}])["error_m"] > 0.3


def test_who_is_not_found_has_neither_time_nor_error(tmp_path: Path) -> None:
    found = judged(tmp_path, [])
    assert not found["found"] and found["seconds"] is None and "error_m" not in found
    assert (found["end"], found["why"], found["lost_again"]) == ("not yet", "little was seen", 0)


def test_who_is_found_in_another_building_has_no_true_place_there(tmp_path: Path) -> None:
    events = [localised(np.zeros(3)), {"t": 9.0, "event": "not_localised"}]
    found = judged(tmp_path, events, is_foreign=True)
    assert found["found"] and "error_m" not in found and "known_m" not in found and found["lost_again"] == 1
    assert verdict([{"map": "foreign", **found}])["foreign_found"] == 1


@pytest.mark.parametrize("relations", [0, 9])
@pytest.mark.parametrize("off_m", [0.0, 0.5])
def test_a_recorded_robot_is_held_against_relations_or_where_there_are_few_the_reference(
    relations: int, off_m: float, tmp_path: Path
) -> None:
    (tmp_path / "slam").mkdir()
    laser = [se2.compose(way, T_BASE_LASER) for way in (TRUE_SAVED, TRUE_OWN)]
    later = STAMPS + 60 * S  # of the saved drive
    lines = [
        f"{later[k] / 1e9:.6f} {STAMPS[k] / 1e9:.6f} {x} {y} 0 0 0 {theta}\n"
        for k in range(36, 36 + relations)
        for x, y, theta in [se2.between(laser[0][k], laser[1][k]).tolist()]
    ]
    (tmp_path / "slam" / "log.relations").write_text("".join(lines) or "0 0 0 0 0 0 0 0\n" * 2)
    write_tum(tmp_path / "slam" / "log.reference.tum", np.r_[STAMPS, later], np.concatenate(laser[::-1]))
    saved = write_run(tmp_path / "saved" / "r1", TRUE_SAVED, simulated=False)
    write_tum(saved / "trajectory.tum", later, se2.compose(se2.between(TRUE_SAVED[0], TRUE_SAVED), T_BASE_LASER))
    robot = write_run(tmp_path / "own" / "r1", TRUE_OWN, [localised(se2.transform(0.0, off_m, 0.0))], simulated=False)
    found = judge("log", saved, robot, tmp_path, False)
    assert found["by"] == ("relations" if relations else "reference")
    assert found["known_m"] < KNOWN_M
    assert found["error_m"] == pytest.approx(off_m, abs=0.02)


def test_relations_count_both_ways_and_near_the_time_alone(tmp_path: Path) -> None:
    T = se2.between(TRUE_SAVED[10], TRUE_OWN[20])
    later, back = STAMPS + 60 * S, se2.inverse(T)
    lines = [
        f"{later[10] / 1e9} {STAMPS[20] / 1e9} {T[0]} {T[1]} 0 0 0 {T[2]}\n",
        f"{STAMPS[20] / 1e9} {later[10] / 1e9} {back[0]} {back[1]} 0 0 0 {back[2]}\n",
        f"{STAMPS[20] / 1e9} {STAMPS[40] / 1e9} 0 0 0 0 0 0\n",  # within one drive
    ]
    path = tmp_path / "log.relations"
    path.write_text("".join(lines))
    ways = (later, TRUE_SAVED), (STAMPS, TRUE_OWN)
    np.testing.assert_allclose(related(path, *ways, STAMPS[20]), np.zeros((2, 3)), atol=1e-9)  # both in the world
    assert not len(related(path, *ways, STAMPS[20] + 11 * S))


def test_the_reference_compares_scans_that_are_near_and_known() -> None:
    unknown = np.full((len(STAMPS), 3), np.nan)
    saved, own = (STAMPS, TRUE_SAVED), (STAMPS, TRUE_OWN)  # whose maps lie in the world
    found = referred((saved, TRUE_SAVED), (own, TRUE_OWN), STAMPS[20])
    assert len(found) and np.abs(found).max() < 1e-9
    assert not len(referred((saved, unknown), (own, TRUE_OWN), STAMPS[20]))
    assert not len(referred((saved, TRUE_SAVED + 50.0), (own, TRUE_OWN), STAMPS[20]))


def test_poses_are_taken_at_their_time_or_not_at_all() -> None:
    asked = np.array([STAMPS[7] + S // 20, STAMPS[-1] + int(1.5 * NEAR_S * S)])
    shuffled = np.random.default_rng(1).permutation(len(STAMPS))
    poses = at((STAMPS[shuffled], TRUE_OWN[shuffled]), asked)
    np.testing.assert_array_equal(poses[0], TRUE_OWN[7])
    assert np.isnan(poses[1]).all()


def test_the_verdict_counts_what_could_be_found_and_every_wrong_place() -> None:
    rows = [
        row(stayed_m=3.0), row(metres=DRIVEN_M + 1.0, seconds=20.0), row(error_m=0.31, stayed_m=3.0),
        row(error_deg=5.1), row(found=False),
        row(known_m=KNOWN_M + 1.0), row(known_m=KNOWN_M + 1.0, error_m=8.0), row(known_m=None),
        row(map="foreign"), row(map="foreign", found=False),
    ]  # fmt: skip
    for one in rows:
        if not one["found"] or one["map"] == "foreign":
            del one["error_m"], one["error_deg"]
    said = verdict(rows)
    assert (said["own"], said["begin_where_saved"], said["found"]) == (8, 6, 5)
    assert (said["in_time_and_right"], said["wrong"]) == (2, 3)
    assert (said["stayed"], said["stayed_in_time"]) == (4, 1)  # two others drove 3 m
    assert (said["foreign"], said["foreign_found"]) == (2, 1)
    assert said["median_and_95th_percentile"]["seconds"] == [5.0, 17.0]


def test_a_robot_stays_until_it_leaves_what_was_saved_for_the_first_time_or_its_drive_ends() -> None:
    saved = np.array([[x, 0.0, 0.0] for x in np.arange(0.0, 5.1, 0.1)])
    out_and_back = np.array([[1.0, y, 0.0] for y in (0.5, 1.5, 2.5, 3.5, 2.5, 1.5)])
    unknown = np.full((1, 3), np.nan)
    driven = np.arange(7.0)
    assert stays(saved, np.concatenate([unknown, out_and_back]), driven) == {"known_m": 0.5, "stayed_m": 4.0}
    assert stays(saved, np.concatenate([out_and_back[:3], unknown]), driven[:4]) == {"known_m": 0.5, "stayed_m": 3.0}
    assert stays(saved, unknown, driven[:1])["known_m"] is None


def test_other_buildings_are_foreign_and_cuts_begin_in_what_was_not_saved() -> None:
    plays = relocalise.runs("intel", 3)
    assert [is_foreign for is_foreign, _ in plays] == [False] * 3 + [True] * 3
    assert all(0.5 <= play["first"] < 1.0 for _, play in plays)
    assert {play["seed"] for _, play in relocalise.runs("hotel:3", 2)} == {100, 101}
