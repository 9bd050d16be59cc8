"""How a robot fares, told once a second to whoever watches (``mrslam top``)."""

from __future__ import annotations

from mrslam.agent.core import Agent
from mrslam.agent.pairs import PairStatus
from mrslam.comms import Send, status_report


def status_of(agent: Agent, now_ns: int) -> Send:
    """Return the status message of an agent: links and maps, and how the maps fit together in words."""
    pairs = [(a, b, _words(status)) for (a, b), status in sorted(agent.team.pairs.pairs.items())]
    return status_report(agent.node, now_ns, pairs)


def _words(pair: PairStatus) -> str:
    if pair.alignment is not None:
        return f"merged, confidence {pair.alignment.confidence:.2f}"
    return pair.reason if pair.status == "untried" else f"not merged: {pair.reason}"
