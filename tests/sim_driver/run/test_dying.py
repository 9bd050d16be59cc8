"""Robots' processes that cannot come up or die: their parent is told why, and loses nothing it does not count."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrslam.agent import Sensed
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.run import robot_process
from mrslam.sim_driver.run.children import Child
from mrslam.sim_driver.run.robot_process import Failed, Go, RobotNews, RobotTask, run_robot
from mrslam.sim_driver.run.run_process import NEWS_AHEAD, _death, _simulate, _Watch
from mrslam.spatial import Scan


def mission(**tables: Any) -> Mission:
    own = {"mission": {"restart": True}, "robots": [{"id": "r1", "log": "x.clf"}], **tables}
    return make_mission(own, Path("small.toml"))


def dead(exitcode: int = 0, alive: Callable[[], bool] = lambda: False) -> Any:
    """A child whose process has ended, and the robot's ends of both its pipes."""
    (here, there), (sim_here, sim_there) = Pipe(), Pipe()
    task: Any = SimpleNamespace(robot=SimpleNamespace(id="r1"))
    process: Any = SimpleNamespace(exitcode=exitcode, is_alive=alive)
    return Child(task, process, here, sim_here, ready=True), there, sim_there


def test_a_robot_whose_trace_is_broken_says_so_in_place_of_being_ready(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_text("0,r1,r2,high\n")
    robots = [{"id": robot_id, "log": "x.clf"} for robot_id in ("r1", "r2")]
    traced = mission(robots=robots, links={"trace": str(tmp_path / "t.csv")})
    for name in ("load_kernels", "make_body", "make_agent", "go_online"):
        monkeypatch.setattr(robot_process, name, lambda *_, **__: None)
    here, there = Pipe()
    here.send(Go())
    nothing: Any = None
    run_robot(RobotTask(traced, traced.robots[0], tmp_path, "", [], False), there, nothing, nothing, nothing)
    said = here.recv()
    assert isinstance(said, Failed) and "t.csv, line 1" in said.reason


@pytest.mark.parametrize("at_the_last_moment", [False, True])
def test_a_robot_that_cannot_come_up_again_is_told_with_its_reason_and_left_dead(at_the_last_moment: bool) -> None:
    def ends() -> bool:
        if at_the_last_moment:
            there.send(Failed("t.csv: line 1"))
        return False

    child, there, _ = dead(alive=ends)
    if not at_the_last_moment:
        there.send(Failed("t.csv: line 1"))
    said: list[str] = []
    launcher: Any = SimpleNamespace(
        now=SimpleNamespace(value=5_000_000_000), revive=lambda child: pytest.fail("revived")
    )
    _Watch(mission(), launcher, [child], None, said.append)._look_after_children()
    assert said == ["5 s: the process of r1 cannot go on: t.csv: line 1"]


def test_a_robot_that_was_killed_is_started_again() -> None:
    said: list[str] = []
    launcher: Any = SimpleNamespace(now=SimpleNamespace(value=5_000_000_000), revive=lambda child: "again")
    watch = _Watch(mission(), launcher, [dead(-9)[0]], None, said.append)
    watch._look_after_children()
    assert watch._children == ["again"]
    assert said == ["5 s: the process of r1 was killed (SIGKILL); it is started again"]


@pytest.mark.parametrize(("exitcode", "how"), [(3, "ended with code 3"), (-35, "was killed (signal 35)")])
def test_every_way_to_die_has_words(exitcode: int, how: str) -> None:
    assert _death(dead(exitcode)[0]) == f"the process of r1 {how}"


SCAN = Scan(stamp_ns=0, ranges_m=np.ones(3), angle_min_rad=0.0, angle_increment_rad=0.1, range_max_m=5.0)


class World:
    """A simulation in which a robot senses three scans a step."""

    def __init__(self) -> None:
        self.waiting, self.commands = 0, list[object]()

    def advance(self, now_ns: int) -> None:
        self.waiting += 3

    def take(self, robot_id: str) -> list[Sensed]:
        taken, self.waiting = [Sensed(0, SCAN, None)] * self.waiting, 0
        return taken

    def qualities(self, robot_id: str) -> dict[str, float]:
        return {}

    def command(self, robot_id: str, command: tuple[float, float]) -> None:
        self.commands.append(command)


def test_scans_of_a_robot_that_is_dead_are_taken_and_counted_as_lost() -> None:
    child, _, there = dead()
    there.close()
    world: Any = World()
    for now_ns in (1, 2):
        _simulate(world, [child], now_ns)
    assert (child.scans_lost, world.waiting) == (6, 0)
    assert set(world.commands) == {(0.0, 0.0)}


def test_scans_of_a_robot_that_dies_while_they_are_sent_are_counted_as_lost() -> None:
    def broken(news: object) -> None:
        raise BrokenPipeError

    child, world = dead()[0], cast("Any", World())
    child.simulator = SimpleNamespace(poll=lambda timeout: False, send=broken)
    _simulate(world, [child], 1)
    assert (child.scans_lost, child.sent) == (3, 0)


def test_a_robot_that_is_slow_gets_the_newest_scan_and_what_it_missed_is_counted() -> None:
    child, _, there = dead()
    world = cast("Any", World())
    for now_ns in range(NEWS_AHEAD + 2):
        _simulate(world, [child], now_ns)
    assert child.sent == NEWS_AHEAD  # it takes none, and gets no more than that
    assert child.scans_lost == 2 * NEWS_AHEAD + 3 * 2
    assert [len(there.recv().sensed) for _ in range(NEWS_AHEAD)] == [1] * NEWS_AHEAD and not there.poll(0)
    there.send(RobotNews((0.3, -0.1), NEWS_AHEAD))
    _simulate(world, [child], NEWS_AHEAD + 2)
    assert (child.taken, child.sent) == (NEWS_AHEAD, NEWS_AHEAD + 1) and world.commands == [(0.3, -0.1)]
