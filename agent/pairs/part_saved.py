"""A place searched for in a saved map, judged by how much of the building that shows.

What was not saved of it may look the same as what was. Where all was saved the robot is in it, and what differs tells
places apart that fit nearly alike.
"""

from __future__ import annotations

from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import MOST_LOOK_ALIKES, KnownMap
from mrslam.agent.pairs.weighing import refused
from mrslam.alignment import Alignment, AlignmentConfig, Rejection
from mrslam.alignment.verification.apart import told_apart

TELL = "unless it is told where the robot begins (near)"


def in_whole(job: AlignJob, outcome: Alignment | Rejection, config: AlignmentConfig) -> Alignment | Rejection:
    """Return the outcome as what the saved map shows of the building leaves it."""
    if job.searched is None:
        return outcome
    if isinstance(outcome, Alignment):
        return outcome if job.is_believed else _unless_beyond(job.searched, outcome)
    if outcome.rivals and job.searched.is_whole:
        return told_apart(job.grid_a, job.grid_b, outcome, config) or outcome
    return outcome


def _unless_beyond(saved: KnownMap, outcome: Alignment) -> Alignment | Rejection:
    """Return an alignment, refused as ambiguous where the place may as well lie in what was not saved.

    However well the maps agree: equal rooms agree to the last wall. Only what the saved map itself shows tells whether
    the building has more of it.
    """
    if saved.look_alikes < MOST_LOOK_ALIKES:
        return outcome
    shows = f"the saved map shows {saved.area_m2:.0f} m2 and ends in the open"
    reason = f"ambiguous: {shows}, so that a place that looks the same may lie in what was not saved, {TELL}"
    return refused(outcome, reason)
