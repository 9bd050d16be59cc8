"""What a sweep teaches: settings summed up over seeds, those nothing else beats, and the one to take."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import mean, median
from typing import Any

from mrslam.sim_driver.sweep.plan import Knob
from mrslam.sim_driver.sweep.table import Rows

NEARLY = 1.10
"""A setting that merges within this factor of the fastest counts as fast as it."""
NEARLY_S = 2.0
"""... or within so many seconds."""


@dataclass(frozen=True)
class Summary:
    """One setting over all its seeds."""

    settings: tuple[str, ...]
    seeds: int
    merge_s: float
    """Mean time to the first correct merge; a run without one counts with its length, inf where none had one."""
    kilobytes: float
    """Median bytes exchanged, thousands."""
    false_merges: int
    missed_merges: int
    coverage: float
    """Median share of the world in the team map of the robot that knows least; 0 where it is not known."""
    error_m: float | None
    """Median error of accepted merges."""
    is_judged: bool = True
    """Whether merges were judged right or wrong, wherever there was one."""


def summarise(rows: Rows, knobs: tuple[Knob, ...]) -> list[Summary]:
    """Return every setting's summary, in the order of the table."""
    groups: dict[tuple[str, ...], Rows] = {}
    for row in rows:
        groups.setdefault(tuple(str(row[knob.key]) for knob in knobs), []).append(row)
    return [
        Summary(
            settings=settings,
            seeds=len(group),
            merge_s=mean_merge_s(group),
            kilobytes=median(row["bytes_exchanged"] for row in group) / 1e3,
            false_merges=sum(row["false_merges"] for row in group),
            missed_merges=sum(row["missed_merges"] for row in group),
            coverage=median(row["coverage_worst"] or 0.0 for row in group),
            error_m=median(errors) if (errors := [r["error_m"] for r in group if r["error_m"] is not None]) else None,
            is_judged=all(_is_judged(row) for row in group),
        )
        for settings, group in groups.items()
    ]


def _is_judged(row: dict[str, Any]) -> bool:
    """Return whether this run's merges were judged right or wrong, or there were none."""
    wrong = row["false_merges"] > 0 or row["wrong_on_the_way"] > 0
    return wrong or row["first_merge_s"] is None or row["first_correct_merge_s"] is not None


def merge_s(row: dict[str, Any]) -> float:
    """Return a run's time to the first correct merge (where nothing judges it: to the first), inf for none."""
    first = row["first_correct_merge_s" if _is_judged(row) else "first_merge_s"]
    return float("inf") if first is None else float(first)


def mean_merge_s(rows: Rows) -> float:
    """Return the mean time to the first correct merge: a mean, so that one seed that waits long is not overlooked."""
    times = [merge_s(row) for row in rows]
    if all(time == float("inf") for time in times):
        return float("inf")
    return mean(row["mission_s"] if time == float("inf") else time for time, row in zip(times, rows, strict=True))


def pareto(summaries: list[Summary]) -> list[Summary]:
    """Return the settings that no other beats in both bytes and time to merge, cheapest first."""
    front = [
        one
        for one in summaries
        if one.merge_s != float("inf")
        and not any(
            other.kilobytes <= one.kilobytes
            and other.merge_s <= one.merge_s
            and (other.kilobytes, other.merge_s) != (one.kilobytes, one.merge_s)
            for other in summaries
        )
    ]
    return sorted(front, key=lambda one: (one.kilobytes, one.merge_s))


def recommend(summaries: list[Summary]) -> Summary | None:
    """Return the setting to take: fewest false merges, then fewest missed; nearly the fastest; then the cheapest."""
    fewest = min((one.false_merges for one in summaries), default=0)
    safe = [one for one in summaries if one.false_merges == fewest]
    fewest = min((one.missed_merges for one in safe), default=0)
    safe = [one for one in safe if one.missed_merges == fewest and one.merge_s != float("inf")]
    if not safe:
        return None
    fastest = min(one.merge_s for one in safe)
    quick = [one for one in safe if one.merge_s <= max(fastest * NEARLY, fastest + NEARLY_S)]
    return min(quick, key=lambda one: (one.kilobytes, one.merge_s))


def advice(summaries: list[Summary], knobs: tuple[Knob, ...]) -> str:
    """Return the recommendation in one plain sentence, with its reason."""
    best = recommend(summaries)
    if best is None:
        return "No setting merged any maps: look at why alignments were rejected (mrslam report)."
    setting = " and ".join(f"{knob.key}={value}" for knob, value in zip(knobs, best.settings, strict=True))
    safe = [one for one in summaries if one.merge_s != float("inf") and one.false_merges == best.false_merges]
    fastest = min(safe, key=lambda one: (one.merge_s, one.kilobytes))
    dearest = max(summaries, key=lambda one: one.kilobytes)
    runs = f"{best.seeds} run" + ("s" if best.seeds != 1 else "")
    false = "no false merge" if best.false_merges == 0 else f"{best.false_merges} false merge(s)"
    missed = "" if best.missed_merges == 0 else f" and {best.missed_merges} missed"
    merged = f"{false}{missed}, the first right merge" if best.is_judged else "the first merge"
    text = f"Take {setting}: in {runs} {merged} after {best.merge_s:.0f} s (mean)"
    if best.merge_s - fastest.merge_s >= 0.5:
        text += f", {best.merge_s - fastest.merge_s:.0f} s later than the fastest setting"
    else:
        text += ", as fast as any"
    if dearest.kilobytes > 1.05 * best.kilobytes:
        text += f", with {best.kilobytes:.0f} kB exchanged where the dearest setting takes {dearest.kilobytes:.0f} kB"
    unknown = "" if best.is_judged else " Whether merges were right is not known: the mission has no truth."
    return f"{text}.{unknown}"
