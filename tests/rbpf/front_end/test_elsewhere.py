"""A robot that is carried off while its laser is on, and what only looks as if it were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import Mapper, MapperConfig, load_checkpoint, save_checkpoint
from mrslam.rbpf.front_end.elsewhere import TORN, TORN_LEAPT, Elsewhere, View
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.health import LOST
from mrslam.rbpf.front_end.prediction import Guess, can_move, has_leapt
from mrslam.rbpf.front_end.rolling_map import RollingMap
from mrslam.rbpf.front_end.visibility import contradicted
from mrslam.spatial import Scan, se2
from mrslam.spatial.files.state_file import pack
from mrslam.spatial.matching.gauss_newton import Match
from tests.rbpf.rooms import drive, make_scan, seen_room

WAY = drive(200)


def scans_of(poses: NDArray[np.float64], first: int) -> list[Scan]:
    """Scans from these poses, ten a second, the first one numbered ``first``."""
    rng = np.random.default_rng(first)
    return [make_scan(pose, (first + k) * 10**8, fov=2 * np.pi, rng=rng) for k, pose in enumerate(poses)]


def played(mapper: Mapper, scans: list[Scan], odometry: NDArray[np.float64]) -> list[float]:
    """Feed scans; return the health after each."""
    return [mapper.update(scan, told).health for scan, told in zip(scans, odometry, strict=True)]


def begun() -> Mapper:
    mapper = Mapper(MapperConfig(particles=1, threads=1), seed=1)
    assert min(played(mapper, scans_of(WAY[:190], 0), WAY[:190])) > 0.5
    return mapper


def wheels(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Odometry that knows nothing of a leap from where the drive ended to the first of these poses."""
    return se2.compose(WAY[189], se2.between(poses[0], poses))


def test_a_robot_carried_off_between_two_scans_notices_within_seconds_and_is_found() -> None:
    mapper, after = begun(), np.concatenate([WAY[90:], WAY, WAY[:120]])
    health = played(mapper, scans_of(after, 190), wheels(after))
    noticed = next(k for k, value in enumerate(health) if value <= LOST)
    assert noticed <= 20  # scans: two seconds
    assert max(health[noticed : noticed + 30]) <= LOST and health[-1] > 0.5
    assert np.abs(se2.between(after[-1], mapper.T_map_base)).max() < 0.1


@pytest.mark.parametrize("scans", [1, 4])
def test_rubbish_before_the_laser_is_no_other_place(scans: int) -> None:
    mapper, after = begun(), WAY[189:]
    seen = scans_of(after, 190)
    for k in range(scans):  # a crowd close by all round the robot, with gaps
        near_m = np.float32(0.8 + 0.5 * np.sin(7.0 * seen[k].angles_rad + k))
        seen[k] = replace(seen[k], ranges_m=np.minimum(seen[k].ranges_m, near_m).astype(np.float32))
    health = played(mapper, seen + scans_of(WAY[:60], 250), np.concatenate([after, WAY[:60]]))
    assert min(health) > LOST


def test_a_robot_whose_scans_fit_what_it_saw_before_was_not_carried_however_well_they_fit_each_other() -> None:
    config, (_, points) = MapperConfig(particles=1, threads=1), seen_room()
    before, stands = RollingMap(config), Guess(np.zeros(3), 0.02, 0.02, 0.03)
    before.tiles_around(np.zeros(3))
    before.add(np.zeros(3), points)
    accounts = Elsewhere(config, -0.2)
    accounts.begin(before, np.zeros(3), points)
    assert [accounts.follow(points, points, stands, 0.1) for _ in range(5)] == [None] * 4 + [False]


def test_a_checkpoint_while_the_robot_doubts_where_it_was_put_continues_the_same(tmp_path: Path) -> None:
    after, states = WAY[90:], []
    seen, told = scans_of(after, 190), wheels(after)
    for saved in (False, True):
        mapper = begun()
        played(mapper, seen[:3], told[:3])
        assert mapper.state()["front"]["elsewhere"] is not None
        if saved:
            save_checkpoint(mapper, tmp_path / "doubts.ckpt")
            mapper = load_checkpoint(tmp_path / "doubts.ckpt")
        played(mapper, seen[3:40], told[3:40])
        states.append(pack(mapper.state()))
    assert states[0] == states[1]


def test_scans_of_one_place_contradict_each_other_nowhere_and_of_two_places_they_do() -> None:
    _, here = seen_room()
    still, zero = np.zeros(3), np.zeros(2)
    assert contradicted(here, here, still, zero) == 0.0
    assert contradicted(here, here, np.array([0.0, 0.0, 0.7]), zero) > 0.3
    nearer = here.copy()
    nearer[:90, :2] *= 0.5  # a quarter of the beams, stopped on their way
    assert contradicted(nearer, here, still, zero) == pytest.approx(0.25, abs=0.03)
    assert contradicted(here, nearer, still, zero) == pytest.approx(0.25, abs=0.03)
    assert contradicted(here, here[:0], still, zero) == 0.0


def test_what_a_robot_can_move_grows_with_time() -> None:
    leap = np.array([1.0, 0.0, 0.0])
    assert not can_move(leap, 0.1) and can_move(leap, 0.5)
    turn = np.array([0.0, 0.0, -1.2])
    assert not can_move(turn, 0.1) and can_move(turn, 0.2) and not can_move(turn, -5.0)


def test_a_leap_is_far_from_what_was_predicted() -> None:
    driven = np.array([0.1, 0.0, 0.0])
    assert not has_leapt(driven, np.array([0.3, 0.0, 0.2])) and has_leapt(driven, np.array([0.5, 0.0, 0.0]))
    assert has_leapt(driven, np.array([0.3, 0.0, 0.28]))  # both together
    assert has_leapt(driven, np.array([0.1, 0.0, 0.4])) and not has_leapt(
        np.array([0.1, 0, 3.1]), np.array([0.1, 0, -3.1])
    )


def test_a_robot_that_stands_leaps_sooner_and_one_that_turns_on_the_spot_in_position() -> None:
    at_rest, turning, aside, round_ = (np.array(motion) for motion in (
        (0.0, 0.0, 0.0), (0.001, 0.0, 0.07), (0.2, 0.0, 0.0), (0.0, 0.0, -0.2)
    ))  # fmt: skip
    for motion in (aside, round_):
        assert has_leapt(at_rest, motion) and not has_leapt(at_rest, 0.5 * motion)
    assert has_leapt(turning, turning + aside) and not has_leapt(turning, turning + 0.5 * aside)
    assert not has_leapt(turning, turning + round_)


@pytest.mark.parametrize(("told_m", "doubts"), [(0.0, True), (0.02, False)])
def test_a_robot_that_stands_doubts_a_smaller_leap_than_one_that_drives(
    monkeypatch: pytest.MonkeyPatch, told_m: float, doubts: bool
) -> None:
    _, points = seen_room()
    front, zero = FrontEnd(MapperConfig()), np.zeros(2)
    front.step(points, points, None, 0.1, zero)
    leap = np.array([0.23, 0.0, 0.0])  # 0.21 m from what is told at most
    fit = Match(leap, -1.0, 0.5, 0.3, np.eye(3), 0.0, np.array([1.0, 0.0]))
    guess = Guess(np.array([told_m, 0.0, 0.0]), 0.02, 0.02, 0.03)
    monkeypatch.setattr(FrontEnd, "_best_of_guesses", lambda *_, **__: (guess, fit))
    monkeypatch.setattr(View, "contradiction", lambda *_: 0.5 * (TORN + TORN_LEAPT))
    front.step(points, points, guess.motion, 0.1, zero)
    assert (front.state()["elsewhere"] is not None) == doubts
