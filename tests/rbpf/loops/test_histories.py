"""What a history is asked as the robot drives on, what it is weighed by, and what ends it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.loops.drift import Drift
from mrslam.rbpf.loops.far_search import (
    ASKED_MOST,
    BEGUN_MOST,
    CARRIED_EVERY_M,
    EVERY_M,
    LEAD,
    NEAR_M,
    QUIET_MOST_M,
    FarSearch,
)
from mrslam.rbpf.loops.guesses import DISAGREE_MOST, NEW, Fit, Guess
from mrslam.rbpf.loops.stretch_search import LOOKS_UNKNOWN, POINTS_LEAST, SHARE_LEAST, STRETCH, places_of
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.matching.global_search import LOOKS_MOST, Search, Spot

EVIDENCE = 10.0
THERE, ELSEWHERE = np.zeros(3), np.array([2.0, 0.0, 0.0])


def match(pose: NDArray[np.float64] = THERE, inliers: float = 0.9, blind: float = 0.0) -> Match:
    return Match(pose, NEW + 0.1, inliers, 0.0, np.eye(3), blind, np.array([1.0, 0.0]))


class Asked:
    """Answers every question the same, and notes which keyframe it was about."""

    def __init__(self, answer: Match) -> None:
        self.answer, self.about = answer, list[int]()

    def __call__(
        self, T_map_key: NDArray[np.float64], old: int, T_old_new: NDArray[np.float64], lost_m: float
    ) -> Match:
        self.about.append(len(T_map_key) - 1)
        return self.answer


def searching(answer: Match, way_m: float, keys: int = 2) -> tuple[FarSearch, Asked]:
    """A search whose newest keyframe is ``way_m`` after the first; all stand where the first does."""
    asked = Asked(answer)
    scans = SimpleNamespace(way_m=np.linspace(0.0, way_m, keys), points=range(keys))
    return FarSearch(scans, asked, EVIDENCE, 4), asked  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("answer", "fits", "disagreed", "agrees"),
    [
        (match(), 2, 0, True),
        (match(ELSEWHERE), 1, 1, False),
        (match(inliers=0.1), 1, 1, False),
        (match(blind=0.5), 1, 0, True),  # along a corridor nothing is said
        (match(inliers=0.1, blind=0.5), 1, 0, False),
        (match(inliers=0.6, blind=0.5)._replace(conflicts=0.3), 1, 1, False),  # but it is another corridor
    ],
)
def test_a_stretch_that_fits_where_it_is_expected_speaks_for_a_history_and_any_other_against_it(
    answer: Match, fits: int, disagreed: int, agrees: bool
) -> None:
    far, _ = searching(answer, 2.0)
    guess = Guess([Fit(0, 0, match())])
    far._follow(guess, np.zeros((2, 3)), np.array([0]))
    assert (len(guess.fits), guess.disagreed, guess.agrees) == (fits, disagreed, agrees)
    assert guess.log_weight == pytest.approx(EVIDENCE * 0.1)


def test_a_history_has_the_robot_where_its_newest_stretch_fits() -> None:
    found = np.array([0.2, -0.1, 0.02])
    far, _ = searching(match(found), 2.0)
    guess = Guess([Fit(0, 0, match())])
    far._follow(guess, np.zeros((2, 3)), np.array([0]))
    assert guess.T_map_newest == pytest.approx(found)


def test_where_nothing_old_is_near_nothing_is_said_of_a_history() -> None:
    far, asked = searching(match(ELSEWHERE), 2.0)
    guess = Guess([Fit(0, 0, match())])
    T_map_key = np.array([[0.0, 0.0, 0.0], [NEAR_M + 0.5, 0.0, 0.0]])
    far._follow(guess, T_map_key, np.array([0]))
    assert (len(guess.fits), guess.disagreed, guess.log_weight, asked.about) == (1, 0, 0.0, [])
    assert not guess.agrees


@pytest.mark.parametrize(("way_m", "is_over"), [(QUIET_MOST_M - 1.0, False), (QUIET_MOST_M + 1.0, True)])
def test_a_history_that_nothing_spoke_for_on_a_long_way_is_given_up(way_m: float, is_over: bool) -> None:
    far, _ = searching(match(blind=0.5), way_m)
    guess = Guess([Fit(0, 0, match()) for _ in range(9)])
    far._follow(guess, np.zeros((2, 3)), np.array([0]))
    assert guess.is_refuted == is_over


def test_a_history_that_is_contradicted_a_few_times_is_given_up() -> None:
    far, _ = searching(match(ELSEWHERE), 2.0)
    guess = Guess([Fit(0, 0, match())])
    for _ in range(DISAGREE_MOST + 1):
        assert not guess.is_refuted
        far._follow(guess, np.zeros((2, 3)), np.array([0]))
    assert guess.is_refuted


@pytest.mark.parametrize(("is_carried", "every_m"), [(False, EVERY_M), (True, CARRIED_EVERY_M)])
def test_a_robot_that_was_carried_asks_sooner_where_it_is(is_carried: bool, every_m: float) -> None:
    for way_m, is_due in ((every_m - 0.1, False), (every_m + 0.1, True)):
        assert searching(match(), way_m)[0].is_due(is_carried) == is_due


def test_a_new_history_is_weighed_by_what_the_others_were_asked_before() -> None:
    keys = 6
    far, asked = searching(match(), 5.0, keys)
    far._asked = list(range(keys))
    new = Guess([Fit(0, keys - 1, match())], log_weight=EVIDENCE * 0.1)
    far._explain_before(new, np.zeros((keys, 3)), np.arange(keys))
    assert asked.about == [4, 3, 2, 1, 0]  # all but the newest, which it began with
    assert new.log_weight == pytest.approx(keys * EVIDENCE * 0.1)


def test_what_was_asked_is_remembered_within_a_bound_and_by_a_resumed_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FarSearch, "_guess", lambda *_: None)
    monkeypatch.setattr(FarSearch, "_believed", lambda *_: [])
    keys = 3 * ASKED_MOST
    far, _ = searching(match(), 10.0, keys)
    far.guesses = [Guess([Fit(0, 0, match())])]
    drift = SimpleNamespace(is_unknown=True)
    for count in range(1, keys):
        far.look(np.zeros((count, 3)), np.array([0]), drift)  # type: ignore[arg-type]
    assert far._asked == list(range(keys - ASKED_MOST - 2, keys - 1))
    resumed, _ = searching(match(), 10.0, keys)
    resumed.restore(far.state())
    assert resumed.state()[:3] == far.state()[:3] and len(resumed.guesses) == len(far.guesses) == 1


@pytest.mark.parametrize(("histories", "turn_rad", "most"), [(30, np.pi, BEGUN_MOST), (4, np.pi, 3), (30, 0.3, 1)])
def test_a_history_begins_at_each_place_that_fits_as_many_as_may_be(
    monkeypatch: pytest.MonkeyPatch, histories: int, turn_rad: float, most: int
) -> None:
    asked = []

    def search(*args: Any, most: int, **_: object) -> Search:
        asked.append((most, len(args[5])))
        return Search([Spot(THERE, 0.9 - 0.01 * k) for k in range(most)], True)

    monkeypatch.setattr("mrslam.rbpf.loops.far_search.places_of", search)
    far, _ = searching(match(), 10.0)
    far.most, far.guesses = histories, [Guess([Fit(0, 1, match())], T_map_newest=ELSEWHERE)]
    far._guess(np.zeros((2, 3)), np.array([0]), Drift(10.0, turn_rad))
    assert asked == [(most, 1)] and len(far.guesses) == 1 + most


@pytest.mark.parametrize(("turn_rad", "looks_most"), [(np.pi, LOOKS_UNKNOWN), (0.3, LOOKS_MOST)])
def test_places_are_looked_for_that_fit_well_enough_and_not_at_those_followed(
    monkeypatch: pytest.MonkeyPatch, turn_rad: float, looks_most: int
) -> None:
    asked: list[Any] = []

    def find(*args: Any) -> Search:
        asked.append(args[3:])
        return Search([], True)

    monkeypatch.setattr("mrslam.rbpf.loops.stretch_search.find", find)
    monkeypatch.setattr("mrslam.rbpf.loops.stretch_search._walls", lambda *_: "walls")
    far, _ = searching(match(), 10.0)
    far._scans.connected = lambda *_: range(2)  # type: ignore[method-assign]
    far._scans.joined = lambda *_: np.ones((POINTS_LEAST, 5))  # type: ignore[method-assign]
    known = [ELSEWHERE]
    drift = Drift(10.0, turn_rad)
    assert not places_of(far._scans, np.zeros((2, 3)), np.array([0]), drift, STRETCH, known, most=3).spots
    assert asked == [(10.0, turn_rad, SHARE_LEAST, known, looks_most, 3)]


@pytest.mark.parametrize(
    ("histories", "turn_rad", "others", "is_complete", "lead", "is_ambiguous"),
    [
        (30, np.pi, 2, True, LEAD + 0.1, False),
        (30, np.pi, 2, True, LEAD - 0.1, True),  # what was asked does not tell them apart
        (30, np.pi, 0, True, 0.0, False),
        (30, np.pi, 0, False, 0.0, True),  # there may be other places
        (30, 0.3, 0, False, 0.0, False),
        (30, np.pi, BEGUN_MOST, True, 99.0, True),  # and more, of which nothing is known
        (30, 0.3, 1, True, 99.0, True),  # of a robot that is not lost one place is looked for
        (1, np.pi, 1, True, 99.0, True),  # no second history may be followed
    ],
)
def test_a_place_is_ambiguous_where_another_one_explains_what_was_asked_about_as_well(
    monkeypatch: pytest.MonkeyPatch,
    histories: int,
    turn_rad: float,
    others: int,
    is_complete: bool,
    lead: float,
    is_ambiguous: bool,
) -> None:
    def search(*args: Any, most: int = 1, **_: object) -> Search:
        spots = [Spot(np.array([5.0 + k, 0.0, 0.0]), 0.8) for k in range(min(others, most))]
        return Search(spots if args[5] else [Spot(THERE, 0.8)], is_complete)

    def seen_then(_: object, T_map_newest: NDArray[np.float64], *__: object) -> Match:
        score = -0.1 if T_map_newest[0] < 1.0 else -0.1 - lead / (3 * EVIDENCE)
        return match()._replace(score=score)

    monkeypatch.setattr("mrslam.rbpf.loops.far_search.places_of", search)
    monkeypatch.setattr(FarSearch, "_seen_then", seen_then)
    keys = 4
    far, _ = searching(match(), 6.0, keys)
    far.most, far._asked = histories, [1, 2, 3, 99]  # the last one's scan is not kept
    guess = Guess([Fit(0, k, match()) for k in range(keys)], T_map_newest=THERE)
    assert far._is_ambiguous(guess, np.zeros((keys, 3)), np.array([0]), Drift(10.0, turn_rad)) == is_ambiguous


def test_a_new_history_is_not_weighed_by_scans_that_were_forgotten() -> None:
    keys = 6
    far, asked = searching(match(), 5.0, keys)
    far._asked, far._scans.points = list(range(keys)), range(3, keys)  # type: ignore[assignment]
    far._explain_before(Guess([Fit(0, keys - 1, match())], log_weight=0.0), np.zeros((keys, 3)), np.arange(keys))
    assert asked.about == [4, 3]
