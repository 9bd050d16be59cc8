"""Two real nodes, two recorded robots: maps, team map, tf and teammates against the log's reference trajectory."""

from __future__ import annotations

import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: .ci/ros-env FOLDER makes an environment with it")

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from mrslam.agent.shells.saved_files import read_saved_maps
from mrslam.sim_driver.feeds.tf_tree import rotation_matrix
from mrslam.sim_driver.ros.frames import LiveFrames
from mrslam.spatial import read_map, se2
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform
from tests.sim_driver.ros.processes import LATCHED, SENSOR, Listener, address, domain, wait_for

SPEED = 5.0
CUTS = {"r1": (0.0, 0.10), "r2": (0.05, 0.15)}
"""Shares of the log that the robots play: they share the building, not the place they begin at."""
TEAM = ["-p", "comms.exchange_timeout_s:=2.0", "-p", "comms.link_threshold:=0.5", "-p", "agent.align_interval_s:=3.0"]
T_BASE_LASER = np.array([0.1, 0.0, 0.0])


class Reference:
    """Where the log's robot really was, from its own first scan of a stretch; by the stamps of the messages."""

    def __init__(self, data: Path) -> None:
        self._stamps_ns, T_world_laser = read_tum(data / "slam/intel.reference.tum")
        self._T_world_base = se2.compose(T_world_laser, se2.inverse(T_BASE_LASER))

    def at(self, log_ns: int) -> Transform:
        return self._T_world_base[int(np.abs(self._stamps_ns - log_ns).argmin())]

    def by_message(self, stamps: Path) -> dict[int, Transform]:
        rows = [line.split() for line in stamps.read_text().splitlines()]
        return {int(message_ns): self.at(int(log_ns)) for log_ns, message_ns in rows}


def stamp_ns(message: Any) -> int:
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def pose_of(pose: Any) -> Transform:
    turn = rotation_matrix(pose.orientation)
    return np.array([pose.position.x, pose.position.y, np.arctan2(turn[1, 0], turn[0, 0])])


def away_m(T_a: Transform, T_b: Transform) -> float:
    return float(np.hypot(*(T_a[:2] - T_b[:2])))


class TfListener:
    """Looks every scan up in the map at its stamp, as tf2's message filter does: when odometry has come so far."""

    def __init__(self, listener: Listener, robot: str) -> None:
        self.frames = LiveFrames("base_link")
        self.scans, self.ahead, self.waiting = 0, 0, 0
        self._waiting_ns: list[int] = []
        listener.listen(TFMessage, f"/{robot}/tf_static", LATCHED, lambda message: self._take(message, True))
        listener.listen(TFMessage, f"/{robot}/tf", also=lambda message: self._take(message, False))
        listener.listen(LaserScan, f"/{robot}/scan", SENSOR, self._look_up)

    def _take(self, message: Any, is_static: bool) -> None:
        for transform in message.transforms:
            self.frames.add(transform, is_static)
        self._waiting_ns = [one for one in self._waiting_ns if not self._is_known(one)]
        self.waiting = len(self._waiting_ns)

    def _look_up(self, scan: Any) -> None:
        T_map_odom = self.frames.pose("map", "odom", stamp_ns(scan))
        if T_map_odom is not None:  # from the first transform on
            self.scans += 1
            self.ahead += T_map_odom[1] <= 0
            self._waiting_ns.append(stamp_ns(scan))

    def _is_known(self, stamp_ns: int) -> bool:
        """Return whether the place of the laser at a stamp needs no extrapolation."""
        found = self.frames.pose("map", "laser", stamp_ns)
        return found is not None and found[1] <= 0


@pytest.mark.slow
def test_two_recorded_robots_map_meet_and_go_on_after_a_crash(tmp_path: Path, data_dir: Path) -> None:
    with domain(tmp_path, 101) as (processes, listener):
        lookups = {name: TfListener(listener, name) for name in CUTS}
        for name, mate in (("r1", "r2"), ("r2", "r1")):
            listener.listen(PoseWithCovarianceStamped, f"/{name}/pose")
            listener.listen(PoseStamped, f"/{name}/teammates/{mate}/pose")
            listener.listen(OccupancyGrid, f"/{name}/map", LATCHED)
            listener.listen(OccupancyGrid, f"/{name}/team_map", LATCHED)
            listener.listen(MapMetaData, f"/{name}/map_metadata", LATCHED)
            listener.listen(MarkerArray, f"/{name}/team_graph")
        where = address()
        nodes = {
            "r1": processes.robot("r1", "--team", "ros-test", "--listen", where, ros=TEAM),
            "r2": processes.robot("r2", "--team", "ros-test", "--connect", where, ros=TEAM),
        }
        log = data_dir / "slam/intel.clf.gz"
        players = [processes.player(name, log, *CUTS[name], SPEED) for name in CUTS]
        wait_for(lambda: all(player.poll() is not None for player in players), "the logs to end", 240.0)
        merged = "merged the maps of r1 and r2"
        wait_for(lambda: all(merged in processes.said(name) for name in CUTS), "both to merge")
        time.sleep(3.0)  # a last map, whose period is two seconds

        reference = Reference(data_dir)
        truth = {name: reference.by_message(tmp_path / f"{name}-{first}.stamps") for name, (first, _) in CUTS.items()}
        T_world_map = {name: placed(listener, name, poses) for name, poses in truth.items()}
        check_own_maps(listener, lookups, truth, T_world_map)
        check_teams(listener, truth, T_world_map)
        check_services(listener, tmp_path)

        nodes["r1"].send_signal(signal.SIGKILL)
        nodes["r1"].wait()
        again = processes.robot("r1", "--team", "ros-test", "--listen", where, ros=TEAM)
        assert "resumes from its checkpoint" in processes.said("r1")
        heard = len(listener.heard["/r1/tf"])  # nothing drives yet: its latched team map has a place all the same
        wait_for(lambda: "team_map" in frames_of(listener.heard["/r1/tf"][heard:]), "map -> team_map", 20.0)
        before = len(listener.heard["/r1/pose"])
        player = processes.player("r1", log, 0.10, 0.11, SPEED)
        wait_for(lambda: player.poll() is not None, "the rest of the log to end")
        wait_for(lambda: len(listener.heard["/r1/pose"]) > before + 100, "poses after the restart")
        later = reference.by_message(tmp_path / "r1-0.1.stamps")
        for message in listener.heard["/r1/pose"][before:]:
            T_map_base = se2.between(T_world_map["r1"], later[stamp_ns(message)])
            assert away_m(pose_of(message.pose.pose), T_map_base) < 1.0, "the map's frame is another"
        processes.stop(again, "r1")
        processes.stop(nodes["r2"], "r2")
        assert not [line for name in CUTS for line in processes.warnings(name) if "no scan" not in line]


def placed(listener: Listener, name: str, poses: dict[int, Transform]) -> Transform:
    """Return where a robot's map lies by all its poses: the first one's heading would shift what is far away."""
    heard = [one for one in listener.heard[f"/{name}/pose"] if stamp_ns(one) in poses]
    ours, theirs = np.array([[pose_of(one.pose.pose), poses[stamp_ns(one)]] for one in heard]).transpose(1, 0, 2)
    return se2.fit_rigid(theirs[:, :2], ours[:, :2])


def check_own_maps(
    listener: Listener,
    lookups: dict[str, TfListener],
    truth: dict[str, dict[int, Transform]],
    T_world_map: dict[str, Transform],
) -> None:
    """Each robot located every scan, near where it was; tf said the same, at every scan's stamp."""
    for name, poses in truth.items():
        heard = listener.heard[f"/{name}/pose"]
        assert len(heard) > 0.9 * len(poses), (name, len(heard), len(poses))  # scans are sent as best-effort
        error_m = [
            away_m(pose_of(one.pose.pose), se2.between(T_world_map[name], poses[stamp_ns(one)])) for one in heard
        ]
        assert max(error_m) < 0.6 and np.median(error_m) < 0.15, (name, max(error_m), np.median(error_m))
        lookup = lookups[name]
        counts = (name, lookup.scans, lookup.ahead, lookup.waiting)
        assert lookup.scans > 0.9 * len(poses) and lookup.ahead > 0.5 * lookup.scans and lookup.waiting == 0, counts
        newest = stamp_ns(heard[-1])
        T_map_base = lookup.frames.pose("map", "base_link", newest)
        assert T_map_base is not None and away_m(T_map_base[0], pose_of(heard[-1].pose.pose)) < 0.1
        grid, metadata = listener.newest(f"/{name}/map"), listener.newest(f"/{name}/map_metadata")
        assert grid.header.frame_id == "map" and metadata == grid.info
        assert grid.info.resolution == pytest.approx(0.05) and share_free(grid, truth[name], T_world_map[name]) > 0.0
        assert share_free(grid, truth[name], T_world_map[name]) > 0.95


def check_teams(listener: Listener, truth: dict[str, dict[int, Transform]], T_world_map: dict[str, Transform]) -> None:
    """Team maps show where both robots were; teammates are where they really are."""
    for name, mate in (("r1", "r2"), ("r2", "r1")):
        grid = listener.newest(f"/{name}/team_map")
        assert grid.header.frame_id == "team_map"
        for robot in (name, mate):
            assert share_free(grid, truth[robot], T_world_map[name]) > 0.9, (name, robot)
        said = listener.newest(f"/{name}/teammates/{mate}/pose")
        assert said.header.frame_id == "team_map"
        really = se2.between(T_world_map[name], list(truth[mate].values())[-1])
        assert away_m(pose_of(said.pose), really) < 0.6, (name, pose_of(said.pose), really)
        frames = frames_of(listener.heard[f"/{name}/tf"])
        assert {"odom", "team_map", f"teammates/{mate}/map", f"teammates/{mate}/base_link"} <= frames
        markers = listener.newest(f"/{name}/team_graph").markers
        assert {"map of r1", "map of r2"} <= {one.text for one in markers}
        assert any(one.text.startswith("r1-r2: 0.") for one in markers)


def frames_of(heard: list[Any]) -> set[str]:
    """Return the child frames in messages of tf."""
    return {one.child_frame_id for message in heard for one in message.transforms}


def share_free(grid: Any, poses: dict[int, Transform], T_world_map: Transform) -> float:
    """Return the share of a robot's places that are free in the map, within a cell or two."""
    cells = np.array(grid.data, dtype=np.int8).reshape(grid.info.height, grid.info.width)
    places = se2.between(T_world_map, np.array(list(poses.values())))[:, :2]
    cols, rows = ((places - [grid.info.origin.position.x, grid.info.origin.position.y]) / grid.info.resolution).T
    inside = (rows >= 0) & (cols >= 0) & (rows < grid.info.height) & (cols < grid.info.width)
    values = cells[rows[inside].astype(int), cols[inside].astype(int)]
    return float(((values >= 0) & (values <= 35)).sum()) / len(places)


def check_services(listener: Listener, folder: Path) -> None:
    """The map is given when asked for, to whoever comes late, and saved."""
    late: list[Any] = []
    listener.listen(OccupancyGrid, "/r2/map", LATCHED, late.append)
    wait_for(lambda: late, "the latched map", 5.0)
    given = listener.call(GetMap, "/r2/dynamic_map", GetMap.Request()).map
    assert given.info.width == listener.newest("/r2/map").info.width and max(given.data) > 65
    saved = listener.call(Trigger, "/r2/save", Trigger.Request())
    assert saved.success, saved.message
    grid, local = read_map(folder / "r2" / "map.yaml"), next(iter(read_saved_maps(folder / "r2").values())).local
    assert len(local.keyframes.stamps_ns) == len(local.key_scans.starts) - 1 > 10  # it can be bent and continued
    assert grid.known_area_m2() == pytest.approx(sum(cell >= 0 for cell in given.data) * 0.0025, rel=0.1)
    session = listener.call(Trigger, "/r1/save_session", Trigger.Request())
    assert session.success and Path(session.message).exists()
