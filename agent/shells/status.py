"""A robot's status, sent once a second to those who watch (``mrslam top``)."""

from __future__ import annotations

from mrslam.agent.core import Agent
from mrslam.agent.pairs.belief import PairBelief
from mrslam.comms import Send, status_report


def status_of(agent: Agent, now_ns: int) -> Send:
    """Return the status message of an agent: links and maps, and how the maps fit together in words."""
    pairs = [(a, b, _words(belief)) for (a, b), belief in sorted(agent.team.beliefs.items())]
    return status_report(agent.node, now_ns, pairs)


def _words(belief: PairBelief) -> str:
    if belief.alignment is not None:
        return f"merged, confidence {belief.alignment.confidence:.2f}"
    return belief.reason if belief.status == "untried" else f"not merged: {belief.words}"
