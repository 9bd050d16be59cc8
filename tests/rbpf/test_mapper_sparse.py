"""Lasers of few beams: their scans are gathered along odometry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrslam.rbpf import Mapper
from mrslam.rbpf.checkpoint import load_checkpoint, save_checkpoint
from mrslam.rbpf.front_end.gathering import ENOUGH, SINCE_KEY_MOST, SPARSE, WAY_MOST_M, Gathering
from mrslam.rbpf.front_end.scan_gate import POINTS_LEAST
from mrslam.spatial import se2
from mrslam.spatial.matching.cloud import NEIGHBOURS_LEAST, find_normals, joined, transformed
from tests.rbpf.rooms import SMALL, drive, errors, make_scan, seen_room

STEPS = 400


def wheels(poses: np.ndarray) -> np.ndarray:
    """Odometry that turns too far by 3 % and drives 4 % too long."""
    out = [poses[0]]
    for motion in se2.between(poses[:-1], poses[1:]):
        out.append(se2.compose(out[-1], motion * (1.04, 1.04, 1.03)))
    return np.stack(out)


def mapped(beams: int, steps: int = STEPS, first: int = 0, mapper: Mapper | None = None) -> tuple[Mapper, np.ndarray]:
    """A mapper after a drive with this number of beams over 270 degrees, and the drive ``(steps, 3)``."""
    poses = drive(STEPS)[:steps]
    mapper = Mapper(SMALL, seed=1) if mapper is None else mapper
    for k, odometry in enumerate(wheels(poses)):
        if k >= first:
            scan = make_scan(poses[k], k * 10**8, beams, fov=1.5 * np.pi, rng=np.random.default_rng(k))
            mapper.update(scan, odometry)
    return mapper, poses


@pytest.mark.parametrize("beams", [POINTS_LEAST - 2, 11, 30])
def test_few_beams_make_a_map(beams: int) -> None:
    mapper, poses = mapped(beams)
    assert mapper.stats.dropped == (beams < POINTS_LEAST)
    used = poses[mapper.stats.dropped :]
    away, turned = errors(mapper, se2.between(used[0], used))  # by the wheels alone: 0.4 m
    assert away < 0.12 and turned < 0.04
    assert mapper.health > 0.5
    if beams == 30:  # keyframes have the returns of all scans since the one before
        assert np.median([len(points) for points in mapper._back.loops.scans.points.values()]) > 1.5 * ENOUGH


def test_a_laser_of_many_beams_is_matched_scan_by_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrslam.rbpf.front_end.gathering.Gathering.take", None)  # not called
    mapper, poses = mapped(2 * SPARSE, 60)
    assert errors(mapper, poses)[0] < 0.1


def test_a_sparse_mapper_saved_in_between_goes_on_the_same(tmp_path: Path) -> None:
    whole, _ = mapped(11, 120)
    half, _ = mapped(11, 57)
    save_checkpoint(half, tmp_path / "half")
    resumed = load_checkpoint(tmp_path / "half")
    mapped(11, 120, 57, resumed)
    assert np.array_equal(whole.trajectory().T_map_base, resumed.trajectory().T_map_base)


def test_a_robot_at_rest_gathers_no_points_without_end() -> None:
    gathering = Gathering()
    for _ in range(3 * SINCE_KEY_MOST):
        gathering.remember(np.zeros(3), np.ones((2, 5)))
    assert gathering.of_key(np.zeros(3), np.zeros(2)).shape == (2 * SINCE_KEY_MOST, 5)


def test_scans_are_put_together_by_the_way_that_odometry_should_have_told() -> None:
    gathering, wall = Gathering(), np.zeros((1, 5))
    wall[0, :2] = 2.0, 0.5
    for told_m in (0.0, 0.1, 0.2):
        gathering.add(np.array([told_m, 0.0, 0.0]), wall)
    points = gathering.take(np.zeros(2), lambda motion: 1.5 * motion)
    assert np.sort(points[:, 0]) == pytest.approx([1.7, 1.85, 2.0]) and points[:, 1] == pytest.approx(0.5)


def test_no_beam_is_dropped_where_all_return() -> None:
    mapper = Mapper(SMALL)
    dropped = []
    for k, pose in enumerate(drive(40)):
        dropped.append(mapper.update(make_scan(pose, k * 10**8, beams=30), pose).dropped_beams)
    assert set(dropped) == {0}


def test_points_of_several_scans_are_one_scan_with_normals_towards_it() -> None:
    _, points = seen_room(noise=0.01)
    T = np.array([0.2, 0.1, 0.05])
    moved = transformed(points[::3], T)
    back = joined([points[1::3], transformed(moved, se2.inverse(T))], np.zeros(2))
    bearing = np.arctan2(back[:, 1], back[:, 0])
    assert (np.diff(bearing) >= 0.0).all() and len(back) == len(points[1::3]) + len(moved)
    assert (np.einsum("ij,ij->i", back[:, :2], back[:, 2:4])[back[:, 4] > 0.0] < 0.0).all()


def test_normals_are_those_of_a_slow_twin() -> None:
    rng = np.random.default_rng(3)
    points = np.zeros((60, 5))
    points[:, 0], points[:, 1] = 2.0 + rng.normal(0.0, 0.01, 60), rng.uniform(-1.0, 1.0, 60)
    points[:2] = 0.3
    out = points.copy()
    find_normals(points, np.zeros(2), out)
    for point, before in zip(out, points, strict=True):
        near = points[np.hypot(*(points[:, :2] - before[:2]).T) <= 0.22]
        if len(near) < NEIGHBOURS_LEAST:
            assert np.array_equal(point, before)
            continue
        values, axes = np.linalg.eigh(np.cov(near[:, :2].T, bias=True))
        if values[0] < 0.1 * values[1] and values[1] > 0.07**2:
            normal = -np.sign(axes[0, 0]) * axes[:, 0]  # towards the origin, at x = 0
            assert np.allclose(point[2:4], normal) and point[4] > 0.0


def gathered(*way_m: float, each: int = 10) -> Gathering:
    """Return scans of so many returns each that wait, taken after so much way."""
    gathering = Gathering()
    for x_m in way_m:
        gathering.add(np.array([x_m, 0.0, 0.0]), np.ones((each, 5)))
    return gathering


def test_scans_wait_until_they_are_enough_or_lie_far_apart() -> None:
    assert not gathered(0.0, 0.0).is_enough
    assert gathered(*[0.0] * (ENOUGH // 10)).is_enough
    assert gathered(0.0, WAY_MOST_M + 0.01).is_enough


def test_scans_that_odometry_blurs_are_forgotten() -> None:
    assert gathered(0.0, 0.1, 0.2, 0.3, 0.45).returns == 40  # one reaches back farther
    waiting = gathered(0.0, 0.1)
    waiting.drop()
    assert waiting.returns == 0


def test_a_keyframe_shows_what_was_matched_since_the_last_one() -> None:
    gathering, here = Gathering(), np.zeros(3)
    for count in (3, 1):
        for _ in range(count):
            gathering.remember(here, np.ones((2, 5)))
        assert len(gathering.of_key(here, np.zeros(2))) == 2 * count


def test_a_sparse_laser_is_known_for_one_after_a_restart() -> None:
    gathering, again = Gathering(), Gathering()
    gathering.count(SPARSE - 5)
    again.restore(gathering.state())
    again.count(SPARSE + 5)
    assert gathering.is_sparse and again.is_sparse
