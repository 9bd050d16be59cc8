"""What the mapper makes of wheels that lie, leap, or say nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf import Mapper, MapperConfig, UpdateInfo
from mrslam.rbpf.front_end.front_end import has_stood
from mrslam.rbpf.front_end.health import LOST
from mrslam.rbpf.front_end.look_around import Looked
from mrslam.rbpf.mapper import STALE
from mrslam.spatial import Scan, se2
from tests.rbpf.rooms import SMALL, drive, errors, feed, make_scan


def test_after_a_long_pause_the_robot_is_where_the_wheels_say() -> None:
    before = drive(400)[:60]
    after = se2.compose(np.array([0.0, -6.5, 0.5]), 0.2 * drive(60))
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, before)
    for k, pose in enumerate(after):
        mapper.update(make_scan(pose, (400 + k) * 10**8, rng=np.random.default_rng(k)), pose)
    assert mapper.stats.dropped == 0  # the map contradicts nothing where the wheels say
    away, turned = errors(mapper, np.concatenate([before, after]))
    assert away < 0.08 and turned < 0.03


BEFORE = drive(60)[-1]


def turned(mapper: Mapper, k: int, told: float, truth: float) -> UpdateInfo:
    """Feed scan ``k`` after a pause in which the robot turned by ``truth`` rad; the wheels say ``told``."""
    pose, odometry = (se2.compose(BEFORE, np.array([0.0, 0.0, turn])) for turn in (truth, told))
    return mapper.update(make_scan(pose, (90 + k) * 10**8, rng=np.random.default_rng(k)), odometry)


def test_old_odometry_with_the_first_scan_after_a_pause_turns_no_map() -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(60))
    infos = [turned(mapper, k, told, 1.4 + 0.05 * k) for k, told in enumerate([0.4, 1.45, 1.5, 1.55])]
    assert [info.reason for info in infos] == [STALE, None, None, None]
    assert mapper.stats.dropped == 1
    assert infos[0].health < 0.3 and all(info.health > 0.8 for info in infos[1:])
    assert np.abs(se2.between(infos[0].T_map_base, BEFORE)).max() < 0.05  # not where the wheels have it
    assert np.abs(se2.between(infos[-1].T_map_base, se2.compose(BEFORE, np.array([0.0, 0.0, 1.55])))).max() < 0.05
    assert mapper.health > 0.8


def test_no_two_scans_in_a_row_are_left_out_after_a_pause_nor_by_a_robot_that_resumes() -> None:
    mapper, resumed = Mapper(SMALL, seed=1), Mapper(SMALL, seed=1)
    feed(mapper, drive(60))
    assert turned(mapper, 0, 0.4, 1.4).reason == STALE
    resumed.restore(mapper.state())
    assert [turned(robot, 1, 0.4, 1.4).reason for robot in (mapper, resumed)] == [None, None]
    scan = make_scan(BEFORE, 130 * 10**8)
    nowhere = replace(scan, ranges_m=0.3 * scan.ranges_m)
    assert mapper.update(nowhere, se2.compose(BEFORE, np.array([0.0, 0.0, 1.4]))).reason == STALE  # after another pause


@pytest.mark.parametrize("close_loops", [False, True])
def test_a_robot_that_its_map_contradicts_twice_is_lost_until_it_is_back_at_a_place_it_knows(close_loops: bool) -> None:
    mapper = Mapper(replace(SMALL, close_loops=close_loops), seed=1)
    feed(mapper, drive(60))
    infos = [turned(mapper, k, 0.4, 1.4) for k in range(30)]
    assert [info.reason for info in infos] == [STALE] + 29 * [None] and infos[1].processed
    assert max(info.health for info in infos[:6]) <= LOST
    assert (mapper.health > LOST) == (mapper._back.loops.edges > 0) == close_loops


def test_a_robot_that_turned_about_in_a_pause_and_sees_what_its_map_does_not_show_is_where_it_was() -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(60))
    there, scan = se2.compose(BEFORE, np.array([0.2, 0.0, 2.0])), make_scan(BEFORE, 90 * 10**8)
    info = mapper.update(replace(scan, ranges_m=2.5 * scan.ranges_m), there)
    assert info.health > LOST and np.abs(se2.between(there, info.T_map_base)).max() < 0.05


@pytest.mark.parametrize("close_loops", [False, True])
def test_a_robot_that_drove_in_a_pause_to_where_its_map_shows_nothing_is_lost_until_it_is_back(
    close_loops: bool,
) -> None:
    mapper, way = Mapper(replace(SMALL, close_loops=close_loops), seed=1), drive(200)
    feed(mapper, way[:60])
    away, scan = se2.compose(way[59], np.array([12.0, 9.0, 0.5])), make_scan(way[3], 180 * 10**8)
    info = mapper.update(replace(scan, ranges_m=0.3 * scan.ranges_m), away)  # a room that is like no other
    assert info.processed and info.health <= LOST and np.abs(se2.between(away, info.T_map_base)).max() < 0.05
    for k, pose in enumerate(way[60:]):
        info = mapper.update(make_scan(pose, (400 + k) * 10**8, rng=np.random.default_rng(k)), pose)
    assert (info.health > LOST) == (mapper._back.loops.edges > 0) == close_loops


@pytest.mark.parametrize("close_loops", [False, True])
def test_a_robot_that_its_map_shows_far_from_where_its_wheels_led_is_lost_until_it_is_back(close_loops: bool) -> None:
    """One scan may as well fit a place that looks alike."""
    mapper, way = Mapper(replace(SMALL, close_loops=close_loops), seed=1), drive(200)
    feed(mapper, way[:60])
    for k, pose in enumerate(way[40:]):  # it drove back in the pause, and on from there
        told = se2.compose(np.array([2.0, 1.0, 0.2]), pose)
        info = mapper.update(make_scan(pose, (180 + k) * 10**8, rng=np.random.default_rng(k)), told)
        if k == 0:
            assert info.processed and info.health <= LOST and np.abs(se2.between(pose, info.T_map_base)).max() < 0.05
    assert (info.health > LOST) == (mapper._back.loops.edges > 0) == close_loops


@pytest.mark.parametrize(("leap", "at"), [((2.0, 1.0, 0.2), 59), ((1.0, 0.6, 0.2), 40)], ids=["stood", "slipped"])
def test_a_robot_that_its_map_shows_where_it_stood_or_near_where_its_wheels_led_is_sure_of_it(
    leap: tuple[float, float, float], at: int
) -> None:
    mapper, way = Mapper(replace(SMALL, close_loops=False), seed=1), drive(60)
    feed(mapper, way)
    pose = way[at]
    for k in range(10):
        scan = make_scan(pose, (180 + k) * 10**8, rng=np.random.default_rng(k))
        info = mapper.update(scan, se2.compose(np.array(leap), pose))
        assert info.health > LOST and np.abs(se2.between(pose, info.T_map_base)).max() < 0.05


def test_a_contradicted_robot_that_moved_little_is_lost_at_once_and_remains_so(monkeypatch: pytest.MonkeyPatch) -> None:
    mapper, step = Mapper(replace(SMALL, close_loops=False), seed=1), np.array([0.31, 0.0, 0.0])
    feed(mapper, drive(60))
    monkeypatch.setattr("mrslam.rbpf.front_end.after_pause.look_around", lambda *_: Looked(None, True))
    there = se2.compose(BEFORE, step)
    scans = [make_scan(there, (90 + k) * 10**8, rng=np.random.default_rng(k)) for k in range(20)]
    assert not mapper._motion.is_due(SMALL, scans[0].stamp_ns) and not has_stood(step)
    infos = [mapper.update(scan, there) for scan in scans]
    assert infos[0].reason == STALE and infos[1].processed and max(info.health for info in infos) <= LOST


def test_a_robot_that_stood_while_the_wheels_leapt_is_where_it_was() -> None:
    before = drive(60)
    after = se2.compose(before[-1], np.array([[0.0, 0.0, 0.6 + 0.02 * k] for k in range(20)]))  # it was turned, too
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, before)
    for k, pose in enumerate(after):
        told = se2.compose(np.array([-2.7, 2.7, -1.35]), pose)
        mapper.update(make_scan(pose, (200 + k) * 10**8, rng=np.random.default_rng(k)), told)
    away, turned = errors(mapper, np.concatenate([before, after]))
    assert away < 0.08 and turned < 0.03
    assert mapper.health > 0.8


@pytest.mark.parametrize("leap_m", [10.0, 30.0, 150.0])
def test_a_robot_that_stood_while_the_wheels_leapt_far_is_where_it_was(leap_m: float) -> None:
    mapper = Mapper(replace(SMALL, usable_range_m=10.0), seed=1)
    feed(mapper, drive(60))
    for k in range(5):
        told = BEFORE + np.array([leap_m, 0.0, 0.0])
        info = mapper.update(make_scan(BEFORE, (700 + k) * 10**8, rng=np.random.default_rng(k)), told)
    assert np.abs(se2.between(BEFORE, info.T_map_base)).max() < 0.05


@pytest.mark.parametrize("home", [False, True], ids=["it stood", "it drove to where odometry began"])
def test_odometry_that_begins_again_at_its_origin_moves_no_robot_that_its_map_shows_elsewhere(home: bool) -> None:
    way = drive(200)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, way[:131])  # 4.8 m from where odometry began
    after = way[:40] if home else way[130:170]
    for k, pose in enumerate(after):
        told = se2.between(after[0], pose)
        info = mapper.update(make_scan(pose, (300 + k) * 10**8, rng=np.random.default_rng(k)), told)
        assert np.abs(se2.between(pose, info.T_map_base)).max() < 0.1 and info.health > 0.5


def test_a_robot_whose_odometry_began_again_where_its_map_shows_nothing_is_lost_until_it_is_found() -> None:
    away, way = np.array([30.0, 10.0, 0.0]), drive(200)  # odometry began where the map shows nothing
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, way[:100], se2.compose(away, way[:100]))
    there, health = se2.compose(way[20], np.array([0.0, 0.0, np.pi])), []
    after = np.concatenate([se2.compose(there, 0.25 * drive(60)[:30]), way[30:], way])
    for k, pose in enumerate(after):
        told = se2.between(there, pose)
        info = mapper.update(make_scan(pose, (300 + k) * 10**8, rng=np.random.default_rng(k)), told)
        health.append(info.health)
    assert max(health[:20]) <= LOST and health[-1] > 0.5 and mapper.stats.loops_closed == 1
    assert np.abs(se2.between(after[-1], info.T_map_base)).max() < 0.1


def test_odometry_carries_the_pose_on_for_as_long_as_scans_are_of_no_use() -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(60))
    for k in range(1, 101):
        told = se2.compose(BEFORE, np.array([0.1 * k, 0.0, 0.0]))
        scan = make_scan(told, (60 + k) * 10**8)
        info = mapper.update(scan.with_ranges(np.full(scan.ranges_m.size, np.inf)), told)
    assert info.reason is not None
    assert np.hypot(*se2.between(told, info.T_map_base)[:2]) < 0.5


def test_without_odometry() -> None:
    poses = drive(150)
    mapper = Mapper(MapperConfig(particles=6, threads=1, use_odometry=False), seed=1)
    feed(mapper, poses, poses * np.nan)
    assert errors(mapper, poses)[0] < 0.08


def test_a_turn_while_no_scans_came_is_found_without_odometry() -> None:
    poses = drive(150)
    rng = np.random.default_rng(9)
    mapper = Mapper(MapperConfig(particles=6, threads=1, use_odometry=False), seed=1)
    for k, pose in enumerate(poses[:100]):
        mapper.update(make_scan(pose, k * 10**8, rng=rng), None)
    turned = se2.compose(poses[99], np.array([0.0, 0.0, 1.4]))
    info = mapper.update(make_scan(turned, 10**10, rng=rng), None)
    assert np.abs(se2.between(info.T_map_base, turned)).max() < 0.1


def test_a_robot_that_nothing_tells_of_its_motion_doubts_where_it_is() -> None:
    angles = np.linspace(-1.5, 1.5, 181)
    healths = {}
    for told in (True, False):
        mapper = Mapper(MapperConfig(particles=4, threads=1, use_odometry=told), seed=1)
        rng = np.random.default_rng(2)
        for k in range(60):  # a corridor without end: every scan looks alike
            ranges = np.minimum(1.0 / np.maximum(np.abs(np.sin(angles)), 0.01), 30.0) + rng.normal(0.0, 0.01, 181)
            ranges[np.abs(np.sin(angles)) < 0.1] = np.inf
            scan = Scan(
                stamp_ns=k * 10**8, ranges_m=ranges.astype(np.float32), angle_min_rad=-1.5,
                angle_increment_rad=3.0 / 180, range_max_m=25.0,
            )  # fmt: skip
            info = mapper.update(scan, np.array([0.1 * k, 0.0, 0.0]))
        healths[told] = info.health
    assert healths[False] < 0.5 < healths[True]


def test_odometry_that_lies_is_mistrusted() -> None:
    poses = drive(150)
    motion = se2.between(poses[:-1], poses[1:])
    odometry = [np.zeros(3)]
    for k, step in enumerate(motion):
        lie = np.array([-step[0], step[1], 1.5 * step[2]])  # forward told as reverse, turns told too wide
        if k == 70:
            lie = np.array([1.5, 0.0, 0.8])
        odometry.append(se2.compose(odometry[-1], lie))
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses, np.stack(odometry))
    assert errors(mapper, poses)[0] < 0.12


@pytest.mark.parametrize("odometry", [None, [np.nan, 0.0, 0.0], [1e300, 0.0, 0.0], [1e7, -1e7, 3.0]])
def test_odometry_that_makes_no_sense_does_no_harm(odometry: list[float] | None) -> None:
    poses = drive(100)
    mapper = Mapper(SMALL, seed=1)
    rng = np.random.default_rng(2)
    for k, pose in enumerate(poses):
        told = pose if k % 30 != 29 else None if odometry is None else np.array(odometry)
        mapper.update(make_scan(pose, k, rng=rng), told)
    assert errors(mapper, poses)[0] < 0.1


def corridor_with_recesses() -> np.ndarray:
    """Walls ``x0, y0, x1, y1``, 40 m along y."""
    lines = []
    for x, out, recesses in ((0.4, -0.3, (4.0, 11.0, 15.5, 24.0, 33.0)), (2.9, 0.3, (2.0, 8.5, 18.0, 22.0, 29.0))):
        y = 0.0
        for recess in recesses:
            corners = [(x, y), (x, recess), (x + out, recess), (x + out, recess + 1.0), (x, recess + 1.0)]
            lines += [[*corners[i], *corners[i + 1]] for i in range(4)]
            y = recess + 1.0
        lines.append([x, y, x, 40.0])
    return np.array([*lines, [0.4, 0.0, 2.9, 0.0], [0.4, 40.0, 2.9, 40.0]])


def test_wheels_that_stop_to_count_do_not_stop_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.rbpf.rooms.WALLS", corridor_with_recesses())
    poses = np.array([[0.15 * k, 0.0, 0.0] for k in range(120)])
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses, poses[np.minimum(np.arange(120), 40)])
    assert errors(mapper, poses)[0] < 0.4


def test_a_robot_that_stops_is_not_carried_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.rbpf.rooms.WALLS", corridor_with_recesses())
    poses = np.array([[0.15 * min(k, 40), 0.0, 0.0] for k in range(80)])
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses, poses)
    assert errors(mapper, poses)[0] < 0.1


def body(x: float, y: float, radius: float) -> np.ndarray:
    """Walls ``x0, y0, x1, y1`` round somebody."""
    angles = np.linspace(0.0, 2.0 * np.pi, 17)
    corners = np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1)
    return np.concatenate([corners[:-1], corners[1:]], axis=1)


@pytest.mark.parametrize(("side_m", "radius_m"), [(0.4, 0.3), (0.6, 0.7)], ids=["a person", "a bed"])
def test_a_robot_that_stands_in_a_corridor_is_not_moved_by_what_passes(
    side_m: float, radius_m: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    bare = np.array([[0.3, -40.0, 0.3, 40.0], [2.7, -40.0, 2.7, 40.0]])
    mapper, rng = Mapper(MapperConfig(particles=1, threads=1)), np.random.default_rng(0)
    for k in range(60):
        passer = body(1.5 + side_m, 4.2 - 0.12 * k, radius_m)
        monkeypatch.setattr("tests.rbpf.rooms.WALLS", np.concatenate([bare, passer]) if k < 20 else bare)
        seen = make_scan(np.zeros(3), k * 10**8, beams=360, fov=2.0 * np.pi, rng=rng)
        near = np.where(seen.ranges_m > 8.0, np.float32(np.inf), seen.ranges_m)
        mapper.update(replace(seen, ranges_m=near, range_max_m=8.0), np.zeros(3))
    assert abs(mapper.T_map_base[0]) < 0.05 and mapper.stats.processed == 1
