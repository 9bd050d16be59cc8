"""Which scans are refused before anything is matched to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf.front_end.scan_gate import POINTS_LEAST, STUCK, ScanGate
from mrslam.spatial import Scan
from mrslam.spatial.se2 import IDENTITY, Transform
from tests.rbpf.rooms import make_scan

STUCK_WORDS = "the scan repeats one that was taken elsewhere, by odometry"
USELESS_WORDS = "the scan shows no surfaces, nor what was seen before"


def room(stamp_ns: int, x_m: float = 0.0) -> Scan:
    return make_scan(np.array([x_m, 0.0, 0.0]), stamp_ns, rng=np.random.default_rng(stamp_ns))


def again(scan: Scan, stamp_ns: int) -> Scan:
    return replace(scan, stamp_ns=stamp_ns)


def rubbish(stamp_ns: int) -> Scan:
    scan = room(stamp_ns)
    ranges_m = np.random.default_rng(stamp_ns).uniform(0.5, 30.0, scan.ranges_m.size)
    return replace(scan, ranges_m=ranges_m.astype(np.float32))


def points(count: int, on_surfaces: int) -> np.ndarray:
    out = np.zeros((count, 5))
    out[:on_surfaces, 4] = 1.0
    return out


def refused(
    gate: ScanGate, scan: Scan, T_odom_base: Transform | None, on_surfaces: int = 100, *, knows: bool = False
) -> str | None:
    return gate.refuse(scan, points(100, on_surfaces), T_odom_base, POINTS_LEAST, lambda: knows)


def test_the_same_ranges_are_those_of_a_robot_that_stands_unless_odometry_moved() -> None:
    gate, scan = ScanGate(), room(1)
    assert refused(gate, scan, IDENTITY) is None
    assert refused(gate, again(scan, 2), IDENTITY) is None
    assert refused(gate, again(scan, 3), np.array([0.9 * STUCK, 0.0, 0.0])) is None
    moves = np.diag([1.1 * STUCK, -1.1 * STUCK, -1.1 * STUCK])
    assert [refused(gate, again(scan, 4 + k), moved) for k, moved in enumerate(moves)] == [STUCK_WORDS] * 3
    assert refused(gate, room(7, 0.3), np.array([0.3, 0.0, 0.0])) is None


@pytest.mark.parametrize(
    ("beams", "kept", "is_stuck"), [(400, 40, True), (400, 39, False), (40, 20, True), (40, 19, False)]
)
def test_a_stuck_laser_most_of_whose_beams_end_at_a_teammate_is_known_by_the_others(
    beams: int, kept: int, is_stuck: bool
) -> None:
    """The teammate is masked where it is believed to be, another part of the same scan each time."""
    gate, scan = ScanGate(), make_scan(IDENTITY, 1, beams=beams, rng=np.random.default_rng(1))
    ranges_m = scan.ranges_m.copy()
    ranges_m[kept + 1 :] = np.nan
    assert refused(gate, replace(scan, ranges_m=ranges_m), IDENTITY) is None
    later = scan.ranges_m.copy()
    later[kept:] = np.nan
    moved = np.array([0.0, 0.0, 0.1])
    assert refused(gate, replace(scan, ranges_m=later, stamp_ns=2), moved) == (STUCK_WORDS if is_stuck else None)
    later[0] += 0.01  # nothing repeats itself
    assert refused(gate, replace(scan, ranges_m=later, stamp_ns=3), moved) is None
    assert refused(gate, replace(scan, ranges_m=later, stamp_ns=4), 2.0 * moved) == STUCK_WORDS  # to the last byte


@pytest.mark.parametrize("odometry", [(None, None), (IDENTITY, None), (None, np.ones(3))])
def test_where_odometry_is_missing_nothing_is_known_to_have_moved(odometry: tuple) -> None:
    gate, scan = ScanGate(), room(1)
    assert refused(gate, scan, odometry[0]) is None
    assert refused(gate, again(scan, 2), odometry[1]) is None


def test_a_scan_that_comes_twice_at_one_time_counts_once() -> None:
    gate, scan = ScanGate(), room(1)
    assert refused(gate, scan, None) is None
    assert refused(gate, again(scan, 1), None) == "the scan repeats the one before"


def test_a_scan_without_surfaces_is_used_where_it_fits_the_map_or_the_scan_before() -> None:
    assert refused(ScanGate(), rubbish(1), None, 0) == USELESS_WORDS
    assert refused(ScanGate(), rubbish(1), None, 0, knows=True) is None
    gate = ScanGate()
    assert refused(gate, room(1), None) is None
    assert refused(gate, room(2), None, 0) is None
    assert refused(gate, rubbish(3), None, 0) == USELESS_WORDS


def test_rubbish_that_is_sent_again_is_not_what_was_seen_before() -> None:
    gate = ScanGate()
    assert refused(gate, rubbish(1), None, 0) == USELESS_WORDS
    assert refused(gate, again(rubbish(1), 2), None, 0) == USELESS_WORDS


@pytest.mark.parametrize("turned_rad", [0.3, -0.3])
def test_a_robot_that_turns_sees_the_same_place_in_other_beams(turned_rad: float) -> None:
    gate = ScanGate()
    assert refused(gate, room(1), None) is None
    assert refused(gate, make_scan(np.array([0.0, 0.0, turned_rad]), 2), None, 0) is None


def test_a_twentieth_of_many_beams_alike_is_chance() -> None:
    gate = ScanGate()
    before, scan = (make_scan(np.zeros(3), stamp_ns, beams=1440) for stamp_ns in (1, 2))
    other_m = np.random.default_rng(1).uniform(0.5, 30.0, 1440).astype(np.float32)
    assert refused(gate, before, None) is None
    assert refused(gate, replace(scan, ranges_m=other_m), None, 0) == USELESS_WORDS


def test_a_laser_that_is_stuck_with_most_beams_dropped_is_stuck() -> None:
    gate, scan = ScanGate(), room(1)
    ranges_m = scan.ranges_m.copy()
    ranges_m[: int(0.6 * ranges_m.size)] = np.nan
    scan = replace(scan, ranges_m=ranges_m)
    assert refused(gate, scan, IDENTITY) is None
    assert refused(gate, again(scan, 2), np.ones(3)) == STUCK_WORDS


def test_a_quarter_of_the_points_on_surfaces_shows_a_place() -> None:
    assert refused(ScanGate(), rubbish(1), None, 26) is None
    assert refused(ScanGate(), rubbish(1), None, 24) == USELESS_WORDS


def test_points_of_a_useful_scan_are_counted() -> None:
    for count, reason in ((POINTS_LEAST - 1, "9 usable returns, 10 are needed"), (POINTS_LEAST, None)):
        assert ScanGate().refuse(room(1), points(count, count), None, POINTS_LEAST, lambda: False) == reason


def test_a_gate_that_resumes_knows_what_it_saw() -> None:
    gate, scan, resumed = ScanGate(), room(1), ScanGate()
    assert refused(gate, scan, IDENTITY) is None
    resumed.restore(gate.state())
    assert refused(resumed, again(scan, 2), np.ones(3)) == STUCK_WORDS
