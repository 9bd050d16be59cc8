"""A run played again: the same bytes under the same settings, and a warning where the drive no longer fits."""

from __future__ import annotations

import json
import shutil
import weakref
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Sensed, Settings
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay import Recorder, read_recording
from mrslam.sim_driver.replay.again import mission_of, replay_mission
from mrslam.sim_driver.replay.recording import write_recording
from mrslam.sim_driver.run.run import run_mission
from mrslam.spatial import InputError, Scan

TABLES = {
    "mission": {"seed": 2, "duration_s": 40.0, "shell": "virtual"},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
    "rbpf": {"particles": 6},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


def run(mission, out):
    return run_mission(mission, out, lambda mission_s, total_s, text: None, lambda text: None)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("recorded") / "run"
    run(make_mission(TABLES, Path("small.toml")), out)
    return out


def test_the_same_settings_give_the_same_bytes_without_driving(recorded: Path, tmp_path: Path) -> None:
    metrics = run(replay_mission(recorded), tmp_path / "again")
    for path in sorted(recorded.rglob("*")):
        if path.is_file() and path.name not in ("scans.npz", "config.json", "metrics.json", "report.html"):
            assert (tmp_path / "again" / path.relative_to(recorded)).read_bytes() == path.read_bytes(), path
    before = json.loads((recorded / "metrics.json").read_text())
    assert metrics.pop("replay")["drive_holds_until_s"] is None
    assert metrics == before


def test_other_settings_are_decided_anew_and_it_is_said_how_long_the_drive_fits(recorded: Path, tmp_path: Path) -> None:
    before = json.loads((recorded / "metrics.json").read_text())
    (merged_s,) = {pair["accepted_at_s"] for pair in before["pairs"]}
    assert merged_s is not None
    metrics = run(replay_mission(recorded, ["comms.exchange_timeout_s=15"]), tmp_path / "again")
    assert metrics["links"][0]["exchanges"] < before["links"][0]["exchanges"]
    holds_s = metrics["replay"]["drive_holds_until_s"]
    assert holds_s is not None and merged_s <= holds_s < 40.0
    twice = replay_mission(tmp_path / "again", ["comms.exchange_timeout_s=5"])
    assert twice.replay == recorded  # a replay of a replay reads the scans where they are
    assert mission_of(tmp_path / "again").settings.comms.exchange_timeout_s == 15.0


def test_what_needs_a_new_drive_is_refused(recorded: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"radio\.power_dbm needs a new run"):
        replay_mission(recorded, ["radio.power_dbm=10"])
    with pytest.raises(InputError, match="not a run's folder"):
        replay_mission(tmp_path)


def test_a_run_with_faults_is_not_played_again(recorded: Path, tmp_path: Path) -> None:
    shutil.copytree(recorded, tmp_path / "faulty")
    path = tmp_path / "faulty" / "config.json"
    faults = [{"kind": "crash", "robot": "r1", "at_s": 5.0, "for_s": 3.0}]
    path.write_text(json.dumps({**json.loads(path.read_text()), "faults": faults}))
    with pytest.raises(InputError, match=r"had \[\[faults\]\]; .* cannot be played again"):
        replay_mission(tmp_path / "faulty")


def test_scans_come_back_as_they_were(recorded: Path) -> None:
    sensed = read_recording(recorded / "r1" / "scans.npz")
    assert [one.t_ns for one in sensed[:3]] == [0, 100_000_000, 200_000_000]
    assert len(sensed) == 400
    assert np.isfinite(sensed[0].scan.ranges_m).any() and sensed[0].T_odom_base is not None


def test_a_recording_keeps_stamps_odometry_laser_and_where_that_is_mounted(tmp_path: Path) -> None:
    scan = Scan(
        stamp_ns=7, ranges_m=np.array([1.0, np.inf, np.nan], dtype=np.float32), angle_min_rad=-1.0,
        angle_increment_rad=0.01, range_max_m=5.6, range_min_m=0.02, T_base_laser=np.array([0.05, -0.1, 0.2]),
        beam_interval_s=1e-4,
    )  # fmt: skip
    sensed = [Sensed(5, scan, None), Sensed(9, replace(scan, stamp_ns=11), np.array([1.0, 2.0, 3.0]))]
    write_recording(tmp_path / "scans.npz", sensed)
    back = read_recording(tmp_path / "scans.npz")
    assert [(one.t_ns, one.T_odom_base is None) for one in back] == [(5, True), (9, False)]
    np.testing.assert_array_equal(back[1].T_odom_base, [1.0, 2.0, 3.0])
    for then, now in zip(sensed, back, strict=True):
        for name in (field.name for field in fields(Scan)):
            np.testing.assert_array_equal(getattr(now.scan, name), getattr(then.scan, name), err_msg=name)


def test_a_recorder_holds_no_scans_and_writes_all_of_them(tmp_path: Path) -> None:
    agent, recorder, held = Agent("r1", Settings()), Recorder(tmp_path), []
    for k in range(3000):
        scan = Scan(
            stamp_ns=k, ranges_m=np.full(3, k + 1, dtype=np.float32), angle_min_rad=0.0, angle_increment_rad=0.1,
            range_max_m=5e3,
        )  # fmt: skip
        recorder.on_scan(agent, Sensed(2 * k, scan, None if k % 2 else np.array([k, 0.0, 0.0])), 2 * k)
        held.append(weakref.ref(scan))
    del scan
    assert sum(ref() is not None for ref in held) <= 1
    recorder.close(agent, 0)
    back = read_recording(tmp_path / "scans.npz")
    assert [(one.t_ns, one.scan.stamp_ns) for one in back] == [(2 * k, k) for k in range(3000)]
    assert all(
        (one.scan.ranges_m == k + 1).all() and (one.T_odom_base is None) == bool(k % 2) for k, one in enumerate(back)
    )
    Recorder(tmp_path / "nothing").close(agent, 0)
    assert not (tmp_path / "nothing").exists()


def test_a_damaged_recording_is_named(recorded: Path, tmp_path: Path) -> None:
    raw = (recorded / "r1" / "scans.npz").read_bytes()
    (tmp_path / "scans.npz").write_bytes(raw[:1000])
    with pytest.raises(InputError, match="not a readable"):
        read_recording(tmp_path / "scans.npz")
    with pytest.raises(InputError, match=r"mission\.record"):
        read_recording(tmp_path / "none.npz")


def test_a_run_of_another_format_says_so_where_its_settings_cannot_be_read(recorded: Path, tmp_path: Path) -> None:
    config = json.loads((recorded / "config.json").read_text())
    config["settings"]["rbpf"]["ancient"] = 1
    for written, said in (
        (config.pop("format"), "rbpf: unknown key 'ancient'"),
        (None, "a run of format 1, this program reads"),
    ):
        old = tmp_path / str(written)
        old.mkdir()
        (old / "config.json").write_text(json.dumps(config if written is None else config | {"format": written}))
        with pytest.raises(InputError, match=f"^{old}/config.json: {said}"):
            mission_of(old)


def test_what_set_gets_wrong_of_a_replay_is_said_of_it(recorded: Path) -> None:
    with pytest.raises(InputError, match=r"^--set: rbpf: unknown key 'particels'; did you mean 'particles'"):
        mission_of(recorded, ["rbpf.particels=9"])


@pytest.mark.parametrize(
    ("array", "values", "told"),
    [
        ("t_ns", [0.5, 1.5], "times are no whole numbers"),
        ("stamps_ns", [0.0, np.nan], "times are no whole numbers"),
        ("T_odom_base", np.zeros((2, 2)), "odometry is no poses"),
        ("T_odom_base", np.zeros((3, 3)), "odometry is no poses"),
        ("t_ns", [9, 5], "times run backward"),
        ("t_ns", [-1, 5], "times run backward, or beyond any mission"),
        ("t_ns", [5, 2**62], "beyond any mission"),
    ],
)
def test_a_recording_whose_times_or_odometry_cannot_be_is_refused_in_one_line(
    tmp_path: Path, array: str, values: object, told: str
) -> None:
    scan = Scan(
        stamp_ns=7, ranges_m=np.ones(3, dtype=np.float32), angle_min_rad=0.0, angle_increment_rad=0.1, range_max_m=5.0
    )
    path = tmp_path / "scans.npz"
    write_recording(path, [Sensed(t_ns, scan, None) for t_ns in (5, 9)])
    with np.load(path) as arrays:
        whole = dict(arrays)
    assert len(read_recording(path)) == 2
    np.savez(path, **{**whole, array: np.asarray(values)})
    with pytest.raises(InputError, match=rf"^[^\n]*scans\.npz: not a recording of scans \([^\n]*{told}[^\n]*$"):
        read_recording(path)
