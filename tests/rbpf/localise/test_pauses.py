"""A robot in a saved map that saw nothing for a while: its wheels may have leapt, or begun again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import FixedMap, Localiser, MapperConfig
from mrslam.rbpf.front_end.front_end import Step
from mrslam.spatial import se2
from tests.rbpf.localise.test_localiser import START, begun, drive, house, scan, way, wheels

PAUSE_SCANS = 60
"""Scans that did not come: six seconds."""
DROVE = np.array([1.0, 0.5, 0.6])


def after_pause(leap: NDArray[np.float64], away: NDArray[np.float64] = DROVE) -> tuple[Localiser, NDArray[np.float64]]:
    """Return a localiser after the first scan since a pause in which its wheels leapt, and where the robot is."""
    localiser, poses = begun(house()), way(60)
    drive(localiser, house(), poses)
    there = se2.compose(poses[-1], away)
    odom = se2.compose(se2.compose(wheels(poses)[-1], away), leap)
    localiser.update(scan(house(), there, 60 + PAUSE_SCANS, np.random.default_rng(4)), odom)
    return localiser, there


@pytest.mark.parametrize("leap", [(0.0, 0.0, 0.0), (1.2, 0.4, 0.2), (-1.4, 0.9, -0.4), (0.3, -1.5, 0.5)])
def test_the_map_shows_where_a_robot_is_whose_wheels_leapt_in_a_pause(leap: tuple[float, float, float]) -> None:
    localiser, there = after_pause(np.array(leap))
    off = se2.between(there, localiser.T_map_base)
    assert np.abs(off).max() < 0.1 and not localiser.is_carried
    assert localiser.inliers > 0.9
    assert (np.abs(off) < 4.0 * np.sqrt(np.diag(localiser.covariance))).all()


def test_a_match_farther_off_than_a_robot_can_move_is_looked_for_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    localiser, poses = begun(house()), way(61)
    drive(localiser, house(), poses[:60])
    front, leap = localiser._front, np.array([0.4, -0.3, -1.5])
    real = front.step

    def leaping(*args: Any, **others: Any) -> Step:
        """Take a scan for one from where the wheels leapt to, as aces does where they catch up after a pause."""
        step = real(*args, **others)
        front.T_local_base = se2.compose(front.T_local_base, leap)
        return replace(step, T_before_base=se2.compose(step.T_before_base, leap))

    monkeypatch.setattr(front, "step", leaping)
    localiser.update(scan(house(), poses[60], 60, np.random.default_rng(1)), wheels(poses)[60])
    assert np.abs(se2.between(poses[60], localiser.T_map_base)).max() < 0.15
    assert localiser.inliers > 0.8  # of the match there


def test_what_the_map_shows_counts_however_wrong_wheels_were_before() -> None:
    localiser, poses = begun(house()), way(60)
    drive(localiser, house(), poses)
    localiser._front.predictor.odometry.gains[:] = 0.67, 1.0
    away = np.array([2.4, 0.9, 0.2])
    there, odom = se2.compose(poses[-1], away), se2.compose(wheels(poses)[-1], away)
    for k in range(2):  # the first is left out: its odometry may be old
        localiser.update(scan(house(), there, 60 + PAUSE_SCANS + k, np.random.default_rng(k)), odom)
    assert np.abs(se2.between(there, localiser.T_map_base)).max() < 0.1 and localiser.inliers > 0.9


@pytest.mark.parametrize("is_there", [True, False])
def test_one_whose_wheels_began_again_tracks_on_where_it_stood_and_else_was_carried(is_there: bool) -> None:
    localiser, poses = begun(house()), way(40)
    drive(localiser, house(), poses)
    now = poses[-1] if is_there else np.array([12.0, 1.5, 2.0])
    localiser.update(scan(house(), now, 40 + PAUSE_SCANS, np.random.default_rng(4)), np.zeros(3))
    assert localiser.is_carried != is_there
    if is_there:
        assert np.abs(se2.between(now, localiser.T_map_base)).max() < 0.1


@pytest.mark.parametrize("has_driven", [False, True])
def test_one_that_drove_on_unseen_is_looked_for_farther_off(has_driven: bool) -> None:
    localiser, rng = begun(house()), np.random.default_rng(0)
    told = se2.compose(START, np.array([1.1, 0.6, 0.3]))
    assert localiser.begin(scan(house(), START, 0, rng), None, told, has_driven=has_driven) == has_driven
    if has_driven:
        assert np.abs(se2.between(START, localiser.T_map_base)).max() < 0.1


def test_one_that_drove_on_unseen_does_not_begin_where_another_place_near_by_fits_as_well() -> None:
    rooms, rng, config = house(), np.random.default_rng(0), MapperConfig(threads=1)
    rooms.cells[2:-2, 2:-2] = 0
    rooms.cells[:, ::40] = 100  # of 2 m, side by side
    told = np.array([5.0, 3.0, 0.0])
    seen = scan(rooms, told + np.array([0.9, 0.0, 0.0]), 0, rng)
    assert not Localiser(FixedMap(rooms, config.resolution_m), config).begin(seen, None, told, has_driven=True)
