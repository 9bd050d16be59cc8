"""What both shells share: hand a robot what came in, and carry out what it asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Protocol

from mrslam.agent.core import Agent
from mrslam.agent.effects import AlignJob, Effect, Event, Job, JoinJob, Outcome
from mrslam.agent.pairs.part_saved import in_whole
from mrslam.agent.shells.body import Body, Sensed
from mrslam.agent.shells.ending import take_all
from mrslam.agent.shells.keeper import Keeper
from mrslam.agent.shells.outputs import EventLog, write_robot
from mrslam.agent.shells.watcher import Watcher
from mrslam.alignment import Alignment, Rejection, align
from mrslam.comms import Incoming, PeerJoined, PeerLeft, Transport
from mrslam.merge import LocalMatcher, join
from mrslam.merge.joint.align_bent import Scanned, align_bent
from mrslam.merge.joint.local_match import Answers
from mrslam.spatial.runtime.heap import give_back_now_and_then, trim

TRIM_NS = 60_000_000_000
"""Mission time between two releases of free memory to the system, nanoseconds: rare, for each takes milliseconds."""


class LinkSource(Protocol):
    """Link qualities that are not measured: a radio model's or a trace's."""

    def qualities(self, now_ns: int) -> dict[str, float]:
        """Return the quality in [0, 1] of the link to each peer, now."""


class Runner:
    """One agent with its body, its end of the network, and its folder."""

    def __init__(
        self,
        agent: Agent,
        body: Body,
        transport: Transport,
        folder: Path,
        links: LinkSource | None = None,
        watchers: Sequence[Watcher] = (),
        keeper: Keeper | None = None,
        matches: Answers | None = None,
    ) -> None:
        """Wire an agent to the world; its folder gets ``events.jsonl`` at once and the rest when it is closed.

        ``matches`` : of keyframes, which robots of one process share: many of them match the same two.
        """
        self.agent, self.body, self.transport, self.folder, self.links = agent, body, transport, folder, links
        self.watchers = tuple(watchers)
        self.sent_bytes = dict.fromkeys(("beacon", "control", "bulk", "status"), 0)
        """Bytes given to the network by lane; what goes to all counts once."""
        self.keeper = keeper
        self.events = EventLog(folder, agent.robot_id)
        self._next_trim_ns = 0
        self._matcher = LocalMatcher(matches)

    def receive(self, timeout_s: float, now_ns: Callable[[], int]) -> None:
        """Hand the agent all that came from the network."""
        for item in self.transport.poll(timeout_s):
            match item:
                case PeerJoined():
                    self.perform(self.agent.on_peer_joined(item.peer, now_ns()))
                case PeerLeft():
                    self.perform(self.agent.on_peer_left(item.peer, now_ns()))
                case Incoming():
                    self.perform(self.agent.on_message(item.payload, item.sender, now_ns()))

    def sense(self, now_ns: int) -> Sensed | None:
        """Hand the agent the next scan that is due and return it; None where none is due."""
        sensed = self.body.sense(now_ns)
        if sensed is None:
            return None
        self.perform(self.agent.on_scan(sensed.scan, sensed.T_odom_base, now_ns))
        for watcher in self.watchers:
            watcher.on_scan(self.agent, sensed, now_ns)
        return sensed

    def tick(self, now_ns: int) -> None:
        """Give the agent the link qualities that are not measured, and let it handle what is due."""
        if now_ns >= self._next_trim_ns:
            self._next_trim_ns = now_ns + TRIM_NS
            trim()
        if self.links is not None:
            for peer, quality in sorted(self.links.qualities(now_ns).items()):
                self.perform(self.agent.set_link_quality(peer, quality, now_ns))
        self.perform(self.agent.on_tick(now_ns))

    def keep(self, clock_ns: int, now_ns: int) -> None:
        """Let the keeper save the robot when it is time to by ``clock_ns``."""
        if self.keeper is not None:
            self.perform(self.keeper.look(self.agent, clock_ns, now_ns))

    def perform(self, effects: Sequence[Effect]) -> None:
        """Carry out what the agent asks for."""
        for effect in effects:
            if isinstance(effect, Event):
                self.events.write(effect)
                for watcher in self.watchers:
                    watcher.on_event(self.agent, effect)
            else:
                self.sent_bytes[effect.lane] += len(effect.payload)
                self.transport.send(effect)

    def work(self, job: Job) -> Outcome:
        """Do a job by the agent's settings; slow. One job is done at a time."""
        if isinstance(job, JoinJob):
            outcome: Outcome = join(job.trails, job.T_team_map, self._matcher, job.seen)
        else:
            outcome = self._align(job)
        give_back_now_and_then()
        return outcome

    def _align(self, job: AlignJob) -> Alignment | Rejection:
        settings = self.agent.settings.alignment
        # Robots' maps are bent by the scans that made them (align_bent), not by their walls alone.
        config = replace(settings, seed=settings.seed + job.attempt, strain=0.0)
        method = self.agent.settings.agent.align_method
        grids = (job.grid_a, job.grid_b)
        outcome = align(
            *grids, method=method, prior=job.prior, config=config, place=job.place, by_parts=job.by_parts
        )  # fmt: skip
        if isinstance(outcome, Rejection) and not outcome.is_in_parts and job.follows:
            outcome = align(*grids, method=method, prior=job.prior, config=config)
        if isinstance(outcome, Rejection) and outcome.may_bend and job.trails is not None:
            maps = [Scanned(*one) for one in zip(grids, job.trails, strict=True)]
            outcome = align_bent(maps[0], maps[1], outcome, method, config, self._matcher)
        return in_whole(job, outcome, config)

    def close(self, now_ns: int) -> None:
        """Leave the network and write the robot's files; what fails is raised when all else is done."""
        take_all(self._last_steps(now_ns))

    def _last_steps(self, now_ns: int) -> Iterator[Callable[[], None]]:
        yield lambda: self.perform(self.agent.leave(now_ns))
        yield self.transport.close
        if self.keeper is not None:
            yield partial(self.keeper.close, self.agent, now_ns)
        yield self.events.close
        for watcher in self.watchers:
            yield partial(watcher.close, self.agent, now_ns)
        yield lambda: write_robot(self.agent, self.folder, self.sent_bytes, self._unwritten)

    @property
    def _unwritten(self) -> dict[str, int]:
        """How many events and checkpoints could not be written."""
        return {"events": self.events.lost, "checkpoints": 0 if self.keeper is None else self.keeper.failures}
