"""Each fault does what it says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Sensed
from mrslam.comms import LinkConditions, MemoryNetwork, Send
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.faults.links import CUT, CorruptingTransport, faulty_conditions
from mrslam.sim_driver.faults.robot import FaultyDisk, MortalRobot
from mrslam.sim_driver.faults.senses import FaultySenses
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay import read_recording
from mrslam.sim_driver.run.run_virtual import Kidnapper, VirtualTeam, run_in_virtual_time
from mrslam.sim_driver.simulation.simulation import Simulation
from mrslam.spatial import InputError, Scan
from tests.sim_driver.faults.small import events, quiet, small

S = 1_000_000_000


class Body:
    """Ten scans, one each second, from wheels that turn evenly."""

    next_ns = None
    finished = False

    def __init__(self) -> None:
        self.k = -1

    def sense(self, now_ns: int) -> Sensed | None:
        if now_ns < (self.k + 1) * S or self.k == 9:
            return None
        self.k += 1
        ranges = np.full(20, 1.0 + self.k, dtype=np.float32)
        scan = Scan(stamp_ns=self.k * S, ranges_m=ranges, angle_min_rad=0.0, angle_increment_rad=0.1, range_max_m=30.0)
        return Sensed(self.k * S, scan, np.array([float(self.k), 0.0, 0.0]))

    def act(self, agent: Any, now_ns: int) -> None:
        """Nothing to drive."""


def sensed(**fault: Any) -> list[Sensed]:
    faults = [FaultConfig(robot="r1", **fault)]
    senses = FaultySenses(Body(), faults, np.random.default_rng(0))
    return [one for t in range(10) if (one := senses.sense(t * S)) is not None]


def test_a_stuck_laser_repeats_itself() -> None:
    seen = sensed(kind="laser_stuck", at_s=3.0, for_s=3.0)
    assert [float(one.scan.ranges_m[0]) for one in seen] == [1, 2, 3, 3, 3, 3, 7, 8, 9, 10]
    assert [one.scan.stamp_ns // S for one in seen] == list(range(10))


def test_a_laser_gives_garbage_or_nothing_for_a_while() -> None:
    seen = sensed(kind="laser_garbage", at_s=3.0, for_s=3.0)
    kinds = [len(np.unique(one.scan.ranges_m)) > 5 for one in seen]
    assert kinds == [False] * 3 + [True] * 3 + [False] * 4
    assert len(sensed(kind="laser_off", at_s=3.0, for_s=3.0)) == 7


def test_odometry_leaps_once_and_a_slow_robot_leaves_scans_out() -> None:
    seen = sensed(kind="odometry_jump", at_s=5.0, amount=2.0)
    steps = np.diff([one.T_odom_base for one in seen if one.T_odom_base is not None], axis=0)
    assert (np.abs(steps[:, 1]) > 0.1).tolist().index(True) == 4
    assert [one.t_ns // S for one in sensed(kind="slow", at_s=4.0, for_s=100.0, amount=3.0)] == [0, 1, 2, 3, 5, 8]


def test_partitions_and_flapping_cut_links() -> None:
    fine = LinkConditions()
    partition = FaultConfig(kind="partition", robot="r1", at_s=1.0, for_s=2.0)
    flapping = FaultConfig(kind="flapping", robot="r2", at_s=10.0, for_s=12.0)
    link = faulty_conditions(lambda a, b, now_ns: fine, [partition, flapping])
    assert [link("r3", "r1", t * S) is CUT for t in range(4)] == [False, True, True, False]
    assert [link("r2", "r3", t * S) is CUT for t in (9, 10, 12, 13, 15, 16, 19, 22)] == [
        False, True, True, False, False, True, False, False,
    ]  # fmt: skip
    assert link("r3", "r4", 11 * S) is fine


def test_corruption_changes_some_messages() -> None:
    network = MemoryNetwork()
    disk = FaultyDisk([])
    fault = FaultConfig(kind="corrupt", robot="r1", at_s=0.0, for_s=5.0)
    end = CorruptingTransport(network.attach("r1"), [fault], np.random.default_rng(1), disk)
    other = network.attach("r2")
    payload = bytes(range(100))
    for t in (1, 9):
        disk.now_ns = t * S
        for _ in range(50):
            end.send(Send("r2", payload, "control"))
        network.advance(t * S)
        other_got = [item.payload for item in other.poll() if hasattr(item, "payload")]
        changed = sum(got != payload for got in other_got)
        assert (5 < changed < 30) if t == 1 else changed == 0


def test_a_full_disk_keeps_what_was_there() -> None:
    disk = FaultyDisk([FaultConfig(kind="disk_full", robot="r1", at_s=1.0, for_s=1.0)])
    assert disk.submit(lambda: 1).result() == 1
    disk.now_ns = 1 * S
    with pytest.raises(OSError, match="No space left"):
        disk.submit(lambda: 1).result()


def test_a_crashed_robot_goes_on_and_an_amnesiac_begins_anew(tmp_path: Path) -> None:
    for kind, resumes in (("crash", True), ("amnesia", False)):
        folder = tmp_path / kind
        run_in_virtual_time(small(tmp_path, {"kind": kind, "robot": "r1", "at_s": 8.0, "for_s": 3.0}), folder, quiet)
        back = [event for event in events(folder, "r1") if event["event"] == "restarted"]
        assert [event["checkpoint"] for event in back] == [True] * resumes
        robot = json.loads((folder / "r1" / "robot.json").read_text())
        assert (robot["scans"] > 130) == resumes


@pytest.mark.parametrize("amnesia_s", [5.0, 5.3], ids=["at once", "while it is down"])
def test_of_a_robot_that_dies_in_both_ways_nothing_is_left(tmp_path: Path, amnesia_s: float) -> None:
    both = [
        {"kind": "crash", "robot": "r1", "at_s": 5.0, "for_s": 1.0},
        {"kind": "amnesia", "robot": "r1", "at_s": amnesia_s, "for_s": 0.5},
    ]
    run_in_virtual_time(small(tmp_path, *both, duration_s=7.0), tmp_path, quiet)
    assert (tmp_path / "r1" / "checkpoint").exists() and (tmp_path / "r1" / "robot.json").exists()
    assert "restarted" not in {event["event"] for event in events(tmp_path, "r1")}


def test_a_crashed_robot_stands_still_and_is_missed(tmp_path: Path) -> None:
    crash = {"kind": "crash", "robot": "r1", "at_s": 6.0, "for_s": 10.0}
    places: dict[float, np.ndarray] = {}

    def note(team: VirtualTeam, now_ns: int) -> None:
        assert team.simulation is not None
        places[now_ns / S] = np.array(team.simulation.fleet.T_world_base()["r1"])

    run_in_virtual_time(small(tmp_path, crash), tmp_path, quiet, note)
    assert np.hypot(*(places[15.0] - places[6.5])[:2]) < 0.01 < np.hypot(*(places[5.9] - places[3.0])[:2])
    lost = [event["t"] for event in events(tmp_path, "r2") if event["event"] == "peer_gone"]
    assert len(lost) == 1 and 6.0 < lost[0] < 16.0


def come_back(team: VirtualTeam) -> MortalRobot:
    """Let the first robot die at 2 s and come back at 5 s; nothing else happens."""
    robot = team.robots[0]
    assert isinstance(robot, MortalRobot) and robot.alive
    robot.flush(2 * S)
    assert not robot.alive
    if team.simulation is not None:
        team.simulation.advance(5 * S)
    robot.flush(5 * S)
    assert robot.alive
    return robot


def test_a_robot_that_comes_back_counts_its_maps_on_and_saw_nothing_meanwhile(tmp_path: Path) -> None:
    team = VirtualTeam(small(tmp_path, {"kind": "amnesia", "robot": "r1", "at_s": 2.0, "for_s": 3.0}), tmp_path)
    before = team.robots[0].runner.agent.node.boot_id  # teammates take the higher one's maps for the newer
    assert come_back(team).runner.agent.node.boot_id > before
    assert team.simulation is not None and team.simulation.take("r1") == [] != team.simulation.take("r2")


@pytest.mark.parametrize("kind", ["crash", "amnesia"])
def test_the_recording_of_a_robot_that_came_back_holds_both_its_lives(tmp_path: Path, kind: str) -> None:
    fault = {"kind": kind, "robot": "r1", "at_s": 2.0, "for_s": 1.0}
    run_in_virtual_time(small(tmp_path, fault, duration_s=5.0), tmp_path, quiet)
    times_s = [sensed.t_ns / S for sensed in read_recording(tmp_path / "r1" / "scans.npz")]
    assert times_s[0] < 0.2 and times_s[-1] > 4.5
    assert not [t_s for t_s in times_s if 2.2 < t_s < 2.8]


def test_a_recorded_robot_that_comes_back_has_missed_what_its_log_held_meanwhile(tmp_path: Path) -> None:
    lines = [f"FLASER 2 1.0 2.0 0 0 0 0 0 0 {k}.0 host {k}.0\n" for k in range(10, 20)]
    (tmp_path / "a.clf").write_text("".join(lines))
    tables = {
        "mission": {"shell": "virtual"},
        "robots": [{"id": "r1", "log": str(tmp_path / "a.clf")}],
        "rbpf": {"particles": 3, "threads": 1},
        "faults": [{"kind": "crash", "robot": "r1", "at_s": 2.0, "for_s": 3.0}],
    }
    robot = come_back(VirtualTeam(make_mission(tables, tmp_path / "log.toml"), tmp_path))
    assert robot.runner.body.next_ns == 5 * S


@pytest.mark.parametrize("distance_m", [1.5, 6.0])
def test_a_robot_is_carried_off_when_it_is_time_about_so_far_and_its_wheels_say_nothing(
    tmp_path: Path, distance_m: float
) -> None:
    mission = small(tmp_path, {"kind": "kidnapped", "robot": "r1", "at_s": 4.0, "amount": distance_m})
    kidnapper, simulation = Kidnapper(mission), Simulation(mission)
    robot = simulation.fleet.robots["r1"]
    before, by_wheels = robot.T_world_base.copy(), robot.T_odom_base.copy()
    kidnapper.inject_fault(simulation, 4 * S - 1)
    assert np.array_equal(robot.T_world_base, before)
    for now_ns in (4 * S, 5 * S):  # once
        kidnapper.inject_fault(simulation, now_ns)
        assert np.hypot(*(robot.T_world_base - before)[:2]) == pytest.approx(distance_m, abs=1.0)
    assert np.array_equal(robot.T_odom_base, by_wheels)


def test_two_robots_with_one_id_are_told_and_the_newcomer_stops(tmp_path: Path) -> None:
    mission = small(tmp_path, {"kind": "twin", "robot": "r1", "at_s": 5.0, "for_s": 10.0})
    run_in_virtual_time(mission, tmp_path, quiet)
    told = [event for event in events(tmp_path, "r1") if event["event"] == "duplicate_id"]
    assert len(told) == 1 and not told[0]["am_newcomer"]
    twin = [event for event in events(tmp_path / "r1", "twin") if event["event"] == "duplicate_id"]
    assert len(twin) == 1 and twin[0]["am_newcomer"]


def test_faults_are_checked() -> None:
    with pytest.raises(InputError, match=r"faults.kind must be one of crash, .*, got 'flood'"):
        FaultConfig(kind="flood", robot="r1")
    with pytest.raises(InputError, match=r"faults\.for_s"):
        FaultConfig(kind="crash", robot="r1", for_s=0.0)
    for amount in ({}, {"amount": 0.2}, {"amount": 1.9}):  # one scan in one is no fault
        with pytest.raises(InputError, match=r"faults\.amount of slow must be >= 2: it takes one scan in so many, got"):
            FaultConfig(kind="slow", robot="r1", **amount)
    assert FaultConfig(kind="slow", robot="r1", amount=2.0).amount == 2.0


def test_a_fault_begins_at_its_time_and_is_over_when_its_time_is() -> None:
    fault = FaultConfig(kind="laser_off", robot="r1", at_s=2.0, for_s=3.0)
    assert [fault.active(t_ns) for t_ns in (2 * S - 1, 2 * S, 5 * S - 1, 5 * S)] == [False, True, True, False]


def test_a_fault_names_a_robot_of_the_mission(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="one of r1, r2"):
        small(tmp_path, {"kind": "crash", "robot": "r9"})
