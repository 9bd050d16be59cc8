"""Who of a pair has merged: each robot decides for itself, and one may know where the other is first."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import combinations
from typing import Any

View = Mapping[str, Any]
"""What one robot believes of a pair: its ``status``, ``accepted_at_s`` and ``reason``, among others."""


def pairs_of(robots: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Return the pairs of robots that map, by each robot's ``robot.json``: a base station has no map to be merged."""
    return list(combinations(sorted(robot for robot, told in robots.items() if told["mode"] != "central"), 2))


def givers_of(robots: Mapping[str, Mapping[str, Any]]) -> set[str]:
    """Return the robots that give their map and merge nothing themselves."""
    return {robot for robot, told in robots.items() if told["mode"] == "mapper"}


def sides_of(views: Mapping[str, View], a: str, b: str, givers: Collection[str] = ()) -> dict[str, Any]:
    """Return who of the pair ``(a, b)`` has merged and when, by each robot's view of it, as JSON values.

    ``accepted_at_s`` : when the first did; ``both_at_s`` : when both had, None where one has not; ``accepted_by`` : who
    has, the first one first (where neither has, a third robot may have); ``not_by`` : who of the two has not, and why.
    ``givers`` merge nothing: where one of the two is, the other counts for both; where both are, a third.
    """
    ends = [robot for robot in (a, b) if robot not in givers]
    merged = {robot: view for robot, view in views.items() if view["status"] == "accepted"}
    own = {robot: view for robot, view in merged.items() if robot in ends}
    by = sorted(own or merged, key=lambda robot: (merged[robot]["accepted_at_s"], robot))
    times = [merged[robot]["accepted_at_s"] for robot in by]
    all_s = times[-1 if ends else 0] if times and len(own) == len(ends) else None
    return {
        "accepted_at_s": times[0] if times else None,
        "both_at_s": all_s,
        "accepted_by": by,
        "not_by": {robot: views[robot]["reason"] if robot in views else "" for robot in ends if robot not in own},
    }


def placed_together(robots: Mapping[str, Mapping[str, Any]], a: str, b: str) -> list[str]:
    """Return whose team map shows both maps of a pair, by ``robot.json``: third robots lead from one to the other."""
    return sorted(robot for robot, told in robots.items() if {a, b} <= told.get("placed", {}).keys())


def shares_one_map(pair: Mapping[str, Any]) -> bool:
    """Return whether both robots of a pair have each other in their team maps."""
    return {pair["a"], pair["b"]} <= set(pair["placed_together_by"])


def speaker_of(views: Mapping[str, View], a: str, b: str) -> str | None:
    """Return whose view of the pair counts: who merged first, else one of the two, else a third; None without views."""
    others = sorted(views, key=lambda robot: (robot not in (a, b), robot))
    return next(iter((*sides_of(views, a, b)["accepted_by"], *others)), None)


def merged_text(pair: Mapping[str, Any]) -> str:
    """Return who has merged and when, for a person: "r1 and r2 merged after 26 s (r2 after 16 s)"."""
    a, b = pair["a"], pair["b"]
    first, since = pair["accepted_by"][0], when_text(pair)
    if pair["both_at_s"] is not None:
        if first in (a, b):
            return f"{a} and {b} merged {since}"
        return f"{first} merged the maps of {a} and {b} {since}"
    if first not in (a, b):
        return f"{first} merged the maps of {a} and {b} {since}, they themselves have not"
    other = b if first == a else a
    if other in pair["placed_together_by"]:
        return f"{first} merged the map of {other} {since}, {other} by way of other robots"
    reason = pair["not_by"][other]
    return f"{first} merged the map of {other} {since}, {other} has not{f': {reason}' if reason else ''}"


def apart_text(pair: Mapping[str, Any]) -> str:
    """Return why a pair's maps were not merged, for a person; where other robots lead from one to the other, that."""
    a, b, by = pair["a"], pair["b"], pair["placed_together_by"]
    if not by:
        return f"{a} and {b} were not merged: {pair['reason']}"
    if shares_one_map(pair):
        return f"{a} and {b} share one map by way of others, not by their own two: {pair['reason']}"
    return f"{' and '.join(by)} placed {a} and {b} in one map by way of others, not by their own two: {pair['reason']}"


def when_text(pair: Mapping[str, Any]) -> str:
    """Return since when a pair is merged: "after 26 s (r2 after 16 s)"."""
    first_s, both_s = pair["accepted_at_s"], pair["both_at_s"]
    if both_s is None:
        return f"after {first_s:.0f} s"
    apart = both_s - first_s >= 1.0 and round(first_s) < round(both_s)
    return f"after {both_s:.0f} s" + (f" ({pair['accepted_by'][0]} after {first_s:.0f} s)" if apart else "")
