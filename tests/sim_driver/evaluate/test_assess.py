"""The assessment against a second, plain computation, and on a run with a merge that is wrong on purpose."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.evaluate import References, assess
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import InputError
from tests.sim_driver.runs import played, with_wrong_merge

TABLES = {
    "mission": {"seed": 4, "duration_s": 40.0, "shell": "virtual"},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1"}, {"id": "r2", "laser": "urg-04lx"}],
    "rbpf": {"particles": 6},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return played(TABLES, tmp_path_factory.mktemp("evaluate") / "run")


def rows(path: Path) -> list[list[float]]:
    return [[float(word) for word in line.split()] for line in path.read_text().splitlines()]


def matrix(x: float, y: float, theta: float) -> np.ndarray:
    return np.array([[math.cos(theta), -math.sin(theta), x], [math.sin(theta), math.cos(theta), y], [0, 0, 1]])


def pose(row: list[float]) -> np.ndarray:
    return matrix(row[1], row[2], 2 * math.atan2(row[6], row[7]))


def read_pgm(path: Path) -> tuple[np.ndarray, float, float, float]:
    raw = path.with_suffix(".pgm").read_bytes()
    magic, size, maximum, data = raw.split(b"\n", 3)
    assert (magic, maximum) == (b"P5", b"255")
    width, height = (int(word) for word in size.split())
    text = dict(line.split(": ", 1) for line in path.read_text().splitlines())
    x, y, _ = json.loads(text["origin"])
    image = np.frombuffer(data, dtype=np.uint8).reshape(height, width)[::-1]
    return image, float(text["resolution"]), x, y


def test_pair_errors_trajectories_and_coverage_equal_a_plain_computation(folder: Path) -> None:
    assessment = assess(folder)
    truth = {robot: rows(folder / robot / "truth.tum") for robot in ("r1", "r2")}

    # pair: the 3 x 3 matrices of the true starts against what each robot believes
    true = np.linalg.inv(pose(truth["r1"][0])) @ pose(truth["r2"][0])
    (pair,) = assessment["pairs"]
    assert pair["verdict"] == "correct merge" and pair["judged_by"] == "simulated truth"
    assert set(pair["views"]) == {"r1", "r2"}
    for robot, view in pair["views"].items():
        (believed,) = json.loads((folder / robot / "robot.json").read_text())["pairs"]
        found = matrix(*believed["T_a_b"])
        assert view["error_m"] == pytest.approx(np.linalg.norm((found - true)[:2, 2]), abs=1e-4)
        turned = np.linalg.inv(true) @ found
        assert view["error_deg"] == pytest.approx(abs(math.degrees(math.atan2(turned[1, 0], turned[0, 0]))), abs=1e-3)

    # trajectory: ATE by singular value decomposition (Horn 1987, Umeyama 1991), one laser mounted off centre
    for robot, offset in (("r1", 0.0), ("r2", 0.05)):
        true_at = {round(row[0] * 1e6): pose(row) @ matrix(offset, 0, 0) for row in truth[robot]}
        pairs = [(pose(row), true_at[round(row[0] * 1e6)]) for row in rows(folder / robot / "trajectory.tum")]
        ours, theirs = (np.array([both[i][:2, 2] for both in pairs]) for i in (0, 1))
        u, _, vt = np.linalg.svd((theirs - theirs.mean(0)).T @ (ours - ours.mean(0)))
        rotation = u @ np.diag([1, np.linalg.det(u @ vt)]) @ vt
        gap = (ours - ours.mean(0)) @ rotation.T - (theirs - theirs.mean(0))
        row = assessment["robots"][robot]["trajectory"]
        assert row["poses"] == len(pairs) > 100
        assert row["ate_rmse_m"] == pytest.approx(math.sqrt((gap**2).sum(1).mean()), abs=1e-4)
        drift = [
            np.linalg.inv(np.linalg.inv(t1) @ t2) @ (np.linalg.inv(o1) @ o2)
            for (o1, t1), (o2, t2) in zip(pairs, pairs[10:], strict=False)
        ]
        assert row["rpe_rmse_m"] == pytest.approx(
            math.sqrt(np.mean([d[0, 2] ** 2 + d[1, 2] ** 2 for d in drift])), abs=2e-4
        )

    # coverage: cell by cell
    world = load_world("arena2", None)
    for robot in ("r1", "r2"):
        image, resolution, x0, y0 = read_pgm(folder / robot / "team_map.yaml")
        T_map_world = np.linalg.inv(pose(truth[robot][0]))
        known = total = 0
        for r, c in np.argwhere(world.reachable):
            px, py = (np.array([c, r]) + 0.5) * world.resolution_m + np.array(world.grid.origin_m)
            x, y, _ = T_map_world @ np.array([px, py, 1.0])
            row, col = math.floor((y - y0) / resolution), math.floor((x - x0) / resolution)
            total += 1
            known += 0 <= row < image.shape[0] and 0 <= col < image.shape[1] and image[row, col] == 254
        assert assessment["robots"][robot]["map"]["coverage_team"] == pytest.approx(known / total, abs=2e-3)


def test_traffic_and_exchanges_are_those_of_the_events(folder: Path) -> None:
    mission = assess(folder)["mission"]
    events = [json.loads(line) for robot in ("r1", "r2") for line in (folder / robot / "events.jsonl").open()]
    done = [event for event in events if event["event"] == "exchange_done"]
    assert mission["exchanges"]["done"] == len(done) > 0
    assert mission["bytes"]["exchanges"] == sum(event["bytes_sent"] for event in done)
    assert mission["bytes"]["beacon"] > 0 and mission["bytes"]["bulk"] > 0
    assert mission["first_merge_s"] == min(event["t"] for event in events if event["event"] == "merged")
    assert mission["false_merges"] == mission["missed_merges"] == 0


def test_of_the_teams_maps_the_best_and_the_worst_are_told(folder: Path) -> None:
    assessment, team = assess(folder), json.loads((folder / "metrics.json").read_text())["team"]
    covered, precise = (
        [robot["map"][key] for robot in assessment["robots"].values()]
        for key in ("coverage_team", "occupied_precision")
    )
    assert covered[0] != covered[1] and precise[0] != precise[1]
    mission = assessment["mission"]
    assert (mission["coverage_worst"], mission["coverage_best"]) == (min(covered), max(covered))
    assert (team["coverage"], team["occupied_precision"]) == (max(covered), min(precise))


def test_a_wrong_merge_is_judged_false(folder: Path, tmp_path: Path) -> None:
    assessment = assess(with_wrong_merge(folder, tmp_path / "wrong", "r2", 0, 2.0))
    (pair,) = assessment["pairs"]
    assert pair["verdict"] == "false merge"
    assert pair["views"]["r2"]["is_false"] and not pair["views"]["r1"]["is_false"]
    assert assessment["mission"]["false_merges"] == 1 and assessment["mission"]["correct_merges"] == 0


def test_what_cannot_be_judged_is_said(folder: Path, tmp_path: Path) -> None:
    blind = tmp_path / "blind"
    shutil.copytree(folder, blind)
    for robot in ("r1", "r2"):
        (blind / robot / "truth.tum").unlink()
    assessment = assess(blind)
    (pair,) = assessment["pairs"]
    assert pair["verdict"] == "merged, not judged"
    reasons = "\n".join(assessment["not_judged"])
    assert "r1, trajectory: no true or reference trajectory" in reasons
    assert "r1-r2, merge: no truth" in reasons and "r2, map: no true map" in reasons


def test_references_and_a_true_map_stand_in_for_the_simulator(folder: Path, tmp_path: Path) -> None:
    exact = assess(folder)
    blind = tmp_path / "blind"
    shutil.copytree(folder, blind)
    from mrslam.spatial.files.tum import read_tum

    trajectories = {"r1": read_tum(folder / "r1" / "truth.tum")}
    stamps, poses = read_tum(folder / "r2" / "truth.tum")
    from mrslam.spatial import se2

    trajectories["r2"] = stamps, se2.compose(poses, np.array([0.05, 0.0, 0.0]))
    for robot in ("r1", "r2"):
        (blind / robot / "truth.tum").unlink()
    assert 0.0 < exact["pairs"][0]["alignment_m"] < 0.1 and exact["pairs"][0]["alignment_deg"] < 1.0
    by_path = assess(blind, References(trajectories=trajectories))
    assert by_path["pairs"][0]["judged_by"] == "reference trajectories"
    assert by_path["pairs"][0]["alignment_m"] is None  # judged by whole ways already
    assert by_path["pairs"][0]["error_m"] == pytest.approx(exact["pairs"][0]["error_m"], abs=0.1)
    assert by_path["robots"]["r2"]["trajectory"] == exact["robots"]["r2"]["trajectory"]
    assert by_path["pairs"][0]["true_overlap"] == pytest.approx(exact["pairs"][0]["true_overlap"], abs=0.1)
    by_map = assess(blind, References(true_map=load_world("arena2", None).grid))
    assert by_map["pairs"][0]["judged_by"] == "alignment with the true map"
    assert by_map["pairs"][0]["error_m"] < 0.5


def test_a_folder_without_a_run_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a run's folder"):
        assess(tmp_path)


def test_the_command_prints_tables_or_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from mrslam.sim_driver.cli.runs.eval import eval_run

    eval_run(folder, None, [], None, as_json=True)
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(assess(folder)))
    eval_run(folder, None, [], None, as_json=False)
    printed = capsys.readouterr().out
    assert "r1-r2: correct merge after" in printed and "team coverage" in printed and "not judged: r1, CPU" in printed
    with pytest.raises(InputError, match="ROBOT=FILE"):
        eval_run(folder, None, ["=x"], None, as_json=True)
    with pytest.raises(InputError, match="reference of r9: no such robot in this run; its robots are r1, r2"):
        eval_run(folder, None, [f"r9={folder / 'r1' / 'truth.tum'}"], None, as_json=True)
    for whose in ("r1=", ""):
        with pytest.raises(InputError, match="knows its true trajectories; leave it out"):
            eval_run(folder, None, [f"{whose}{folder / 'r1' / 'truth.tum'}"], None, as_json=True)


def test_relations_are_counted(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from mrslam.sim_driver.cli.runs.eval import eval_run

    stamps = [row[0] for row in rows(folder / "r1" / "trajectory.tum")]
    relations = tmp_path / "some.relations"
    pairs = [(stamps[0], stamps[5]), (stamps[1], stamps[7]), (9e5, 9e5 + 1)]
    relations.write_text("".join(f"{t1:.3f} {t2:.3f} 0 0 0 0 0 0\n" for t1, t2 in pairs))
    row = assess(folder, References(relations=relations))["robots"]["r1"]["relations"]
    assert (row["count"], row["given"]) == (2, 3)
    poses = [pose(one) for one in rows(folder / "r1" / "trajectory.tum")]
    apart_m = [np.linalg.norm((np.linalg.inv(poses[i]) @ poses[j])[:2, 2]) for i, j in ((0, 5), (1, 7))]
    assert (row["mean_m"], row["std_m"]) == pytest.approx((np.mean(apart_m), np.std(apart_m)), abs=2e-4)
    eval_run(folder, relations, [], None, as_json=False)
    printed = capsys.readouterr().out
    assert "relations used" in printed and "relations given" in printed
    relations.write_text("900000 900001 0 0 0 0 0 0\n")
    assert "r1, relations: none of 1 lies within its trajectory" in assess(
        folder, References(relations=relations)
    )["not_judged"]  # fmt: skip
