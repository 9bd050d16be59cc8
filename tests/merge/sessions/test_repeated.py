"""A session that a saved map holds is not taken for a newer one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.merge.sessions.one_map import one_map
from mrslam.merge.sessions.repeated import check_sessions
from mrslam.spatial import InputError, Keyframes, KeyScans, OccupancyGrid
from mrslam.spatial.files.saved_map import SavedMap, of_one_session
from tests.merge.joint.blocks import drive
from tests.merge.sessions.test_one_map import session

MONDAY = session(drive(0.0, 60.0, seed=1), "r1@monday")


def renamed(saved: SavedMap, name: str) -> SavedMap:
    return replace(saved, sessions=(replace(saved.sessions[0], name=name),))


def joined(*given: SavedMap) -> SavedMap:
    sessions = tuple(session for saved in given for session in saved.sessions)
    keyframes = Keyframes(
        np.concatenate([saved.keyframes.stamps_ns for saved in given]),
        np.concatenate([saved.keyframes.T_map_base for saved in given]),
    )
    return SavedMap(given[0].grid, keyframes, KeyScans.concatenate(saved.scans for saved in given), sessions)


def without_keyframes(saved: SavedMap) -> SavedMap:
    sessions = (replace(saved.sessions[0], keyframes=0),)
    return SavedMap(saved.grid, Keyframes.empty(), KeyScans.empty(), sessions)


def test_a_session_that_is_held_is_refused_by_name_and_nothing_is_made_of_it() -> None:
    tuesday = session(drive(20.0, 60.0, seed=2), "r1@tuesday")
    saved = one_map({"monday": MONDAY, "tuesday": tuesday}).saved
    with pytest.raises(InputError, match="monday: its session r1@monday is in office already"):
        one_map({"office": saved, "monday": MONDAY})


@pytest.mark.parametrize(
    "again",
    [renamed(MONDAY, "map@copy"), joined(session(drive(20.0, 60.0, seed=2), "r1@tuesday"), MONDAY)],
    ids=["another name", "the second of a saved map"],
)
def test_it_is_known_by_its_keyframes_and_in_any_place(again: SavedMap) -> None:
    with pytest.raises(InputError):
        check_sessions({"office": MONDAY, "again": again})
    with pytest.raises(InputError):
        check_sessions({"office": again, "again": MONDAY})


def test_one_of_which_no_keyframe_is_left_is_known_by_its_name() -> None:
    with pytest.raises(InputError):
        check_sessions({"office": without_keyframes(MONDAY), "again": MONDAY})
    check_sessions({"office": without_keyframes(MONDAY), "again": renamed(MONDAY, "r2@monday")})


def test_another_drive_and_one_that_went_on_are_taken() -> None:
    longer = session(drive(0.0, 70.0, seed=1), "r1@monday")
    beside = session(drive(0.0, 60.0, seed=2), "r1@monday")  # as long, and with the same stamps
    assert np.array_equal(beside.keyframes.stamps_ns, MONDAY.keyframes.stamps_ns)
    for later in (longer, beside):
        check_sessions({"office": MONDAY, "later": later})


def test_maps_without_a_path_may_have_one_name() -> None:
    grid = OccupancyGrid(np.full((200, 200), 0, dtype=np.int8), 0.05)
    bare = of_one_session("map@office", grid, Keyframes.empty(), KeyScans.empty())
    check_sessions({"first": bare, "second": bare})
