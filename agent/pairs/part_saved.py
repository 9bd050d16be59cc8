"""A place in a saved map that shows a part of a building: what was not saved may look the same."""

from __future__ import annotations

from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import MOST_LOOK_ALIKES
from mrslam.agent.pairs.weighing import refused
from mrslam.alignment import Alignment, Rejection

TELL = "unless it is told where the robot begins (near)"


def in_whole(job: AlignJob, outcome: Alignment | Rejection) -> Alignment | Rejection:
    """Return the outcome, refused as ambiguous where the place may as well lie in what was not saved.

    However well the maps agree: equal rooms agree to the last wall. Only what the saved map itself shows tells whether
    the building has more of it.
    """
    if isinstance(outcome, Rejection) or job.part is None or job.part.look_alikes < MOST_LOOK_ALIKES:
        return outcome
    shows = f"the saved map shows {job.part.area_m2:.0f} m2 and ends in the open"
    reason = f"ambiguous: {shows}, so that a place that looks the same may lie in what was not saved, {TELL}"
    return refused(outcome, reason)
