"""A saved map's keyframes follow its walls, not the visits; the last visits' are kept."""

from __future__ import annotations

import numpy as np

from mrslam.merge.sessions.thinning import SHOWN_BY, needed
from mrslam.spatial import KeyScans

HALF_M, BEGIN_M, END_M, REACH_M = 1.5, -1.0, 41.0, 8.0


def way(from_m: float, to_m: float, *, y_m: float = 0.0, heading_rad: float = 0.0) -> np.ndarray:
    x = np.arange(from_m, to_m, 0.5)
    return np.stack([x, np.full_like(x, y_m), np.full_like(x, heading_rad)], axis=1)


def corridor(pose: np.ndarray, field_rad: float = 2.0 * np.pi, piece_m: float | None = None) -> np.ndarray:
    """What a laser in a corridor sees, ``(n, 2)`` in its frame; furniture at one wall begins at ``piece_m``."""
    bearings = np.linspace(-0.5 * field_rad, 0.5 * field_rad, 60, endpoint=False) + 0.01
    x, y, turn = pose
    along, across = np.cos(bearings + turn), np.sin(bearings + turn)
    range_m = np.minimum(
        np.where(across > 0, HALF_M - y, HALF_M + y) / np.abs(across),
        np.where(along > 0, END_M - x, x - BEGIN_M) / np.abs(along),
    )
    if piece_m is not None and x < piece_m:
        front_m = np.where(along > 0, (piece_m - x) / np.abs(along), np.inf)
        range_m = np.where((front_m < range_m) & (y + front_m * across > 0.9), front_m, range_m)
    near = range_m < REACH_M
    return (range_m * np.stack([np.cos(bearings), np.sin(bearings)]))[:, near].T


def seen(poses: np.ndarray, field_rad: float = 2.0 * np.pi, piece_m: float | None = None) -> KeyScans:
    return KeyScans.of_points([corridor(pose, field_rad, piece_m) for pose in poses], np.zeros((len(poses), 2)))


def kept(*ways: np.ndarray, field_rad: float = 2.0 * np.pi) -> list[int]:
    """Number of keyframes that are kept of each way."""
    poses = np.concatenate(ways)
    keep = needed(poses, seen(poses, field_rad))
    return [int(part.sum()) for part in np.split(keep, np.cumsum([len(one) for one in ways])[:-1])]


def test_where_somebody_came_again_fewer_of_the_first_visit_are_kept() -> None:
    once = kept(way(0.0, 40.0))[0]
    assert 40 <= once <= 70
    assert kept(way(0.0, 40.0), way(0.0, 40.0, y_m=0.3))[0] <= 0.1 * once


def test_the_last_visit_is_kept_and_the_others_where_it_was_not() -> None:
    poses = np.concatenate([way(0.0, 40.0), way(0.0, 25.0, y_m=0.3)])
    keep = needed(poses, seen(poses))
    assert keep[:40].sum() <= 2 and keep[60:80].sum() >= 10 and keep[80:].sum() >= 20


def test_the_other_way_round_shows_the_same_walls_when_the_laser_looks_all_around() -> None:
    there, back = way(0.0, 20.0), way(0.0, 20.0, heading_rad=np.pi)
    assert kept(there, back)[0] <= 5
    assert min(kept(there, back, field_rad=np.pi)) >= 10


def test_keyframes_that_show_furniture_which_went_are_not_kept_for_it() -> None:
    monday, tuesday = way(0.0, 40.0), way(0.0, 40.0, y_m=0.2)
    poses, furnished = np.concatenate([monday, tuesday]), seen(monday, piece_m=20.0)
    hits = furnished.points[:, 0] + np.repeat(monday[:, 0], np.diff(furnished.starts))
    assert (np.abs(hits - 20.0) < 0.05).sum() >= 20
    keep = needed(poses, furnished.append(seen(tuesday)))
    assert not keep[24:40].any() and keep[80:].sum() >= 30


def test_the_number_follows_the_floor_and_not_the_visits() -> None:
    rng = np.random.default_rng(1)
    counts = []
    for visits in (3, 10, 30):
        ways = [way(0.0, 40.0, y_m=float(y)) for y in rng.uniform(-1.0, 1.0, visits)]
        counts.append(sum(kept(*ways)))
    assert counts[2] <= 1.2 * counts[0] and counts[1] <= 1.2 * counts[0]


def test_walls_that_many_showed_are_still_shown_by_several() -> None:
    rng = np.random.default_rng(2)
    poses = rng.uniform([0, -1, -np.pi], [30, 1, np.pi], (600, 3))
    scans = seen(poses, np.pi)
    keep = needed(poses, scans)
    assert keep.sum() < 200
    shown = []
    for keys in (np.arange(600), np.flatnonzero(keep)):
        places = [poses[k, 0] + np.cos(poses[k, 2]) * x - np.sin(poses[k, 2]) * y for k in keys for x, y in scans.of(k)]
        shown.append(np.histogram(places, bins=30, range=(0.0, 30.0))[0])
    assert (shown[0] > 0).all() and (shown[1] >= SHOWN_BY).all()


def test_keyframes_without_scans_are_left_out_where_others_have_some() -> None:
    places, none = np.concatenate([way(0.0, 40.0), way(0.0, 50.0, y_m=0.3)]), KeyScans.blank(100)
    keep = needed(places, seen(places[:80]).append(none))
    assert keep[:80].any() and not keep[80:].any()
    assert needed(places, KeyScans.blank(180)).all()


def test_nothing_of_nothing() -> None:
    assert needed(np.empty((0, 3)), KeyScans.empty()).shape == (0,)
