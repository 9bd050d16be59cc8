"""A saved map's keyframes follow its floor: the last visit to a place is kept."""

from __future__ import annotations

import numpy as np

from mrslam.merge.sessions.thinning import last_visits
from mrslam.spatial import KeyScans
from mrslam.spatial.key_scans import SAME_M


def way(length_m: float, *, y_m: float = 0.0, heading_rad: float = 0.0) -> np.ndarray:
    x = np.arange(0.0, length_m, 0.5)
    return np.stack([x, np.full_like(x, y_m), np.full_like(x, heading_rad)], axis=1)


def scans(count: int, field_rad: float = 2.0 * np.pi) -> KeyScans:
    """Scans with points all over a field of view."""
    angles = np.linspace(-0.49 * field_rad, 0.49 * field_rad, 40)
    points = 3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return KeyScans.of_points([points] * count, np.zeros((count, 2)))


def kept(*ways: np.ndarray, field_rad: float = 2.0 * np.pi) -> list[int]:
    """Number of keyframes that are kept of each session."""
    sessions = np.repeat(np.arange(len(ways)), [len(one) for one in ways])
    keep = last_visits(np.concatenate(ways), scans(len(sessions), field_rad), sessions)
    return [int(keep[sessions == k].sum()) for k in range(len(ways))]


def test_of_one_visit_all_are_kept() -> None:
    assert kept(way(40.0)) == [80]


def test_the_last_visit_is_kept_whole_and_the_others_where_it_was_not() -> None:
    assert kept(way(40.0), way(30.0, y_m=0.3)) == [18, 60]
    assert kept(way(40.0), way(30.0, y_m=SAME_M + 0.1)) == [80, 60]


def test_the_other_way_round_is_another_view_unless_the_laser_looks_all_around() -> None:
    there, back = way(20.0), way(20.0, heading_rad=np.pi)
    assert kept(there, back, field_rad=np.pi) == [40, 40] and kept(there, back) == [0, 40]
    askew = way(20.0, heading_rad=0.3)
    assert kept(there, askew, field_rad=np.pi) == [0, 40]


def test_directions_are_of_the_map() -> None:
    one = KeyScans.of_points([np.array([[2.0, 0.2]])] * 3, np.zeros((3, 2)))
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, np.pi / 2], [0.0, 0.0, -np.pi / 4]])
    assert [list(np.flatnonzero(row)) for row in one.directions(poses)] == [[0], [2], [7]]
    assert not KeyScans.blank(3).directions(poses).any()


def test_keyframes_without_scans_are_left_out_where_others_have_some() -> None:
    places, none = np.concatenate([way(40.0), way(50.0, y_m=0.3)]), KeyScans.blank(100)
    keep = last_visits(places, scans(80).append(none), np.zeros(180, dtype=np.int64))
    assert list(np.flatnonzero(keep)) == list(range(80))
    assert last_visits(way(40.0), KeyScans.blank(80), np.zeros(80, dtype=np.int64)).all()


def test_laps_of_one_session_are_visits() -> None:
    lap = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    ring = np.stack([3.0 * np.cos(lap), 3.0 * np.sin(lap), lap + np.pi / 2], axis=1)
    count = kept(np.concatenate([ring] * 5))[0]
    assert 34 <= count <= 44


def test_the_number_follows_the_floor_and_not_the_visits() -> None:
    rng = np.random.default_rng(1)
    counts = []
    for visits in (3, 10, 30):
        ways = [way(40.0, y_m=float(y)) for y in rng.uniform(-1.0, 1.0, visits)]
        counts.append(sum(kept(*ways)))
    assert counts[2] <= 1.2 * counts[0] and counts[1] <= 1.2 * counts[0]


def test_every_one_left_out_is_covered_by_one_that_stays() -> None:
    rng = np.random.default_rng(2)
    poses = rng.uniform([0, 0, -np.pi], [12, 12, np.pi], (600, 3))
    keep = last_visits(poses, scans(600, np.pi), np.repeat(np.arange(6), 100))
    assert 0 < keep.sum() < 500
    for k in np.flatnonzero(~keep):
        near = np.hypot(*(poses[keep, :2] - poses[k, :2]).T) <= SAME_M
        turned = np.abs(np.angle(np.exp(1j * (poses[keep, 2] - poses[k, 2])))) < np.pi / 2
        assert (near & turned).any()


def test_nothing_of_nothing() -> None:
    assert last_visits(np.empty((0, 3)), KeyScans.empty(), np.empty(0, np.int64)).shape == (0,)
