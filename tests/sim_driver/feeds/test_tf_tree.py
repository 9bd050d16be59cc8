"""Frames and motions of recordings, whatever those hold."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.sim_driver.feeds.tf_tree import Motion, TransformTree, rotation_matrix

NS = 1_000_000_000


def place(x: float, y: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(x=x, y=y, z=0.0)


def turn(yaw: float) -> SimpleNamespace:
    return SimpleNamespace(w=np.cos(yaw / 2), x=0.0, y=0.0, z=np.sin(yaw / 2))


def test_poses_that_came_late_are_sorted_in_and_those_that_are_none_passed_over() -> None:
    motion = Motion()
    for stamp_s, x in ((1, 1.0), (3, 3.0), (2, 2.5)):
        motion.add(stamp_s * NS, place(x), turn(0.0))
    for bad in (np.nan, np.inf):
        motion.add(2 * NS + 1, place(bad), turn(0.0))
        motion.add(2 * NS + 1, place(0.0), SimpleNamespace(w=bad, x=0.0, y=0.0, z=0.0))
    assert len(motion) == 3
    assert motion.at(5 * NS // 2, 1.0) == pytest.approx([2.75, 0.0, 0.0])
    assert motion.at(3 * NS // 2, 1.0) == pytest.approx([1.75, 0.0, 0.0])
    assert motion.at(4 * NS, 1.0) == pytest.approx([3.0, 0.0, 0.0]) and motion.at(4 * NS + 1, 1.0) is None


def tree(*mounts: tuple[str, str]) -> TransformTree:
    """Return frames (parent, child), none of which moves."""
    found = TransformTree()
    for stamp_s in (1, 2):
        for parent, child in mounts:
            found.add(parent, child, stamp_s * NS, place(0.5), turn(0.0))
    return found


def test_where_nothing_moves_the_base_is_the_topmost_frame_that_is_of_the_robot() -> None:
    frames = tree(("map", "odom"), ("odom", "base_link"), ("base_link", "mast"), ("mast", "laser"))
    assert frames.base_above("laser") == "base_link"
    assert not frames.moves("base_link") and frames.base_above("map") is None
    assert tree(("world", "robot"), ("robot", "laser")).base_above("laser") == "robot"
    frames.add("odom", "base_link", 3 * NS, place(0.7), turn(0.0))
    assert frames.moves("base_link") and frames.base_above("laser") == "base_link"
    frames.add("mast", "laser", 3 * NS, place(0.5), turn(0.3))
    assert frames.base_above("laser") == "laser"  # it turns on its mast: that is what moves


def test_frames_in_a_ring_and_frames_on_themselves_lead_nowhere() -> None:
    assert tree(("laser", "laser")).parent("laser") is None
    ring = tree(("a", "b"), ("b", "c"), ("c", "a"))
    assert ring.between("a", "b") is not None and ring.between("nowhere", "b") is None


def test_a_quaternion_of_zeros_is_no_rotation_and_one_of_any_length_is_its_direction() -> None:
    np.testing.assert_array_equal(rotation_matrix(SimpleNamespace(w=0.0, x=0.0, y=0.0, z=0.0)), np.eye(3))
    long = SimpleNamespace(w=3.0, x=0.0, y=0.0, z=3.0)
    np.testing.assert_allclose(rotation_matrix(long) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)
