from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.missions.run_files import KEYFRAMES_FILE, TRAJECTORY_FILE, team_file
from mrslam.sim_driver.run.team_ways import fill_team_ways
from mrslam.spatial import Keyframes, KeyScans, se2
from mrslam.spatial.files.keyframes import write_keyframes
from mrslam.spatial.files.tum import read_tum, write_tum

STAMPS = np.arange(41) * 250_000_000
WAY = np.stack([0.1 * np.arange(41), 0.02 * np.arange(41), 0.01 * np.arange(41)], axis=1)
T_BASE_LASER = se2.transform(0.2, 0.1, 0.3)
BENT = WAY[::5] + np.stack([np.zeros(9), 0.05 * np.arange(9), np.zeros(9)], axis=1)


def run_folder(out: Path) -> None:
    """r1 knows where r2's keyframes are in its map; r2 knows all of its way."""
    for name in ("r1/team", "r2"):
        (out / name).mkdir(parents=True)
    write_tum(out / "r1" / team_file("r2"), STAMPS[::5], BENT)
    write_keyframes(out / "r2" / KEYFRAMES_FILE, Keyframes(STAMPS[::5], WAY[::5]), KeyScans.empty())
    write_tum(out / "r2" / TRAJECTORY_FILE, STAMPS, se2.compose(WAY, T_BASE_LASER))


def test_a_teammates_way_gets_every_scan_of_its_laser(tmp_path):
    run_folder(tmp_path)
    fill_team_ways(tmp_path, ["r1", "r2"], print)
    stamps, poses = read_tum(tmp_path / "r1" / team_file("r2"))
    assert np.array_equal(stamps, STAMPS)
    assert poses[::5] == pytest.approx(se2.compose(BENT, T_BASE_LASER), abs=1e-5)
    assert np.abs(np.diff(poses, n=2, axis=0)).max() < 0.02  # no jumps between keyframes


def test_keyframes_that_a_teammate_lacks_do_not_shift_the_others(tmp_path):
    run_folder(tmp_path)
    known = np.array([2, 3, 5, 8])  # of nine: the first came before the robots met, and some are on their way
    write_tum(tmp_path / "r1" / team_file("r2"), STAMPS[::5][known], BENT[known])
    fill_team_ways(tmp_path, ["r1", "r2"], print)
    stamps, poses = read_tum(tmp_path / "r1" / team_file("r2"))
    assert np.array_equal(stamps, STAMPS)
    assert poses[5 * known] == pytest.approx(se2.compose(BENT[known], T_BASE_LASER), abs=1e-5)


@pytest.mark.parametrize("damaged", [f"r2/{KEYFRAMES_FILE}", f"r2/{TRAJECTORY_FILE}"])
def test_what_is_damaged_is_named_and_the_keyframes_stay(tmp_path, damaged):
    run_folder(tmp_path)
    (tmp_path / damaged).write_text("no numbers")
    said: list[str] = []
    fill_team_ways(tmp_path, ["r1", "r2"], said.append)
    assert len(said) == 1 and damaged.split("/")[1] in said[0]
    assert read_tum(tmp_path / "r1" / team_file("r2"))[0].size == 9


def test_robots_that_did_not_end_are_left_out(tmp_path):
    run_folder(tmp_path)
    (tmp_path / "r2" / TRAJECTORY_FILE).unlink()
    fill_team_ways(tmp_path, ["r1", "r2", "r3"], print)
    assert read_tum(tmp_path / "r1" / team_file("r2"))[0].size == 9
