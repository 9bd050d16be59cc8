"""From ranges to points with normals."""

from __future__ import annotations

import numpy as np

from mrslam.spatial.matching.scan_points import LONE_QUALITY, UNSURE, scan_points, spaced
from tests.rbpf.rooms import seen_room


def test_normals_look_at_the_laser_and_stand_on_walls() -> None:
    _, points = seen_room()
    good = points[points[:, 4] > 0.8]
    assert good.shape[0] > 200
    assert ((good[:, :2] * good[:, 2:4]).sum(axis=1) < 0).all()
    along_an_axis = np.abs(good[:, 2:4]).max(axis=1) > 0.97
    assert along_an_axis.mean() > 0.9


def test_spacing_is_measured_across_the_beams() -> None:
    arc = np.zeros((500, 5))
    angles = np.arange(500) * 0.005
    arc[:, 0], arc[:, 1] = 2.0 * np.cos(angles) + 0.3, 2.0 * np.sin(angles)
    origin, out = np.array([0.3, 0.0]), np.zeros((500, 5))
    count = spaced(arc, origin, 0.05, 500, out)
    gaps = np.hypot(*np.diff(out[:count, :2], axis=0).T)
    assert 80 < count <= 101 and gaps.min() >= 0.045
    count = spaced(arc, origin, 0.05, 40, out)
    assert 20 < count <= 40
    assert np.arctan2(out[count - 1, 1], out[count - 1, 0] - 0.3) > 0.95 * angles[-1]  # wider apart, of the whole scan
    arc[::2, 4] = UNSURE
    count = spaced(arc, origin, 0.001, 500, out)
    assert count == 250 and (out[:count, 4] == 0.0).all()


def test_spacing_does_not_choose_points_by_their_noise() -> None:
    rng = np.random.default_rng(3)
    angles = np.radians(np.arange(-120.0, 120.0, 0.35))
    walls = 1.2 / np.maximum(np.abs(np.sin(angles)), 0.25)
    out, left, right = np.zeros((angles.size, 5)), [], []
    for _ in range(60):
        noise = rng.normal(0.0, 0.03, angles.size)
        ranges = walls + noise
        points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), *np.zeros((3, angles.size))], axis=1)
        kept = out[: spaced(points, np.zeros(2), 0.03, 400, out)]
        at = np.round((np.arctan2(kept[:, 1], kept[:, 0]) - angles[0]) / (angles[1] - angles[0])).astype(int)
        front = np.abs(angles[at]) < np.pi / 2
        left += noise[at[front & (angles[at] > 0.3)]].tolist()
        right += noise[at[front & (angles[at] < -0.3)]].tolist()
    assert abs(np.mean(left) - np.mean(right)) < 0.002


def test_sparse_points_of_a_wall_are_no_things_of_their_own() -> None:
    angles = np.radians(np.arange(-90.0, 91.0, 1.0))
    ranges = (1.2 / np.maximum(np.abs(np.sin(angles)), 1e-3)).astype(np.float32)
    ranges[ranges > 30.0] = np.nan
    ranges[105] = 2.0  # a pillar before the wall
    points = np.zeros((angles.size, 5))
    n = scan_points(ranges, np.cos(angles), np.sin(angles), np.zeros(3), 30.0, points)
    far = points[:n][np.hypot(points[:n, 0], points[:n, 1]) > 6.0]
    lines = far[far[:, 4] > 0.0]
    assert lines.shape[0] > 8 and (far[:, 4] == 0.0).sum() <= 2
    assert (np.abs(lines[:, 3]) > 0.99).all() and (lines[:, 1] * lines[:, 3] < 0.0).all()
    pillar = points[:n][np.abs(np.hypot(points[:n, 0], points[:n, 1]) - 2.0).argmin()]
    assert pillar[4] == 0.0


def seen(angles_deg: list[float], ranges_m: list[float], usable_m: float = 30.0) -> np.ndarray:
    """Return what a laser at the origin sees as points."""
    angles, points = np.radians(angles_deg), np.zeros((len(angles_deg), 5))
    ranges = np.array(ranges_m, dtype=np.float32)
    return points[: scan_points(ranges, np.cos(angles), np.sin(angles), np.zeros(3), usable_m, points)]


def test_only_returns_within_the_usable_range_are_points() -> None:
    points = seen([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0], [1.0, np.nan, np.inf, 0.0, -1.0, 4.0, 4.1], usable_m=4.0)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), [1.0, 4.0], rtol=1e-6)


def test_what_lies_along_the_beams_may_be_nothing_between_an_edge_and_the_wall_behind_it() -> None:
    steps = np.arange(11)
    mixed = seen(list(0.02 * steps), list(2.0 + 0.06 * steps))  # an edge, close points in line with the laser
    assert (mixed[:, 4] == UNSURE).all() and (mixed[:, 2:4] == 0.0).all()
    slanting = seen(list(0.4 * steps), list(2.0 + 0.06 * steps))
    assert (slanting[1:-1, 4] > 0.5).all()
    far_apart = seen([0.0, 0.02, 0.04, 0.06], [4.0, 4.7, 5.4, 6.1])
    assert (far_apart[:, 4] == UNSURE).all()
    wall = seen([0.0, 8.0, 16.0, 24.0], [4.0 / np.cos(np.radians(angle)) for angle in (0.0, 8.0, 16.0, 24.0)])
    assert (wall[:, 4] == LONE_QUALITY).all()
    np.testing.assert_allclose(wall[:, 2:4], [[-1.0, 0.0]] * 4, atol=1e-6)


def test_three_points_far_from_each_other_or_out_of_line_are_no_wall() -> None:
    angles = np.array([0.0, 40.0, 60.0])
    assert (seen(list(angles), list(4.0 / np.cos(np.radians(angles))))[:, 4] == 0.0).all()  # 7 m of it, seen from 4 m
    bent = seen([0.0, 8.0, 16.0], [4.0, 4.4, 4.0])
    assert (bent[:, 4] == 0.0).all()
