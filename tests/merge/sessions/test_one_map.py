"""Sessions of one building become one saved map that is continued again and again."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.merge import Bend
from mrslam.merge.sessions.one_map import one_map, placed_in_one_frame, thinned
from mrslam.spatial import KeyScans, OccupancyGrid, se2
from mrslam.spatial.files.saved_map import SavedMap, of_one_session, write_saved_map
from tests.merge.joint.blocks import Drive, around, drive, local_map
from tests.merge.plans import building
from tests.merge.sessions.test_diff import saved as without_scans
from tests.merge.sessions.test_diff import with_boxes


def session(drive_: Drive, name: str = "r1@monday") -> SavedMap:
    local = local_map(drive_)
    return of_one_session(name, local.map.to_grid(), local.keyframes, local.key_scans)


def errors_m(saved: SavedMap, start: np.ndarray) -> np.ndarray:
    """Distance of the map's keyframes from the middle of the ring, on which all drives were, metres."""
    ring = around(0.0, 100.0, 0.05)[:, :2]
    places = se2.apply(start, saved.keyframes.T_map_base[:, :2])
    return np.hypot(*(places[:, None] - ring[None]).transpose(2, 0, 1)).min(axis=1)


def test_sessions_are_bent_to_one_map_in_the_frame_of_the_first(tmp_path: Path) -> None:
    first = drive(0.0, 95.0, seed=1)
    saved = session(first)
    sizes = []
    for day, bend in enumerate((0.0007, -0.0007, 0.0005)):
        again = session(drive(30.0 * day, 80.0, bend, seed=2 + day), f"r1@{day}")
        made = one_map({"saved": saved, "today": again})
        assert made.result is not None and not made.result.team_map.unplaced
        saved = made.saved
        write_saved_map(tmp_path / "office.mrslam", saved)
        sizes.append((tmp_path / "office.mrslam").stat().st_size)
    assert saved.version == 4 and [one.name for one in saved.sessions][:2] == ["r1@monday", "r1@0"]
    assert sizes[2] <= 1.2 * sizes[0]
    assert len(saved.scans) <= 1.2 * len(session(first).scans)
    errors = errors_m(saved, first.truth[0])
    assert errors.mean() < 0.1 and errors.max() < 0.4
    walls = session(first).grid.is_occupied.sum()
    assert saved.grid.is_occupied.sum() < 1.5 * walls  # three visits, each laid a little beside the others


@pytest.mark.parametrize(("most_m", "is_drawn_again"), [(0.045, False), (0.2, True)])
def test_a_map_that_is_hardly_bent_is_not_drawn_again(most_m: float, is_drawn_again: bool) -> None:
    saved = session(drive(0.0, 40.0, seed=1))
    keys = saved.keyframes.T_map_base
    moved = keys + np.outer(most_m * np.sin(np.arange(len(keys)) / 4.0), [0.0, 1.0, 0.0])
    bend = Bend(keys, moved)
    team = SimpleNamespace(grid=saved.grid, bends={"saved": bend}, T_team_map={"saved": np.zeros(3)})
    placed = placed_in_one_frame(saved, "saved", SimpleNamespace(team_map=team))  # type: ignore[arg-type]
    same = np.array_equal(placed.grid.cropped().cells, saved.grid.cropped().cells)
    assert not bend.T_team_map.any() and same != is_drawn_again
    assert np.array_equal(placed.keyframes.T_map_base, moved)


def test_one_session_is_a_saved_map_and_is_thinned() -> None:
    made = one_map({"a": session(drive(0.0, 200.0, seed=1))})  # two laps
    assert made.result is None and made.saved.version == 1
    assert len(made.saved.scans) == made.saved.sessions[0].keyframes < 260


def test_what_fits_nowhere_is_no_part_of_it() -> None:
    a = session(drive(0.0, 60.0, seed=1))
    empty = OccupancyGrid(np.full((200, 200), 0, dtype=np.int8), 0.05)
    blank = of_one_session("b@c", empty, *(a.keyframes.__class__.empty(), a.scans.__class__.empty()))
    made = one_map({"a": a, "b": blank})
    assert made.result is not None and list(made.result.team_map.unplaced) == ["b"]
    assert made.saved.version == 1 and np.array_equal(made.saved.grid.cells, a.grid.cells)


def test_thinning_keeps_the_scan_of_each_keyframe() -> None:
    a = session(drive(0.0, 60.0, seed=1))
    doubled = SavedMap(
        a.grid,
        a.keyframes.__class__(
            np.tile(a.keyframes.stamps_ns, 2), np.concatenate([a.keyframes.T_map_base, a.keyframes.T_map_base])
        ),
        a.scans.append(a.scans),
        a.sessions * 2,
    )
    lean = thinned(doubled)
    first, second = (one.keyframes for one in lean.sessions)
    assert first <= 0.1 * second and 10 <= second < len(a.scans) and len(lean.scans) == first + second
    keys = np.searchsorted(a.keyframes.stamps_ns, lean.keyframes.stamps_ns)
    assert np.array_equal(lean.keyframes.T_map_base, a.keyframes.T_map_base[keys])
    assert lean.scans.equals(KeyScans.concatenate(a.scans.part(k, k + 1) for k in keys.tolist()))


def test_of_two_sessions_the_later_one_is_right() -> None:
    gone, came = (6.0, 3.5, 0.6, 0.4), (9.0, 3.5, 1.0, 0.5)
    before, after = (without_scans(with_boxes(building(), box)) for box in (gone, came))
    made = one_map({"monday": before, "tuesday": after}).saved.grid
    for (x, y, wide, high), shown in ((gone, False), (came, True)):
        centres = made.centres(made.is_occupied)
        inside = ((centres > (x - 0.1, y - 0.1)) & (centres < (x + wide + 0.1, y + high + 0.1))).all(axis=1)
        assert inside.any() == shown


def test_a_map_that_is_laid_as_it_is_takes_its_keyframes_along() -> None:
    saved, T = session(drive(0.0, 40.0, seed=1)), np.array([2.0, -1.0, 0.5])
    team = SimpleNamespace(grid=saved.grid, bends={}, T_team_map={"saved": T})
    placed = placed_in_one_frame(saved, "saved", SimpleNamespace(team_map=team))  # type: ignore[arg-type]
    np.testing.assert_allclose(placed.keyframes.T_map_base, se2.compose(T, saved.keyframes.T_map_base))
