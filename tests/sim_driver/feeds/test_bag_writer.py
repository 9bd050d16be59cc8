from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Sensed
from mrslam.sim_driver.cli.runs.bag import bag_run
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.feeds.bag_writer import BagWriter
from mrslam.sim_driver.replay.recording import write_recording
from mrslam.spatial import InputError, OccupancyGrid, Scan, read_map, write_map
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.tum import write_tum

rosbags = pytest.importorskip("rosbags.highlevel")

POSES = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.4], [0.9, 0.4, -3.1]])
STAMPS_NS = np.array([100_000_000, 1_200_000_000, 2_300_000_000])


def scan(stamp_ns: int) -> Scan:
    return Scan(
        stamp_ns=stamp_ns,
        ranges_m=np.array([1.0, np.inf, np.nan, 2.5], dtype=np.float32),
        angle_min_rad=-0.5,
        angle_increment_rad=0.25,
        range_max_m=8.0,
        range_min_m=0.1,
        beam_interval_s=0.02,
    )


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run of two robots: r1 simulated, r2 recorded and alone."""
    cells = np.arange(-1, 11, dtype=np.int8).reshape(3, 4)
    for name, offset_ns in (("r1", 0), ("r2", 1_300_000_000_000_000_000)):
        folder = tmp_path / "run" / name
        write_map(folder / "map.yaml", OccupancyGrid(np.where(cells > 4, 100, 0).astype(np.int8), 0.05, (-1.0, 0.5)))
        write_map(folder / "team_map.yaml", OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.05))
        write_tum(folder / "trajectory.tum", STAMPS_NS + offset_ns, POSES)
    for name, placed in (("r1", {"r1": [0, 0, 0], "r2": [3, 2, 0.5]}), ("r2", {"r2": [0, 0, 0]})):
        areas = {"known_area_m2": 1.0, "team_area_m2": 1.0}
        robot = {"id": name, "mode": "distributed", **areas, "placed": placed, "pairs": [], "links": []}
        write_text(tmp_path / "run" / name / "robot.json", json.dumps(robot))
    sensed = [Sensed(int(t), scan(int(t)), None) for t in STAMPS_NS]
    write_recording(tmp_path / "run" / "r1" / "scans.npz", sensed)
    return tmp_path / "run"


def messages(path: Path) -> dict[str, list]:
    found: dict[str, list] = {}
    with rosbags.AnyReader([path]) as reader:
        for connection, stamp_ns, raw in reader.messages():
            found.setdefault(connection.topic, []).append((stamp_ns, reader.deserialize(raw, connection.msgtype)))
    return found


def test_run_is_read_back(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "run.mcap"
    bag_run(run, out)
    assert [path.name for path in out.parent.iterdir()] == ["run.mcap"]
    found = messages(out)
    names = {f"/{robot}/{kind}" for robot in ("r1", "r2") for kind in ("map", "team_map", "path")}
    assert set(found) == names | {"/r1/scan", "/tf", "/tf_static"}
    ((_, message),) = found["/r1/map"]
    grid = read_map(run / "r1" / "map.yaml")
    assert message.header.frame_id == "map_r1"
    assert (message.info.height, message.info.width) == grid.shape
    assert message.info.resolution == pytest.approx(0.05)
    assert (message.info.origin.position.x, message.info.origin.position.y) == grid.origin_m
    assert np.array_equal(message.data.reshape(grid.shape), grid.cells)


def test_ways_and_frames_are_read_back(run: Path, tmp_path: Path) -> None:
    bag_run(run, tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap")
    for robot, first_ns in (("r1", 100_000_000), ("r2", 0)):
        ((_, path),) = found[f"/{robot}/path"]
        read = [(p.pose.position.x, p.pose.position.y, p.pose.orientation) for p in path.poses]
        assert np.allclose([row[:2] for row in read], POSES[:, :2], atol=1e-5)
        assert np.allclose([2 * np.arctan2(q.z, q.w) for _, _, q in read], POSES[:, 2], atol=1e-5)
        assert path.header.stamp.sec * 10**9 + path.header.stamp.nanosec == first_ns
    placed = {t.child_frame_id: t for _, m in found["/tf_static"] for t in m.transforms}
    assert set(placed) == {"map_r1", "map_r2"}
    assert placed["map_r2"].header.frame_id == "team"
    assert placed["map_r2"].transform.translation.x == 3.0
    assert [m.time_increment for _, m in found["/r1/scan"]] == pytest.approx([0.02] * 3)
    assert [m.angle_max for _, m in found["/r1/scan"]] == pytest.approx([-0.5 + 3 * 0.25] * 3)  # of the last beam
    moving = [t.child_frame_id for _, m in found["/tf"] for t in m.transforms]
    assert sorted(moving) == ["laser_r1"] * 3 + ["laser_r2"] * 3


def test_a_team_map_in_the_frame_of_a_saved_map_is_written_in_it(run: Path, tmp_path: Path) -> None:
    path = run / "r1" / "robot.json"
    chosen = {"map": "hall@monday", "T_frame_map": [1.0, 0.0, 0.0]}
    path.write_text(json.dumps({**json.loads(path.read_text()), "chosen_frame": chosen}))
    bag_run(run, tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap")
    frames = {topic: of[0][1].header.frame_id for topic, of in found.items() if topic.endswith("map")}
    assert frames == {
        "/r1/map": "map_r1", "/r1/team_map": "map_hall@monday", "/r2/map": "map_r2", "/r2/team_map": "map_r2"
    }  # fmt: skip


def test_a_team_map_whose_place_in_the_saved_map_was_not_found_is_in_the_robots_own_frame(run: Path) -> None:
    path = run / "r1" / "robot.json"
    chosen = {"map": "hall@monday", "T_frame_map": None}
    path.write_text(json.dumps({**json.loads(path.read_text()), "chosen_frame": chosen}))
    bag_run(run, None)
    ((_, message),) = messages(run / "run.mcap")["/r1/team_map"]
    assert message.header.frame_id == "map_r1"


def test_what_is_damaged_is_named_and_nothing_is_no_recording(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (run / "r1" / "team_map.yaml").write_text("no map")
    bag_run(run, None)
    assert "team_map.yaml" in capsys.readouterr().err and "/r1/team_map" not in messages(run / "run.mcap")
    (run / "run.mcap").unlink()
    for robot_id in ("r1", "r2"):
        (run / robot_id / "trajectory.tum").unlink()
        for name in ("map.yaml", "team_map.yaml"):
            (run / robot_id / name).write_text("no map")
    with pytest.raises(InputError, match="no map or trajectory there can be used"):
        bag_run(run, None)
    assert not (run / "run.mcap").exists()


def test_only_robots_of_the_run_are_written(run: Path) -> None:
    (run / "config.json").write_text(json.dumps({"format": 2, "robots": [{"id": "r1"}]}))
    bag_run(run, None)
    assert {topic.split("/")[1] for topic in messages(run / "run.mcap")} == {"r1", "tf", "tf_static"}


def test_scans_are_read_back_by_the_feed(run: Path, tmp_path: Path) -> None:
    bag_run(run, tmp_path / "run.mcap")
    feed = open_feed(tmp_path / "run.mcap")
    assert [reading.scan.stamp_ns for reading in feed.readings] == STAMPS_NS.tolist()
    for reading, pose in zip(feed.readings, POSES, strict=True):
        assert np.array_equal(reading.scan.ranges_m, scan(0).ranges_m, equal_nan=True)
        assert reading.scan.angle_increment_rad == pytest.approx(0.25)
        assert np.allclose(reading.T_odom_base, pose, atol=1e-5)


def test_mapped_log_is_a_run_of_one(run: Path) -> None:
    bag_run(run / "r2", None)
    assert "/r2/map" in messages(run / "r2" / "run.mcap")


def test_what_cannot_be_written_is_said(run: Path, tmp_path: Path) -> None:
    (tmp_path / "old.mcap").write_bytes(b"mine")
    with pytest.raises(InputError, match="is there already"):
        bag_run(run, tmp_path / "old.mcap")
    assert (tmp_path / "old.mcap").read_bytes() == b"mine"
    with pytest.raises(InputError, match=r"ends in \.mcap"):
        BagWriter(tmp_path / "run.bag")
    with pytest.raises(InputError, match="holds no map"):
        bag_run(tmp_path / "nowhere", None)


def test_what_broke_off_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="the disk"), BagWriter(tmp_path / "run.mcap") as bag:
        bag.scan("/r1/scan", "laser_r1", scan(5))
        raise RuntimeError("the disk")
    assert list(tmp_path.iterdir()) == []


def test_a_robot_that_began_later_drives_later(run: Path) -> None:
    write_text(run / "metrics.json", '{"name": "x", "mission_s": 50, "robots_lost": [], "began_s": {"r2": 40.5}}')
    bag_run(run, None)
    found = messages(run / "run.mcap")
    r1, r2 = (found[f"/{name}/path"][-1][1].poses for name in ("r1", "r2"))
    since = [pose.header.stamp.sec + pose.header.stamp.nanosec / 1e9 for pose in (r1[0], r2[0], r2[-1])]
    assert since == pytest.approx([0.1, 40.5, 42.7])


@pytest.mark.parametrize(("is_run", "begun_s"), [(True, 30.5), (False, 0.0)])
def test_a_robot_that_gave_its_map_up_drives_from_where_its_last_one_began(
    run: Path, is_run: bool, begun_s: float
) -> None:
    """Folders of agents that were not gathered have events by the world's clock, which is not the mission's."""
    if is_run:
        write_text(run / "metrics.json", '{"name": "x", "mission_s": 50, "robots_lost": []}')
    events = [{"t": 0.0, "event": "mapped"}, {"t": 29.0, "event": "given_up"}, {"t": 30.5, "event": "mapped"}]
    lines = [json.dumps({"robot": "r2", **event}) for event in events]
    write_text(run / "r2" / "events.jsonl", "\n".join(lines) + "\n")
    bag_run(run, None)
    first = messages(run / "run.mcap")["/r2/path"][-1][1].poses[0].header.stamp
    assert first.sec + first.nanosec / 1e9 == pytest.approx(begun_s)


@pytest.mark.parametrize("stamp_ns", [2**31 * 10**9, -1])
def test_a_time_that_does_not_fit_into_a_recording_is_told(tmp_path: Path, stamp_ns: int) -> None:
    with (
        pytest.raises(InputError, match=r"run\.mcap: a time of .* s does not fit"),
        BagWriter(tmp_path / "run.mcap") as bag,
    ):
        bag.scan("/r1/scan", "laser_r1", scan(2**31 * 10**9 - 1))
        bag.scan("/r1/scan", "laser_r1", scan(stamp_ns))
    assert list(tmp_path.iterdir()) == []
