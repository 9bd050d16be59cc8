"""A robot that tracks its pose in a saved map."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import FixedMap, Localiser, MapperConfig
from mrslam.rbpf.front_end.local_matcher import BETTER
from mrslam.rbpf.localise.localiser import START_RAD
from mrslam.spatial import OccupancyGrid, Scan, se2
from mrslam.spatial.matching.gauss_newton import Match

BEAMS = 180
START = np.array([4.0, 1.2, 0.0])


def house() -> OccupancyGrid:
    """A room of 8 x 6 m and one of another shape beside it, with a door of 1.2 m between them."""
    cells = np.zeros((120, 322), dtype=np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
    cells[:, 160:162] = 100
    cells[48:72, 160:162] = 0
    cells[80:100, 30:60], cells[20:30, 100:140], cells[70:, 200:] = 100, 100, 100
    cells[20:60, 280:290] = 100
    return OccupancyGrid(cells, 0.05)


def ranges_at(grid: OccupancyGrid, pose: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return what a laser sees, by small steps along each beam."""
    steps_m = np.arange(0.1, 12.0, 0.01)
    angles = pose[2] + np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    x = pose[0] + np.cos(angles)[:, None] * steps_m
    y = pose[1] + np.sin(angles)[:, None] * steps_m
    rows = np.clip((y / grid.resolution_m).astype(int), 0, grid.shape[0] - 1)
    cols = np.clip((x / grid.resolution_m).astype(int), 0, grid.shape[1] - 1)
    is_wall = grid.cells[rows, cols] >= 65
    first = np.where(is_wall.any(axis=1), is_wall.argmax(axis=1), len(steps_m) - 1)
    ranges_m = steps_m[first].astype(np.float32)
    return np.where(is_wall.any(axis=1), ranges_m, np.float32(np.inf))


def scan(grid: OccupancyGrid, pose: NDArray[np.float64], k: int, rng: np.random.Generator) -> Scan:
    noisy = ranges_at(grid, pose) + rng.normal(0.0, 0.01, BEAMS).astype(np.float32)
    return Scan(
        stamp_ns=k * 10**8, ranges_m=noisy, angle_min_rad=-np.pi, angle_increment_rad=2 * np.pi / BEAMS,
        range_max_m=12.0,
    )  # fmt: skip


def way(count: int) -> NDArray[np.float64]:
    """Return poses ``(count, 3)`` from ``START`` on: 8 cm forward a scan, in a circle of 1.6 m."""
    poses = [START]
    for _ in range(count - 1):
        poses.append(se2.compose(poses[-1], np.array([0.08, 0.0, 0.05])))
    return np.array(poses)


def wheels(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what odometry makes of a way: 5 % too long, in a frame of its own."""
    odom = [np.array([5.0, -3.0, 1.0])]
    for before, now in pairwise(poses):
        odom.append(se2.compose(odom[-1], se2.between(before, now) * np.array([1.05, 1.05, 1.02])))
    return np.array(odom)


def begun(grid: OccupancyGrid, config: MapperConfig | None = None) -> Localiser:
    config = config or MapperConfig(threads=1)
    return Localiser(FixedMap(house(), config.resolution_m), config)


def drive(localiser: Localiser, world: OccupancyGrid, poses: NDArray[np.float64], seed: int = 0) -> NDArray[np.float64]:
    """Let it track a way; return where it has the robot at each scan."""
    rng, odom, out = np.random.default_rng(seed), wheels(poses), []
    assert localiser.begin(scan(world, poses[0], 0, rng), odom[0], poses[0] + np.array([0.2, -0.15, 0.08]))
    for k in range(1, len(poses)):
        localiser.update(scan(world, poses[k], k, rng), odom[k])
        out.append(localiser.T_map_base)
    return np.array(out)


def errors(found: NDArray[np.float64], poses: NDArray[np.float64]) -> tuple[float, float]:
    """Return the largest error, metres and degrees."""
    off = se2.between(poses[1:], found)
    return float(np.hypot(off[:, 0], off[:, 1]).max()), float(np.degrees(np.abs(off[:, 2]).max()))


def test_it_tracks_to_a_cell_or_so_and_matches_only_where_the_robot_has_moved() -> None:
    localiser, poses = begun(house()), way(160)
    off_m, off_deg = errors(drive(localiser, house(), poses), poses)
    assert off_m < 0.075 and off_deg < 1.0
    assert localiser.fit.value > 0.9 and not localiser.is_carried
    standing = localiser.stats.processed
    rng, odom = np.random.default_rng(1), wheels(poses)[-1]
    for k in range(160, 185):
        localiser.update(scan(house(), poses[-1], k, rng), odom)
    assert localiser.stats.processed - standing <= 3  # one a second


def test_without_odometry_every_scan_is_matched() -> None:
    localiser, poses = begun(house(), MapperConfig(threads=1, use_odometry=False)), way(60)
    off_m, _ = errors(drive(localiser, house(), poses), poses)
    assert off_m < 0.075 and localiser.stats.processed == 60


def test_with_wheels_that_slip_most_of_the_way_every_scan_is_matched() -> None:
    straight = START + 0.02 * np.arange(12)[:, None] * np.array([1.0, 0.0, 0.0])
    for noise, is_each in ((0.8, True), (0.1, False)):
        localiser = begun(house(), MapperConfig(threads=1, odometry_noise=noise))
        drive(localiser, house(), straight)
        assert (localiser.stats.processed == 12) == is_each


def test_no_pose_is_known_better_than_the_walls_of_its_map() -> None:
    localiser, poses = begun(house()), way(30)
    drive(localiser, house(), poses)
    assert (np.diag(localiser.covariance)[:2] > 0.05**2 / 12.0).all()


def test_one_drive_gives_the_same_poses_twice() -> None:
    first, second = (drive(begun(house()), house(), way(40)) for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_furniture_that_moved_does_not_mislead_it() -> None:
    world = house()
    world.cells[80:100, 30:60], world.cells[20:30, 100:140] = 0, 0
    world.cells[50:60, 75:85], world.cells[10:20, 20:40] = 100, 100
    localiser, poses = begun(house()), way(160)
    off_m, off_deg = errors(drive(localiser, world, poses), poses)
    assert off_m < 0.1 and off_deg < 1.5 and not localiser.fit.is_lost


def test_it_does_not_begin_where_the_scan_does_not_fit() -> None:
    rng = np.random.default_rng(0)
    elsewhere = np.array([12.0, 3.0, 1.0])
    assert not begun(house()).begin(scan(house(), START, 0, rng), None, elsewhere)


def test_a_robot_that_is_put_elsewhere_with_its_laser_on_is_lost_within_metres() -> None:
    localiser, poses = begun(house()), way(60)
    drive(localiser, house(), poses)
    rng, odom = np.random.default_rng(2), wheels(poses)[-1]
    there = np.array([12.0, 0.8, 0.0])
    lost_at = None
    for k in range(60, 140):
        there = se2.compose(there, np.array([0.06, 0.0, 0.05]))
        odom = se2.compose(odom, np.array([0.06, 0.0, 0.05]))
        localiser.update(scan(house(), there, k, rng), odom)
        if localiser.fit.is_lost:
            lost_at = k
            break
    assert lost_at is not None and lost_at < 125


def test_a_robot_that_is_carried_off_with_its_laser_off_knows_it_at_once() -> None:
    localiser, poses = begun(house()), way(60)
    drive(localiser, house(), poses)
    rng = np.random.default_rng(3)
    for k in (200, 215):
        localiser.update(scan(house(), np.array([12.0, 1.5, 2.0]), k, rng), wheels(poses)[-1])
        assert localiser.is_carried  # and remembers it


def test_the_covariance_holds_the_error_and_grows_where_nothing_is_seen() -> None:
    localiser, poses = begun(house()), way(100)
    found = drive(localiser, house(), poses)
    error = se2.between(poses[-1], found[-1])
    sigma = np.sqrt(np.diag(localiser.covariance))
    assert (np.abs(error) < 4.0 * sigma).all() and (sigma < [0.05, 0.05, 0.02]).all()
    before = localiser.covariance
    odom = se2.compose(wheels(poses)[-1], np.array([0.19, 0.0, 0.0]))
    localiser.update(scan(house(), poses[-1], 100, np.random.default_rng(0)), odom)  # carried on by odometry
    assert np.trace(localiser.covariance) > np.trace(before)


def test_along_a_corridor_whose_ends_it_does_not_see_it_knows_less_and_less_where_it_is() -> None:
    cells = np.full((40, 720), 0, dtype=np.int8)  # 36 m long, 2 m wide; the laser reaches 12 m
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
    corridor, config = OccupancyGrid(cells, 0.05), MapperConfig(threads=1)
    localiser, rng = Localiser(FixedMap(corridor, config.resolution_m), config), np.random.default_rng(0)
    poses = np.array([14.0, 1.0, 0.0]) + np.arange(60)[:, None] * np.array([0.12, 0.0, 0.0])
    odom, sigma_m = wheels(poses), []
    assert localiser.begin(scan(corridor, poses[0], 0, rng), odom[0], poses[0])
    for k in range(1, 60):
        localiser.update(scan(corridor, poses[k], k, rng), odom[k])
        sigma_m.append(np.sqrt(np.diag(localiser.covariance)[:2]))
    (begin_x, begin_y), (end_x, end_y) = sigma_m[9], sigma_m[-1]
    assert end_x > 1.2 * begin_x and max(begin_y, end_y) < 0.04


def test_a_scan_says_as_much_as_its_independent_beams_whatever_number_it_has() -> None:
    turned = []
    for beams in (10.0, 40.0):
        localiser = begun(house(), MapperConfig(threads=1, evidence_beams=beams))
        assert localiser.begin(scan(house(), START, 0, np.random.default_rng(0)), None, START)
        turned.append(localiser.covariance[2, 2])
    assert turned[0] == pytest.approx(4.0 * turned[1], rel=0.05)


@pytest.mark.parametrize("ranges_m", [np.full(BEAMS, np.inf, dtype=np.float32)])
def test_a_scan_of_no_use_is_refused_with_a_reason_and_odometry_carries_the_pose_on(ranges_m: np.ndarray) -> None:
    localiser, poses = begun(house()), way(30)
    drive(localiser, house(), poses)
    before = localiser.T_map_base
    blind = Scan(
        stamp_ns=31 * 10**8, ranges_m=ranges_m, angle_min_rad=-np.pi, angle_increment_rad=0.03, range_max_m=12.0
    )
    info = localiser.update(blind, se2.compose(wheels(poses)[-1], np.array([0.5, 0.0, 0.0])))
    moved = se2.between(before, localiser.T_map_base)
    assert info.reason is not None and moved[0] == pytest.approx(0.5, abs=0.06)


def test_a_place_farther_off_must_fit_better_by_more_than_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    localiser, poses = begun(house()), way(30)
    drive(localiser, house(), poses)
    monkeypatch.setattr(localiser, "_covariance", np.eye(3))
    here, there = localiser.T_map_base, START + np.array([0.5, 0.0, 0.0])
    nothing = np.zeros((3, 3))
    found = Match(here, -1.0, 0.5, 0.1, nothing, 0.0, np.zeros(2))
    for gained, is_taken in ((BETTER / 2, False), (2 * BETTER, True)):
        other = Match(there, -1.0 + gained, 0.6, 0.1, nothing, 0.0, np.zeros(2))
        monkeypatch.setattr(localiser, "_search", lambda *_, other=other: other)
        assert localiser._look_farther(np.zeros((1, 5)), found) is (other if is_taken else found)
        assert np.array_equal(localiser.T_map_base, there if is_taken else here)
    sure = found._replace(inliers=1.0)
    assert localiser._look_farther(np.zeros((1, 5)), sure) is sure  # what fits is not doubted


def test_it_looks_as_far_and_turns_as_far_as_the_pose_has_become_unsure(monkeypatch: pytest.MonkeyPatch) -> None:
    localiser = begun(house())
    searched: list[tuple[float, float]] = []
    found = Match(START, -1.0, 0.5, 0.1, np.zeros((3, 3)), 0.0, np.zeros(2))

    def search(_: NDArray[np.float64], turn_rad: float, reach_m: float) -> Match:
        searched.append((turn_rad, reach_m))
        return found

    monkeypatch.setattr(localiser, "_search", search)
    for sigma_rad in (0.05, 1.0):
        monkeypatch.setattr(localiser, "_covariance", np.diag(np.square([0.3, 0.2, sigma_rad])))
        assert localiser._look_farther(np.zeros((1, 5)), found) is found
    assert searched == [pytest.approx((0.15, 0.9)), pytest.approx((START_RAD, 0.9))]


def test_scans_of_no_use_are_counted_and_the_pose_goes_on_by_the_wheels() -> None:
    localiser, poses, rng = begun(house()), way(5), np.random.default_rng(0)
    odom = wheels(poses)
    assert localiser.begin(scan(house(), poses[0], 0, rng), odom[0], poses[0])
    for k in (1, 2, 3):
        blind = replace(scan(house(), poses[k], k, rng), ranges_m=np.full(BEAMS, np.nan, dtype=np.float32))
        assert localiser.update(blind, odom[k]).reason is not None
    assert localiser.update(scan(house(), poses[4], 4, rng), odom[4]).reason is None
    assert (localiser.stats.scans, localiser.stats.dropped) == (4, 3)
    assert np.hypot(*(localiser.T_map_base - poses[4])[:2]) < 0.05
