"""A robot on disk: its mapper, all maps it knows, all alignments it believes; after a crash it continues from there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.agent.config import REVISIONS_LOST, UNSAVED_MOST_S
from mrslam.agent.core import Agent
from mrslam.agent.known_map import KnownMap
from mrslam.agent.link_stats import LinkStats
from mrslam.agent.pairs.belief import PairBelief
from mrslam.alignment import Alignment, Evidence
from mrslam.comms import restore_store, store_state
from mrslam.merge import Pair
from mrslam.rbpf import Mapper
from mrslam.spatial import InputError
from mrslam.spatial.files.state_file import MISFIT, Packed, pack, read_state, write_state

KIND = "mrslam-agent"
"""Names the kind of file in its head."""
VERSION = 4
"""Of the state's layout; a file of another version is refused."""
WITHOUT_EFFECT = ("threads",)
"""Mapper settings that change no result."""


def freeze(agent: Agent, now_ns: int | None = None, *, is_last: bool = False) -> Packed:
    """Copy the robot's state as it is now, so that the copy can be written elsewhere.

    ``now_ns`` : mission time; None where it does not matter, for it is resumed under a new epoch in any case.
    ``is_last`` : whether the robot ends now, and nothing of it is published any more.
    It takes milliseconds: of maps that have not changed since the last time nothing is copied.
    """
    return pack(
        {
            "robot": agent.robot_id,
            "saved_ns": now_ns,
            "is_last": is_last,
            "mode": agent.mode,
            "rbpf": asdict(agent.settings.rbpf),
            "mapper": agent.mapper.state(),
            "store": store_state(agent.node.store),
            "frame": agent.team.layout.frame,
            "saved": {map_id: agent.team.maps[map_id].epoch for map_id in sorted(agent.team.saved)},
            "pairs": [[a, b, _belief_state(belief)] for (a, b), belief in sorted(agent.team.beliefs.items())],
            "links": {peer: vars(stats) for peer, stats in agent.links.items()},
            "masked_beams": agent.masked_beams,
            "map_number": agent.map_number,
            "begun_anew": sorted(agent.team.schedule.starts.begun_anew),
            "self_doubt": agent.self_doubt.state(),
            "tracking": agent.tracking.state(),
        }
    )


def write(frozen: Packed, path: Path) -> None:
    """Write the copy; what was at ``path`` stays until the new file is complete."""
    write_state(path, KIND, VERSION, frozen)


def restore(agent: Agent, path: Path) -> tuple[int | None, bool]:
    """Give a new robot the state that was saved, or leave it unchanged where that fails; return when it was saved.

    That is mission time, nanoseconds, None where it is not known; and whether the robot had ended then.

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
        beliefs = {(a, b): _belief(belief) for a, b, belief in state["pairs"]}
        frame = state.get("frame")
        saved_ns = None if state.get("saved_ns") is None else int(state["saved_ns"])
        is_last = bool(state.get("is_last"))
        masked_beams, map_number = state["masked_beams"], state["map_number"]
        doubt = agent.self_doubt.resumed(state["self_doubt"])
        restore_store(agent.node.store, state["store"], REVISIONS_LOST)
    except MISFIT as error:
        raise InputError(f"{path}: the checkpoint does not fit this program ({error})") from error
    agent.mapper, agent.links, agent.masked_beams, agent.map_number = mapper, links, masked_beams, map_number
    agent.self_doubt = doubt
    agent.tracking.restore(state.get("tracking"))
    agent.has_news = mapper.stats.processed > 0  # keyframes that were not published when the state was saved
    for robot_id in state.get("begun_anew", ()):
        agent.team.schedule.starts.forget(robot_id)
    store = agent.node.store
    maps = {name: KnownMap(store.version(name), local) for name, local in store.maps.items() if name not in store.given}
    if agent.robot_id in maps and maps[agent.robot_id].epoch != store.own_epoch:
        del maps[agent.robot_id]  # it was given up, and the next one was not published yet
    agent.team.restore(maps, _of_maps_here(beliefs, state.get("saved", {}), agent), frame)
    return saved_ns, is_last


def _of_maps_here(beliefs: Mapping[Pair, PairBelief], saved: Mapping[str, int], agent: Agent) -> dict[Pair, PairBelief]:
    """Return the beliefs without those of saved maps that the robot was not given again, or that have changed since.

    Saved maps that came from teammates came back with the store.
    """
    here = {map_id: agent.team.maps[map_id].epoch for map_id in agent.team.saved}
    here |= {map_id: epoch for map_id, (epoch, _) in agent.node.store.saved_digest().items()}
    gone = {map_id for map_id in saved.keys() | here.keys() if saved.get(map_id) != here.get(map_id)}
    return {pair: belief for pair, belief in beliefs.items() if not gone & set(pair)}


def resume(agent: Agent, path: Path, now_ns: int | None = None) -> None:
    """Resume a robot from its file, and save it at once: what was skipped once must not be used again.

    ``now_ns`` : mission time, by the clock by which it was saved; None where it may have published any number of
        revisions since. Where these may be more than it skips its map gets a new epoch: teammates that hold what the
        state does not know would take a part of the old content for the new one. A robot that ended in good order
        published none.
    """
    saved_ns, was_last = restore(agent, path)
    if now_ns is None or not (was_last or _is_recent(saved_ns, now_ns)):
        agent.node.store.new_epoch()
    try:
        write(freeze(agent, now_ns), path)
    except OSError:
        # Without it a later start from the same file would use the same revisions for other content.
        agent.node.store.new_epoch()


def _is_recent(saved_ns: int | None, now_ns: int) -> bool:
    """Return whether a state is young enough for its epoch; a clock that was set far back says as little as none."""
    return saved_ns is not None and abs(now_ns - saved_ns) <= UNSAVED_MOST_S * 1e9


def _same_settings(saved: dict[str, Any], now: dict[str, Any], path: Path) -> None:
    other = [
        f"rbpf.{name} {saved.get(name)} (now {now[name]})"
        for name in now
        if name not in WITHOUT_EFFECT and saved.get(name) != now[name]
    ]
    if other:
        raise InputError(f"{path}: made with other settings: {', '.join(other)}; use these, or start without it")


def _belief_state(belief: PairBelief) -> dict[str, Any]:
    """Return the belief without its last attempt and search, whose times and areas are of the process that ends."""
    return {
        "status": belief.status,
        "reason": belief.reason,
        "attempts": belief.attempts,
        "accepted_at_ns": belief.accepted_at_ns,
        "alignment": None if belief.alignment is None else _alignment_state(belief.alignment),
    }


def _belief(state: dict[str, Any]) -> PairBelief:
    belief = PairBelief(state["status"], state["reason"], state["attempts"], state["accepted_at_ns"])
    if state["alignment"] is not None:
        belief.stability.believed = belief.stability.previous = _alignment(state["alignment"])
    return belief


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
