"""The assessment of each pair of robots: whether their maps were merged, by whom, and how accurately."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.judges import Judgement, PairJudge, judged_row
from mrslam.sim_driver.evaluate.network import exchanges
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.robot_rows import rounded
from mrslam.sim_driver.evaluate.sides import givers_of, placed_together, sides_of, speaker_of
from mrslam.sim_driver.evaluate.truth import MUST_MERGE

Row = dict[str, Any]


def pair_row(run: RunResults, judge: PairJudge, a: str, b: str, not_judged: list[str]) -> Row:
    """Return what every robot believes of the pair, judged; reasons for what is missing go to ``not_judged``."""
    views = _views(run, judge, a, b)
    speaker = speaker_of(views, a, b)
    never = {"status": "never met", "accepted_at_s": None, "reason": ""}
    said = {
        **(_view(never, None) if speaker is None else views[speaker]),
        **sides_of(views, a, b, givers_of(run.beliefs)),
        "placed_together_by": placed_together(run.beliefs, a, b),
    }
    shared = judge.overlap(a, b)
    met = bool(views) or bool(exchanges(run.events[a], b)["done"])
    if said["status"] == "accepted" and said["error_m"] is None:
        not_judged.append(f"{a}-{b}, merge: {said['judged_by']}")
    elif said["status"] != "accepted" and shared is None:
        not_judged.append(f"{a}-{b}, whether it should have merged: the true overlap of the maps is not known")
    verdict = _verdict(said, met, shared, views)
    return {"a": a, "b": b, "verdict": verdict, "true_overlap": rounded(shared), **said, "views": views}


def _views(run: RunResults, judge: PairJudge, a: str, b: str) -> dict[str, Row]:
    """Return each robot's view of the pair, judged."""
    views = {}
    for robot_id, robot in run.beliefs.items():
        for view in robot["pairs"]:
            if (view["a"], view["b"]) == (a, b):
                judged = judge.judge(a, b, np.array(view["T_a_b"])) if view["T_a_b"] else None
                views[robot_id] = _view(view, judged)
    return views


def _view(view: Row, judged: Judgement | str | None) -> Row:
    return {
        "status": "rejected" if view["status"] == "untried" else view["status"],
        "accepted_at_s": view["accepted_at_s"],
        "reason": view["reason"],
        "attempts": view.get("attempts", 0),
        **judged_row(judged),
    }


def _verdict(said: Row, met: bool, shared: float | None, views: dict[str, Row]) -> str:
    if any(view["is_false"] for view in views.values()):
        return "false merge"
    if said["status"] == "accepted":
        if said["both_at_s"] is None:
            return "merged by one only"
        return "merged, not judged" if said["is_false"] is None else "correct merge"
    if shared is not None and shared >= MUST_MERGE:
        return "missed merge" if met else "never met, though the maps overlap"
    return "not merged" if met else "never met"
