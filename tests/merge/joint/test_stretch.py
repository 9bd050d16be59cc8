"""Stretches of a robot's way are known by what they match by."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.merge import LocalMatcher, Trail
from mrslam.merge.joint.stretch import Stretch
from mrslam.spatial import KeyScans, se2
from tests.merge.joint.blocks import drive

A = drive(0.0, 40.0, seed=1).trail
KEYS = np.arange(28, 33)


def content(trail: Trail) -> bytes:
    return Stretch.of(trail.T_map_key, 30, KEYS).content(trail.scans)


def test_a_stretch_is_a_keyframe_and_those_around_it_in_its_frame() -> None:
    stretch = A.stretch(30, 2)
    np.testing.assert_array_equal(stretch.keys, KEYS)
    np.testing.assert_allclose(se2.compose(A.T_map_key[30], stretch.T_key_keys), A.T_map_key[28:33], atol=1e-12)
    assert A.content(30, 2) is A.content(30, 2) and A.content(30, 2) != A.content(30, 3)
    assert A.stretch(30, 3).keys.size == 7 and A.stretch(31, 2).keys[0] == 29


def test_stretches_that_match_alike_have_the_same_content() -> None:
    assert content(A) == A.content(30, 2) == content(Trail(A.T_map_key.copy(), A.scans.copy()))
    far = A.T_map_key.copy()
    far[20] += 0.1
    assert content(Trail(far, A.scans)) == content(A)


@pytest.mark.parametrize("what", ["pose", "point", "origin", "whose point"])
def test_stretches_that_may_match_otherwise_have_not(what: str) -> None:
    poses, scans = A.T_map_key.copy(), A.scans.copy()
    if what == "pose":
        poses[29, 0] += 1e-9
    elif what == "point":
        scans.polar[scans.starts[31], 1] += 1
    elif what == "origin":
        scans.origins[28, 0] += 0.001
    else:
        scans.starts[30] += 1
    assert content(Trail(poses, KeyScans.of_checked(scans.starts, scans.polar, scans.origins))) != content(A)


def test_each_stretch_of_the_other_robot_is_asked_for_itself() -> None:
    matcher = LocalMatcher()
    for j in (12, 40):
        matcher.match(A, 30, A, j, se2.IDENTITY, 5.0)
    assert matcher.matched == 2
