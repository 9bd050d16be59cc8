"""Who of a pair has merged, and how that is said."""

from __future__ import annotations

from typing import Any

from mrslam.sim_driver.evaluate.sides import (
    apart_text,
    givers_of,
    merged_text,
    pairs_of,
    placed_together,
    sides_of,
    speaker_of,
)


def view(at_s: float | None, reason: str = "weak evidence") -> dict[str, Any]:
    return {"status": "rejected" if at_s is None else "accepted", "accepted_at_s": at_s, "reason": reason}


def said(views: dict[str, Any], *placed_by: str) -> str:
    return merged_text({"a": "r1", "b": "r2", **sides_of(views, "r1", "r2"), "placed_together_by": placed_by})


def test_both_have_merged_when_the_second_has() -> None:
    sides = sides_of({"r1": view(26.0), "r2": view(16.0), "r3": view(9.0)}, "r1", "r2")
    assert sides == {"accepted_at_s": 16.0, "both_at_s": 26.0, "accepted_by": ["r2", "r1"], "not_by": {}}
    assert said({"r1": view(26.0), "r2": view(16.0)}) == "r1 and r2 merged after 26 s (r2 after 16 s)"
    assert said({"r1": view(16.2), "r2": view(16.0)}) == "r1 and r2 merged after 16 s"


def test_one_may_have_merged_and_the_other_not() -> None:
    sides = sides_of({"r1": view(None), "r2": view(16.0)}, "r1", "r2")
    assert sides["both_at_s"] is None and sides["not_by"] == {"r1": "weak evidence"}
    assert said({"r1": view(None), "r2": view(16.0)}) == "r2 merged the map of r1 after 16 s, r1 has not: weak evidence"
    assert (
        said({"r1": view(None), "r2": view(16.0)}, "r1", "r2")
        == "r2 merged the map of r1 after 16 s, r1 by way of other robots"
    )
    assert said({"r2": view(16.0)}) == "r2 merged the map of r1 after 16 s, r1 has not"  # r1 was lost


def test_a_third_may_have_merged_two_that_have_not() -> None:
    assert (
        said({"r1": view(None), "r3": view(9.0)})
        == "r3 merged the maps of r1 and r2 after 9 s, they themselves have not"
    )


def test_two_that_are_not_merged_lie_in_one_map_where_third_robots_lead_from_one_to_the_other() -> None:
    placed = {"r1": ["r1", "r2", "r3"], "r2": ["r2", "r3"], "r3": ["r1", "r2", "r3"]}
    robots: dict[str, Any] = {one: {"placed": dict.fromkeys(others)} for one, others in placed.items()}
    robots["lost"] = {"pairs": []}
    assert placed_together(robots, "r1", "r2") == ["r1", "r3"]
    pair = {"a": "r1", "b": "r2", "reason": "too little wall"}
    assert apart_text({**pair, "placed_together_by": []}) == "r1 and r2 were not merged: too little wall"
    text = apart_text({**pair, "placed_together_by": ["r1", "r2", "r3"]})
    assert text == "r1 and r2 share one map by way of others, not by their own two: too little wall"
    text = apart_text({**pair, "placed_together_by": ["r1", "r3"]})
    assert text.startswith("r1 and r3 placed r1 and r2 in one map by way of others")


def test_nobody_has() -> None:
    sides = sides_of({"r1": view(None)}, "r1", "r2")
    assert sides == {
        "accepted_at_s": None, "both_at_s": None, "accepted_by": [], "not_by": {"r1": "weak evidence", "r2": ""}
    }  # fmt: skip


def test_of_a_pair_the_first_that_merged_speaks_then_one_of_the_two_and_a_third_last() -> None:
    assert speaker_of({"r0": view(None), "r1": view(20.0), "r2": view(16.0)}, "r1", "r2") == "r2"
    assert speaker_of({"r0": view(9.0), "r2": view(None)}, "r1", "r2") == "r0"
    assert speaker_of({"r0": view(None), "r2": view(None)}, "r1", "r2") == "r2"
    assert speaker_of({"r0": view(None)}, "r1", "r2") == "r0"
    assert speaker_of({}, "r1", "r2") is None


def test_who_merges_nothing_is_not_waited_for() -> None:
    views = {"r1": view(16.0), "base": view(9.0)}
    sides = sides_of(views, "r1", "r2", givers={"r2"})
    assert (sides["both_at_s"], sides["accepted_by"], sides["not_by"]) == (16.0, ["r1"], {})
    sides = sides_of({"r1": view(None)}, "r1", "r2", givers={"r2"})
    assert sides["both_at_s"] is None and sides["not_by"] == {"r1": "weak evidence"}


def test_a_base_station_merges_for_those_who_do_not() -> None:
    sides = sides_of({"base": view(9.0)}, "r1", "r2", givers={"r1", "r2"})
    assert sides == {"accepted_at_s": 9.0, "both_at_s": 9.0, "accepted_by": ["base"], "not_by": {}}
    assert (
        merged_text({"a": "r1", "b": "r2", **sides, "placed_together_by": []})
        == "base merged the maps of r1 and r2 after 9 s"
    )
    nobody = sides_of({"base": view(None)}, "r1", "r2", givers={"r1", "r2"})
    assert nobody == {"accepted_at_s": None, "both_at_s": None, "accepted_by": [], "not_by": {}}


def test_a_base_station_has_no_map_to_be_merged() -> None:
    robots = {"base": {"mode": "central"}, "r2": {"mode": "mapper"}, "r1": {"mode": "distributed"}}
    assert pairs_of(robots) == [("r1", "r2")]
    assert givers_of(robots) == {"r2"}


def test_moments_that_round_to_nearly_the_same_are_told_as_one() -> None:
    assert said({"r1": view(15.4), "r2": view(15.6)}) == "r1 and r2 merged after 16 s"
    assert said({"r1": view(14.4), "r2": view(15.6)}) == "r1 and r2 merged after 16 s (r1 after 14 s)"
