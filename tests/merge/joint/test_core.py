"""Keyframes that saw only what others had seen are no part of a joint solution's graph, and follow it."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.merge import JointMap, Trail, join
from mrslam.merge.joint import believable
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.ways import Ways
from mrslam.spatial import KeyScans, se2
from tests.merge.joint.blocks import drive

A, B = drive(0.0, 60.0, 0.001, seed=1), drive(30.0, 60.0, -0.001, seed=2)
T_A_B = se2.between(A.truth[0], B.truth[0])
TURN = se2.transform(0.0, 0.0, np.pi)
AT, DETOUR = 70, 30
"""B's keyframe at which the robot of ``DETOURED`` turns, and how many it drives back, and then forth again."""


def bare_detour(trail: Trail) -> Trail:
    """Return the trail of a robot that drives back at ``AT``, and forth again, where it has been: without scans."""
    count = len(trail)
    order = [*range(AT), *range(AT - 2, AT - 2 - DETOUR, -1), *range(AT - DETOUR, AT), *range(AT, count)]
    is_back = np.arange(len(order)) - AT < DETOUR
    is_bare = (np.arange(len(order)) >= AT) & (np.arange(len(order)) < AT + 2 * DETOUR)
    keys = trail.T_map_key[order]
    keys[is_bare & is_back] = se2.compose(keys[is_bare & is_back], TURN)
    blank = KeyScans.blank(1)
    scans = (blank if bare else trail.scans.part(k, k + 1) for k, bare in zip(order, is_bare, strict=True))
    return Trail(keys, KeyScans.concatenate(scans), np.arange(len(order)) * 1_000_000_000)


DETOURED = bare_detour(B.trail)
KEPT = np.r_[: AT + 1, AT + 2 * DETOUR - 1 : len(DETOURED)]
"""Those with scans, and both ends of the stretch without."""
SHOWN = np.r_[:AT, AT + 2 * DETOUR : len(DETOURED)]


def joined(b: Trail) -> JointMap:
    return join({"a": A.trail, "b": b}, {"a": se2.IDENTITY, "b": T_A_B})


@pytest.fixture(scope="module")
def both() -> tuple[JointMap, JointMap]:
    """Return the solutions without and with a detour."""
    return joined(B.trail), joined(DETOURED)


def test_the_core_has_the_keyframes_with_scans_and_the_ends_of_stretches_without() -> None:
    core = DETOURED.core
    np.testing.assert_array_equal(core.keys, KEPT)
    np.testing.assert_array_equal(core.trail.T_map_key, DETOURED.T_map_key[KEPT])
    np.testing.assert_array_equal(core.trail.stamps_ns, DETOURED.stamps_ns[KEPT])
    assert core.trail.scans.equals(KeyScans.concatenate(DETOURED.scans.part(k, k + 1) for k in KEPT.tolist()))
    np.testing.assert_array_equal(core.keys[core.follows[KEPT]], KEPT)


@pytest.mark.parametrize("trail", [A.trail, Trail(A.trail.T_map_key, KeyScans.blank(len(A.trail)))])
def test_where_every_keyframe_has_a_scan_or_none_has_all_are_kept(trail: Trail) -> None:
    core = trail.core
    np.testing.assert_array_equal(core.keys, np.arange(len(trail)))
    np.testing.assert_array_equal(core.follows, core.keys)
    np.testing.assert_array_equal(core.trail.T_map_key, trail.T_map_key)
    assert core.trail.scans.equals(trail.scans)


def test_a_detour_through_what_is_known_changes_no_place(both: tuple[JointMap, JointMap]) -> None:
    plain, detoured = (joint.T_team_key["b"] for joint in both)
    assert len(detoured) == len(DETOURED)
    assert np.hypot(*(detoured[SHOWN] - plain)[:, :2].T).max() < 5e-3
    assert np.hypot(*(both[1].T_team_key["a"] - both[0].T_team_key["a"])[:, :2].T).max() < 5e-3


def test_who_saw_nothing_new_is_where_the_others_show_it_to_be(both: tuple[JointMap, JointMap]) -> None:
    _, detoured = both
    T = detoured.T_team_key["b"]
    back = np.arange(AT + 1, AT + DETOUR)  # inner ones: at the places of earlier ones, turned round
    there = AT - 2 - (back - AT)
    np.testing.assert_allclose(T[back, :2], T[there, :2], atol=1e-9)
    np.testing.assert_allclose(np.abs(se2.wrap(T[back, 2] - T[there, 2])), np.pi, atol=1e-9)
    bent = np.hypot(*(T[there, :2] - se2.compose(T_A_B, DETOURED.T_map_key[there])[:, :2]).T)
    assert bent.max() > 0.02  # else nothing had to follow


def test_ties_are_between_keyframes_of_the_whole_trails(both: tuple[JointMap, JointMap]) -> None:
    _, detoured = both
    assert detoured.tied("a", "b") >= 12
    late = [tie.match for tie in detoured.ties if tie.match.j >= AT]
    assert late and all(match.j in SHOWN for match in late)
    for match in late:
        seen = se2.compose(A.truth[match.i], match.T_i_j)
        assert np.hypot(*(seen - B.truth[match.j - 2 * DETOUR])[:2]) < 0.3


def test_the_solved_graph_has_the_core_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    solve = believable.solve
    monkeypatch.setattr(
        believable, "solve", lambda trails, *rest: sizes.append(sum(map(len, trails.values()))) or solve(trails, *rest)
    )
    joined(DETOURED)
    assert set(sizes) == {len(A.trail) + KEPT.size}


def test_scans_on_both_sides_of_a_stretch_without_are_no_neighbours() -> None:
    core = DETOURED.core.trail
    np.testing.assert_array_equal(core.around(AT - 1, 3), np.arange(AT - 4, AT + 1))
    np.testing.assert_array_equal(core.around(AT + 2, 3), np.arange(AT + 1, AT + 6))
    np.testing.assert_array_equal(A.trail.around(1, 3), np.arange(5))
    np.testing.assert_array_equal(A.trail.around(len(A.trail) - 1, 1), [len(A.trail) - 2, len(A.trail) - 1])


def test_the_way_to_another_robot_is_that_of_the_keyframe_that_is_followed() -> None:
    tie = Tie("a", "b", KeyMatch(10, AT + 2 * DETOUR + 3, np.zeros(3), np.eye(3)), True)
    to_a = Ways({"a": A.trail, "b": DETOURED}, [tie]).to("a")["b"]
    assert to_a.shape == (len(DETOURED),)
    assert to_a[tie.match.j] == pytest.approx(0.0, abs=1e-3)
    core = DETOURED.core
    np.testing.assert_array_equal(to_a, to_a[core.keys[core.follows]])
    assert to_a[AT - 5] == pytest.approx(0.5 * 8, abs=1.6)
