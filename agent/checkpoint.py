"""A robot on disk: its mapper, all maps it knows, all alignments it believes. After a crash it goes on from there."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.agent.core import Agent
from mrslam.agent.link_stats import LinkStats
from mrslam.agent.pairs import PairStatus
from mrslam.alignment import Alignment, Evidence
from mrslam.comms import restore_store, store_state
from mrslam.rbpf import Mapper
from mrslam.spatial import InputError
from mrslam.spatial.files.state_file import MISFIT, Packed, pack, read_state, write_state

KIND = "mrslam-agent"
VERSION = 2
FREE = ("threads",)
"""Mapper settings that change no result."""
REVISIONS_LOST = 1000
"""More map revisions than a robot publishes between two checkpoints; a resumed one skips as many, so that no revision
ever stands for two contents."""


def freeze(agent: Agent) -> Packed:
    """Copy the robot's state as it is now; milliseconds, so that the copy can be written elsewhere."""
    return pack(
        {
            "robot": agent.robot_id,
            "mode": agent.mode,
            "rbpf": asdict(agent.settings.rbpf),
            "mapper": agent.mapper.state(),
            "store": store_state(agent.node.store),
            "frame": agent.team.frame,
            "pairs": [[a, b, _pair_state(status)] for (a, b), status in sorted(agent.team.pairs.pairs.items())],
            "links": {peer: vars(stats) for peer, stats in agent.links.items()},
            "masked_beams": agent.masked_beams,
            "map_number": agent.map_number,
            "self_doubt": agent.self_doubt.state(),
        }
    )


def write(frozen: Packed, path: Path) -> None:
    """Write the copy; what was at ``path`` stays until the new file is complete."""
    write_state(path, KIND, VERSION, frozen)


def restore(agent: Agent, path: Path) -> None:
    """Let a robot that has just been made go on as the one that was saved, or leave it as it is where that fails.

    Its map keeps its frame and epoch, so that alignments with teammates stay true. Raises ``InputError`` where the file
    is damaged, is another robot's, or was made with other mapper settings.
    """
    state = read_state(path, KIND, VERSION)
    if not isinstance(state, dict) or not isinstance(state.get("rbpf"), dict):
        raise InputError(f"{path}: the checkpoint does not fit this program (it holds no settings)")
    if state.get("robot") != agent.robot_id:
        raise InputError(f"{path}: the checkpoint of {state.get('robot')!r}, not of {agent.robot_id!r}")
    _same_settings(state["rbpf"], asdict(agent.settings.rbpf), path)
    try:
        mapper = Mapper(agent.settings.rbpf, seed=agent.mapper.seed)
        mapper.restore(state["mapper"])
        mapper.skip_revisions(REVISIONS_LOST)
        links = {peer: LinkStats(**sums) for peer, sums in state["links"].items()}
        pairs = {(a, b): _pair(status) for a, b, status in state["pairs"]}
        frame = state.get("frame")
        masked_beams, map_number = state["masked_beams"], state["map_number"]
        doubt = agent.self_doubt.resumed(state["self_doubt"])
        restore_store(agent.node.store, state["store"], REVISIONS_LOST)
    except MISFIT as error:
        raise InputError(f"{path}: the checkpoint does not fit this program ({error})") from error
    agent.mapper, agent.links, agent.masked_beams, agent.map_number = mapper, links, masked_beams, map_number
    agent.self_doubt = doubt
    agent.team.take_up(pairs, frame)


def resume(agent: Agent, path: Path) -> None:
    """Resume a robot from its file, and save it at once: what was skipped once must not be used again."""
    restore(agent, path)
    try:
        write(freeze(agent), path)
    except OSError:
        # Without it a later start from the same file would use the same revisions for other content.
        agent.node.store.new_epoch()


def _same_settings(saved: dict[str, Any], now: dict[str, Any], path: Path) -> None:
    other = [
        f"rbpf.{name} {saved.get(name)} (now {now[name]})"
        for name in now
        if name not in FREE and saved.get(name) != now[name]
    ]
    if other:
        raise InputError(f"{path}: made with other settings: {', '.join(other)}; use these, or start without it")


def _pair_state(status: PairStatus) -> dict[str, Any]:
    return {
        "status": status.status,
        "reason": status.reason,
        "attempts": status.attempts,
        "accepted_at_ns": status.accepted_at_ns,
        "alignment": None if status.alignment is None else _alignment_state(status.alignment),
    }


def _pair(state: dict[str, Any]) -> PairStatus:
    found = None if state["alignment"] is None else _alignment(state["alignment"])
    status = PairStatus(
        status=state["status"],
        alignment=found,
        accepted_at_ns=state["accepted_at_ns"],
        reason=state["reason"],
        attempts=state["attempts"],
    )
    status.stability.believed = status.stability.previous = found
    return status


def _alignment(state: dict[str, Any]) -> Alignment:
    return Alignment(**{**state, "evidence": Evidence.from_row(state["evidence"])})


def _alignment_state(alignment: Alignment) -> dict[str, Any]:
    return {
        "T_a_b": np.asarray(alignment.T_a_b, dtype=np.float64),
        "confidence": float(alignment.confidence),
        "evidence": alignment.evidence.as_row(),
        "covariance": np.asarray(alignment.covariance, dtype=np.float64),
        "method": alignment.method,
    }
