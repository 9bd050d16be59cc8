"""A robot that dies goes on from its checkpoint: map, trajectory, revisions, what it knows of others."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Agent, AgentConfig, Inline, Keeper, KnownMap, Settings, resume
from mrslam.agent.checkpoint import KIND, VERSION, freeze, restore, write
from mrslam.agent.config import REVISIONS_LOST
from mrslam.agent.effects import Event
from mrslam.agent.shells.outputs import summary
from mrslam.alignment import Alignment, Evidence
from mrslam.comms.maps.snapshots import published
from mrslam.rbpf import MapperConfig
from mrslam.spatial import InputError, LocalMap, OccupancyGrid, TiledMap
from mrslam.spatial.files.state_file import pack, read_state, write_state
from tests.agent.duo import SETTINGS, S, live, robot, scan
from tests.full_disk import full_disk


def merged() -> tuple[Agent, Agent, Alignment]:
    """Return two robots that mapped the same room, after the first has found the other's map in its own."""
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 60)
    found = Alignment(np.array([0.01, 0.0, 0.0]), 0.8, Evidence(walls=9), np.eye(3) * 1e-4, "auto")
    for t in (0, 20 * S):
        job = one.next_job(t)
        assert job is not None
        one.on_done(job, found, t)
    return one, two, found


def test_it_goes_on_where_it_was(tmp_path: Path) -> None:
    one, two, found = merged()
    assert "r2" in one.T_team_map
    write(freeze(one, 0), tmp_path / "state")
    saved, known = one.node.store.version("r1"), one.node.store.maps["r2"]
    live([one, two], 60, 90)  # what it maps now is lost, but r2 has it
    lost = two.node.store.version("r1")
    assert lost > saved
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    assert again.node.store.version("r1") == (saved[0], saved[1] + REVISIONS_LOST)
    assert again.T_team_map["r2"] == pytest.approx(found.T_a_b)
    assert again.team.beliefs["r1", "r2"].status == "accepted"
    assert again.team.beliefs["r1", "r2"].accepted_at_ns == 20 * S
    assert np.array_equal(again.node.store.maps["r2"].map.to_grid().cells, known.map.to_grid().cells)
    live([again, two], 90, 150)  # what the lost revisions changed must not stay with r2
    held = two.node.store.version("r1")
    assert held[0] == saved[0] and held > lost  # the same frame, and newer
    assert held == again.node.store.version("r1")
    now, there = again.node.store.maps["r1"].map.to_grid(), two.node.store.maps["r1"].map.to_grid()
    assert np.array_equal(now.cells, there.cells)
    assert two.team.beliefs["r1", "r2"].reason == "not tried yet"  # nobody said it had started anew


def test_a_map_that_was_given_up_stays_given_up(tmp_path: Path) -> None:
    one, _, _ = merged()
    one._begin_map()  # and dies before it has published any of the new map
    write(freeze(one, 0), tmp_path / "state")
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    assert "r1" not in again.team.maps and not again.team.beliefs
    live([again], 60, 90)
    assert "r1" in again.team.maps and list(again.T_team_map) == ["r1"]
    assert again.team.beliefs["r1", "r2"].status == "untried"


def test_what_is_not_merged_yet_is_not_merged_afterwards_either(tmp_path: Path) -> None:
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 60)
    before = one.team.beliefs["r1", "r2"]
    assert before.alignment is None
    write(freeze(one, 0), tmp_path / "state")
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    after = again.team.beliefs["r1", "r2"]
    assert (after.status, after.reason, after.alignment) == (before.status, before.reason, None)
    assert list(again.T_team_map) == ["r1"]


def test_one_that_wakes_up_elsewhere_doubts_where_it_is(tmp_path: Path) -> None:
    one = robot("r1", 1)
    live([one], 0, 60)
    write(freeze(one, 0), tmp_path / "state")
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    elsewhere = replace(scan(90), ranges_m=(0.3 * scan(90).ranges_m + 0.4).astype(np.float32))
    there = np.array([0.0, 0.0, 1.8])
    effects = again.on_scan(elsewhere, there, 9 * S)  # left out: its odometry may be old
    assert [effect.kind for effect in effects if isinstance(effect, Event)] == ["doubtful"]
    assert again.self_doubt.doubtful and not again.self_doubt.torn
    write(freeze(again, 0), tmp_path / "state")
    third = robot("r1", 3)
    resume(third, tmp_path / "state", 0)
    for one in (again, third):
        effects = one.on_scan(replace(elsewhere, stamp_ns=elsewhere.stamp_ns + S // 10), there, 9 * S + S // 10)
        assert not any(isinstance(effect, Event) and effect.kind == "recovered" for effect in effects)
        assert one.self_doubt.doubtful and one.self_doubt.torn
    write(freeze(again, 0), tmp_path / "state")
    fourth = robot("r1", 4)
    resume(fourth, tmp_path / "state", 0)
    assert fourth.self_doubt.doubtful and fourth.self_doubt.state() == again.self_doubt.state()


def test_a_map_begun_after_the_saving_and_lost_shares_its_label_with_no_later_one(tmp_path: Path) -> None:
    labels = set()
    first = robot("r1", 5)
    live([first], 0, 20)
    write(freeze(first, 0), tmp_path / "state")
    for boot_id in (6, 1000, 2000):
        again = robot("r1", boot_id)
        restore(again, tmp_path / "state")
        again.node.begin_map()
        labels.add(again.node.store.own_epoch)
    assert len(labels) == 3 and min(labels) > first.node.store.own_epoch


def test_a_second_start_from_the_same_file_uses_no_revision_twice(tmp_path: Path) -> None:
    one = robot("r1", 1)
    live([one], 0, 30)
    write(freeze(one, 0), tmp_path / "state")
    versions = []
    for boot in (2, 3):
        again = robot("r1", boot)
        resume(again, tmp_path / "state", 0)
        live([again], 30, 60)
        versions.append(again.node.store.version("r1"))
    assert versions[1][1] - versions[0][1] >= REVISIONS_LOST


def test_without_a_disk_a_resumed_map_gets_a_new_epoch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = robot("r1", 1)
    live([one], 0, 10)
    write(freeze(one, 0), tmp_path / "state")

    monkeypatch.setattr("mrslam.agent.checkpoint.write", full_disk)
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    assert again.node.store.version("r1")[0] == one.node.store.version("r1")[0] + 1


@pytest.mark.parametrize(
    ("saved_s", "now_s", "is_new"),
    [(100, 2099, False), (100, 2101, True), (5000, 4000, False), (5000, 0, True), (None, 0, True), (0, None, True)],
)
def test_a_state_after_which_more_may_have_been_published_than_is_skipped_gets_a_new_epoch(
    saved_s: int | None, now_s: int | None, is_new: bool, tmp_path: Path
) -> None:
    """What teammates hold of revisions that are not skipped would be taken for this map's."""
    one = robot("r1", 1)
    live([one], 0, 10)
    write(freeze(one, None if saved_s is None else saved_s * S), tmp_path / "state")
    again, now_ns = robot("r1", 2), None if now_s is None else now_s * S
    resume(again, tmp_path / "state", now_ns)
    assert again.node.store.version("r1")[0] == one.node.store.version("r1")[0] + is_new
    third = robot("r1", 3)  # was saved at once, and at that time
    resume(third, tmp_path / "state", now_ns)
    assert third.node.store.version("r1")[0] - again.node.store.version("r1")[0] == (now_ns is None)


def test_a_robot_that_ended_in_good_order_keeps_its_epoch_however_long_it_was_off(tmp_path: Path) -> None:
    one = robot("r1", 1)
    live([one], 0, 10)
    Keeper(tmp_path / "state", 5.0, Inline()).close(one, 10 * S)
    labels = []
    for boot, hours in ((2, 12), (3, 24)):  # the second time from what the first start saved, after which it died
        again = robot("r1", boot)
        resume(again, tmp_path / "state", hours * 3600 * S)
        labels.append(again.node.store.version("r1")[0] - one.node.store.version("r1")[0])
    assert labels[0] == 0 < labels[1]


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    one = robot("r1", 1)
    live([one], 0, 5)
    write(freeze(one, 0), tmp_path / "state")
    with pytest.raises(InputError, match="the checkpoint of 'r1', not of 'r2'"):
        resume(robot("r2", 1), tmp_path / "state", 0)
    other = Agent("r1", Settings(rbpf=MapperConfig(particles=4)))
    with pytest.raises(InputError, match=r"rbpf.particles 3 \(now 4\)"):
        resume(other, tmp_path / "state", 0)


def test_a_robot_with_another_number_of_processors_goes_on(tmp_path: Path) -> None:
    one = robot("r1", 1)
    live([one], 0, 5)
    write(freeze(one, 0), tmp_path / "state")
    again = Agent("r1", replace(one.settings, rbpf=replace(one.settings.rbpf, threads=one.settings.rbpf.threads + 1)))
    resume(again, tmp_path / "state", 0)
    assert again.mapper.stats.scans == 5


def test_a_checkpoint_of_another_version_is_refused_in_one_line(tmp_path: Path) -> None:
    """The version is in the file's head, so that nothing of an older layout is even looked at."""
    write_state(tmp_path / "state", KIND, VERSION - 1, pack({"robot": "r1"}))
    with pytest.raises(InputError) as refused:
        resume(robot("r1", 2), tmp_path / "state", 0)
    assert f"checkpoint version {VERSION - 1}, this program reads {VERSION}" in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("state", [[], "r1", {}, {"robot": "r1", "rbpf": []}])
def test_a_checkpoint_without_settings_is_refused_in_one_line(state: object, tmp_path: Path) -> None:
    write_state(tmp_path / "state", KIND, VERSION, pack(state))
    with pytest.raises(InputError, match=r"does not fit this program \(it holds no settings\)"):
        resume(robot("r1", 2), tmp_path / "state", 0)


@pytest.mark.parametrize("missing", ["pairs", "mapper", "store", "self_doubt", "links"])
def test_a_checkpoint_that_lacks_something_is_refused_in_one_line_and_leaves_the_robot_as_it_was(
    missing: str, tmp_path: Path
) -> None:
    one = robot("r1", 1)
    live([one], 0, 20)
    write(freeze(one, 0), tmp_path / "state")
    state = read_state(tmp_path / "state", KIND, VERSION)
    del state[missing]
    write_state(tmp_path / "state", KIND, VERSION, pack(state))
    again = robot("r1", 2)
    with pytest.raises(InputError, match="does not fit this program") as refused:
        resume(again, tmp_path / "state", 0)
    assert "\n" not in str(refused.value)
    assert not again.team.maps and not again.mapper.stats.scans


def test_a_keeper_saves_in_time_and_tells_trouble_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    one = robot("r1", 1)
    live([one], 0, 5)
    keeper = Keeper(tmp_path / "state", 5.0, Inline())
    assert keeper.look(one, 0, 0) == [] and not keeper.path.exists()
    keeper.look(one, S, 0)  # soon at first, and then every five seconds
    assert keeper.path.exists()
    keeper.path.unlink()
    keeper.look(one, 6 * S - 1, 0)
    assert not keeper.path.exists()
    keeper.look(one, 6 * S, 0)
    kept = keeper.path.read_bytes()

    with monkeypatch.context() as patched:
        patched.setattr("mrslam.agent.checkpoint.write_state", full_disk)
        told = [event.kind for t in range(7, 27) for event in keeper.look(one, t * S, t * S)]
    assert told == ["checkpoint_failed"] and keeper.failures >= 2
    assert caplog.text.count("the robot's state cannot be saved ([Errno 28] No space left on device)") == 1
    assert keeper.path.read_bytes() == kept
    assert [event.kind for t in range(27, 41) for event in keeper.look(one, t * S, t * S)] == ["checkpoint_works_again"]


def test_inline_runs_at_once() -> None:
    done: Future[Any] = Inline().submit(lambda x: x + 1, 2)
    assert done.result(timeout=0) == 3


def test_a_keeper_saves_the_end(tmp_path: Path) -> None:
    one = robot("r1", 1)
    live([one], 0, 5)
    keeper = Keeper(tmp_path / "state", 5.0, Inline())
    keeper.look(one, 0, 0)
    keeper.look(one, S, 3 * S)
    crashed = robot("r1", 2)
    resume(crashed, keeper.path, 4 * S)
    live([one], 5, 30)
    keeper.close(one, 5 * S)
    again = robot("r1", 3)
    resume(again, keeper.path, 6 * S)
    assert again.mapper.stats.scans == 30
    assert crashed.node.store.own_epoch == again.node.store.own_epoch == one.node.store.own_epoch


class SlowDisk(Inline):
    """Writes when it is asked to, or waited for."""

    def __init__(self) -> None:
        self.jobs: list[tuple[Future[Any], Callable[[], Any]]] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.jobs.append((future, lambda: fn(*args, **kwargs)))
        return future

    def write(self) -> None:
        while self.jobs:
            future, job = self.jobs.pop(0)
            future.set_result(job())

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        if wait:
            self.write()


def test_a_slow_disk_has_one_save_at_a_time_and_the_end_is_what_stays(tmp_path: Path) -> None:
    one, disk = robot("r1", 1), SlowDisk()
    live([one], 0, 5)
    keeper = Keeper(tmp_path / "state", 5.0, disk)
    for t in range(0, 40, 2):
        keeper.look(one, t * S, t * S)
    assert len(disk.jobs) == 1
    live([one], 5, 30)
    keeper.close(one, 0)
    disk.write()  # what the thread still has to do
    again = robot("r1", 2)
    resume(again, keeper.path, 0)
    assert again.mapper.stats.scans == 30


def test_keyframes_that_were_not_published_before_a_restart_are_published_after_it(tmp_path: Path) -> None:
    one, k = robot("r1", 1), 0
    while k < 30 or not one.has_news:
        live([one], k, k + 1)
        k += 1
    mapped = one.mapper.stats.processed
    assert len(one.team.maps["r1"].local.keyframes.stamps_ns) < mapped
    write(freeze(one, 0), tmp_path / "state")
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    again.on_tick(k * S // 10)
    assert len(again.team.maps["r1"].local.keyframes.stamps_ns) == mapped


def test_a_robot_that_began_another_map_is_not_looked_for_where_it_started_after_a_restart(tmp_path: Path) -> None:
    settings = replace(SETTINGS, agent=AgentConfig(starts={"r1": [0.0, 0.0, 0.0], "r2": [5.0, 0.0, 0.0]}))
    one, again = (Agent("r1", settings, boot_id=boot) for boot in (1, 2))
    live([one], 0, 30)
    one._begin_map()
    live([one], 30, 60)
    write(freeze(one, 0), tmp_path / "state")
    assert again.team.schedule.starts.prior(("r1", "r2")) is not None
    resume(again, tmp_path / "state", 0)
    assert again.team.schedule.starts.prior(("r1", "r2")) is None


def test_what_is_counted_and_the_number_of_the_map_go_on(tmp_path: Path) -> None:
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 40)
    one._begin_map()
    live([one, two], 40, 60)
    one.masked_beams = 77
    write(freeze(one, 0), tmp_path / "state")
    again = robot("r1", 2)
    resume(again, tmp_path / "state", 0)
    kept = ("links", "masked_beams")
    assert one.links["r2"].bytes_sent > 0
    assert {name: summary(again, {})[name] for name in kept} == {name: summary(one, {})[name] for name in kept}
    assert again.map_number == one.map_number == 1  # the next map is another again


def test_a_base_station_keeps_the_frame_of_the_team_map(tmp_path: Path) -> None:
    def base_station(boot_id: int) -> Agent:
        return Agent("base", SETTINGS, mode="central", boot_id=boot_id)

    one = base_station(1)
    for robot_id, cells in (("r2", 100), ("r1", 300)):
        local = LocalMap(TiledMap.from_grid(OccupancyGrid(np.zeros((cells, cells), np.int8), 0.05)))
        held = published(local, None, 1)
        assert held is not None
        one.node.store.put(robot_id, held)
        one.team.take_map(robot_id, KnownMap((1, 0), local))
        assert one.team_map().anchor == "r2"  # the first that was there
    write(freeze(one, 0), tmp_path / "state")
    again = base_station(2)
    resume(again, tmp_path / "state", 0)
    assert again.team_map().anchor == summary(again, {})["frame"] == "r2"
