"""What a sweep teaches: runs summed up over seeds, what nothing beats, and the sentence with the setting to take."""

from __future__ import annotations

from typing import Any

import pytest

from mrslam.sim_driver.sweep import parse_knob
from mrslam.sim_driver.sweep.advice import Summary, advice, mean_merge_s, merge_s, pareto, recommend, summarise

KNOB = parse_knob("comms.a=1,2")
NEVER = float("inf")


def row(merge_s: float | None, **more: Any) -> dict[str, Any]:
    """One run of setting 1 that merged right at this time, or never."""
    known = {"first_merge_s": merge_s, "first_correct_merge_s": merge_s, "mission_s": 100.0, "error_m": None}
    counts = {"bytes_exchanged": 2000.0, "false_merges": 0, "missed_merges": 0, "wrong_on_the_way": 0}
    return {"comms.a": "1", "coverage_best": 0.9, "coverage_worst": 0.4, **known, **counts, **more}


def one(name: str, merge_s: float, kilobytes: float, false: int = 0, missed: int = 0, seeds: int = 5) -> Summary:
    return Summary((name,), seeds, merge_s, kilobytes, false, missed, 0.9, 0.05)


def test_runs_of_one_setting_are_summed_up() -> None:
    rows = [
        row(10.0, error_m=0.1, false_merges=1, coverage_worst=0.2),
        row(20.0, error_m=0.3, missed_merges=2, bytes_exchanged=9000.0, coverage_worst=None),
        row(None, false_merges=2, bytes_exchanged=3000.0, coverage_worst=0.6),
        row(8.0, **{"comms.a": "2"}),
    ]
    first, second = summarise(rows, (KNOB,))
    assert (first.settings, first.seeds, first.kilobytes, first.false_merges, first.missed_merges) == (
        ("1",),
        3,
        3.0,
        3,
        2,
    )
    assert first.merge_s == pytest.approx(130.0 / 3)  # a run without a merge counts with its length
    assert (first.coverage, first.error_m) == (0.2, pytest.approx(0.2))
    assert (second.settings, second.merge_s, second.error_m) == (("2",), 8.0, None)
    assert mean_merge_s([row(None), row(None)]) == NEVER


@pytest.mark.parametrize(
    ("change", "is_judged", "expected_s"),
    [
        ({"first_merge_s": 5.0, "first_correct_merge_s": 9.0}, True, 9.0),
        ({"first_merge_s": 5.0, "first_correct_merge_s": None}, False, 5.0),  # nothing judged it
        ({"first_merge_s": 5.0, "first_correct_merge_s": None, "false_merges": 1}, True, NEVER),
        ({"first_merge_s": 5.0, "first_correct_merge_s": None, "wrong_on_the_way": 1}, True, NEVER),
        ({"first_merge_s": None, "first_correct_merge_s": None}, True, NEVER),
    ],
)
def test_only_right_merges_count_where_merges_were_judged(
    change: dict[str, Any], is_judged: bool, expected_s: float
) -> None:
    run = row(1.0) | change
    assert merge_s(run) == expected_s
    assert summarise([run], (KNOB,))[0].is_judged is is_judged


def test_what_never_merged_is_beaten_by_all() -> None:
    assert [s.settings[0] for s in pareto([one("a", 10.0, 100.0), one("never", NEVER, 1.0)])] == ["a"]
    assert pareto([one("never", NEVER, 1.0)]) == [] and recommend([one("never", NEVER, 1.0)]) is None


def test_a_setting_counts_as_fast_within_two_seconds_or_a_tenth() -> None:
    for fastest_s, nearly_s, is_taken in (
        (3.0, 4.9, True),
        (3.0, 5.1, False),
        (100.0, 109.0, True),
        (100.0, 111.0, False),
    ):
        best = recommend([one("fast", fastest_s, 100.0), one("nearly", nearly_s, 40.0)])
        assert best is not None and (best.settings == ("nearly",)) is is_taken, (fastest_s, nearly_s)


def test_false_merges_weigh_most_then_missed_ones() -> None:
    best = recommend([one("wrong", 1.0, 1.0, 1), one("misses", 1.0, 1.0, 0, 2), one("good", 50.0, 90.0)])
    assert best is not None and best.settings == ("good",)
    best = recommend([one("worse", 1.0, 1.0, 0, 3), one("misses", 40.0, 80.0, 0, 2)])
    assert best is not None and best.settings == ("misses",)


def test_the_sentence_says_what_was_wrong_and_what_it_costs() -> None:
    some = [one("1", 5.0, 40.0, 3, 1, seeds=1), one("2", 2.0, 90.0, 4, 0)]
    assert advice(some, (KNOB,)) == (
        "Take comms.a=1: in 1 run 3 false merge(s) and 1 missed, the first right merge after 5 s (mean), as fast as "
        "any, with 40 kB exchanged where the dearest setting takes 90 kB."
    )
    some = [one("1", 60.0, 40.0), one("2", 58.0, 41.0)]
    assert advice(some, (KNOB,)) == (
        "Take comms.a=1: in 5 runs no false merge, the first right merge after 60 s (mean), 2 s later than the fastest "
        "setting."
    )
