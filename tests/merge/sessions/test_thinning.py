"""A saved map's keyframes follow its floor: the last visit to a place is kept."""

from __future__ import annotations

import numpy as np

from mrslam.merge.sessions.thinning import SAME_M, SAME_RAD, last_visits


def way(length_m: float, *, y_m: float = 0.0, heading_rad: float = 0.0) -> np.ndarray:
    x = np.arange(0.0, length_m, 0.5)
    return np.stack([x, np.full_like(x, y_m), np.full_like(x, heading_rad)], axis=1)


def kept(*ways: np.ndarray) -> list[int]:
    """Number of keyframes that are kept of each session."""
    sessions = np.repeat(np.arange(len(ways)), [len(one) for one in ways])
    keep = last_visits(np.concatenate(ways), sessions)
    return [int(keep[sessions == k].sum()) for k in range(len(ways))]


def test_of_one_visit_all_are_kept() -> None:
    assert kept(way(40.0)) == [80]


def test_the_last_visit_is_kept_whole_and_the_others_where_it_was_not() -> None:
    assert kept(way(40.0), way(30.0, y_m=0.3)) == [19, 60]


def test_the_other_way_round_is_another_view() -> None:
    assert kept(way(20.0), way(20.0, heading_rad=np.pi)) == [40, 40]
    assert kept(way(20.0, heading_rad=-3.1), way(20.0, heading_rad=3.1)) == [0, 40]  # across the turn of the angle


def test_laps_of_one_session_are_visits() -> None:
    lap = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    ring = np.stack([3.0 * np.cos(lap), 3.0 * np.sin(lap), lap + np.pi / 2], axis=1)
    count = kept(np.concatenate([ring] * 5))[0]
    assert 36 <= count <= 44


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
    keep = last_visits(poses, np.repeat(np.arange(6), 100))
    assert 0 < keep.sum() < 500
    for k in np.flatnonzero(~keep):
        near = np.hypot(*(poses[keep, :2] - poses[k, :2]).T) <= SAME_M
        turned = np.abs(np.angle(np.exp(1j * (poses[keep, 2] - poses[k, 2])))) <= SAME_RAD
        assert (near & turned).any()


def test_nothing_of_nothing() -> None:
    assert last_visits(np.empty((0, 3)), np.empty(0, np.int64)).shape == (0,)
