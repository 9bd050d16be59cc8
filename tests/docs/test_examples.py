"""Every example runs, on maps and logs made here from the built-in worlds."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.robots import LASERS, SimulatedRobot
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import read_map, se2
from mrslam.spatial.files.tum import read_tum

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    def run(name: str, *words: object) -> str:
        monkeypatch.setattr("sys.argv", [name, *map(str, words)])
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out

    return run


def carmen_log(path: Path, scans: int) -> None:
    """Write what a robot with a laser of 180 degrees sees that drives a circle in the second arena."""
    rng = np.random.default_rng(3)
    robot = SimulatedRobot(load_world("arena2"), se2.transform(7.2, 4.2, 0.0), LASERS["stage"], rng)
    lines = []
    for i in range(scans):
        robot.step((0.3, 0.45), dt_s=0.2)
        ranges = np.nan_to_num(robot.scan(i).ranges_m, nan=0.0, posinf=81.0)
        x, y, theta = robot.T_odom_base
        words = [f"{value:.3f}" for value in ranges]
        pose = f"{x:.4f} {y:.4f} {theta:.5f}"
        lines.append(f"FLASER {len(words)} {' '.join(words)} {pose} {pose} {0.2 * i:.1f} host {0.2 * i:.1f}\n")
    path.write_text("".join(lines))


def test_maps_a_log(run, tmp_path: Path) -> None:
    carmen_log(tmp_path / "arena.clf", 40)
    said = run("map_a_log.py", tmp_path / "arena.clf", tmp_path / "out")
    assert "m2 in" in said
    assert read_map(tmp_path / "out" / "map.yaml").known_area_m2() > 20.0
    assert len(read_tum(tmp_path / "out" / "trajectory.tum")[0]) == 40


def test_aligns_two_maps(run, halves: tuple[Path, Path], tmp_path: Path) -> None:
    said = run("align_two_maps.py", *halves, tmp_path)
    assert "x 3.00 m, y 2.00 m, turned by" in said.replace("x 2.99", "x 3.00").replace("x 3.01", "x 3.00")
    merged = read_map(tmp_path / "merged.yaml").known_area_m2()
    assert merged == pytest.approx(load_world("office").grid.known_area_m2(), rel=0.05)


def test_own_feed_drives_agents(run, tmp_path: Path) -> None:
    said = run("own_feed.py", 6, tmp_path)
    assert "r1: " in said
    assert "r2: " in said
    assert read_map(tmp_path / "r2" / "map.yaml").known_area_m2() > 20.0


def test_own_aligner_is_judged_like_the_others(run, halves: tuple[Path, Path]) -> None:
    from mrslam.alignment import ALIGNERS

    try:
        said = run("own_aligner.py", *halves)
    finally:
        ALIGNERS.pop("compass", None)
    x, y, theta = (float(word) for word in said.replace("T_a_b = [", "").replace("]", "").split())
    assert (x, y, theta) == (pytest.approx(3.0, abs=0.02), pytest.approx(2.0, abs=0.02), pytest.approx(0.0, abs=0.002))


def test_own_transport_carries_a_map(run) -> None:
    said = run("own_transport.py")
    world_m2 = load_world("arena1").grid.known_area_m2()
    assert "has exchanged maps with" in said
    assert f"r2 holds r1's map of {world_m2:.0f} m2" in said
