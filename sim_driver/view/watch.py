"""The watcher that shows a robot: it hands the newest frame to its thread; frames not taken yet are dropped."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import Protocol

from mrslam.agent import Agent, Event, Sensed
from mrslam.rbpf import Mapper
from mrslam.sim_driver.view.frame import Frame
from mrslam.spatial import Scan, se2

FRAME_NS = 400_000_000
"""Least mission time between two frames, nanoseconds."""
EVENTS_MOST = 5_000
"""Events that wait for the thread; older ones are lost first."""
CLOSE_S = 5.0
"""Longest wait for the thread when the robot ends, seconds: a viewer that hangs is left behind."""
SHOWN = ("link_changed", "merged", "unmerged", "exchange_done", "exchange_failed", "peer_gone", "alignment")
"""Events that a viewer is given."""

logger = logging.getLogger(__name__)


class Stream(Protocol):
    """Where a view is written; used on one thread alone."""

    def open(self) -> None:
        """Open it."""

    def show(self, frame: Frame) -> None:
        """Write a frame; may take its time."""

    def tell(self, event: Event) -> None:
        """Write an event."""

    def close(self) -> None:
        """Write what is left."""


class Handover:
    """Brings the newest frame to a stream on a thread of its own; what goes wrong there ends in a line of the log."""

    def __init__(self, stream: Stream) -> None:
        """Start the thread that writes to the stream."""
        self._stream = stream
        self._wake = threading.Condition()
        self._frame: Frame | None = None
        self._events: deque[Event] = deque(maxlen=EVENTS_MOST)
        self._ended = False
        self._due_ns = 0
        self._thread = threading.Thread(target=self._run, name="view", daemon=True)
        self._thread.start()

    def is_due(self, now_ns: int) -> bool:
        """Return whether it is time for the next frame."""
        return now_ns >= self._due_ns

    def show(self, frame: Frame) -> None:
        """Leave the newest frame where the thread finds it."""
        self._due_ns = frame.t_ns + FRAME_NS
        with self._wake:
            self._frame = frame
            self._wake.notify()

    def tell(self, event: Event) -> None:
        """Leave an event where the thread finds it."""
        self._events.append(event)

    def close(self) -> None:
        """Let the thread write what it has, within bounds."""
        with self._wake:
            self._ended = True
            self._wake.notify()
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            logger.warning("the viewer does not take what it is given; the view ends without it")

    def _run(self) -> None:
        try:
            self._stream.open()
            while True:
                with self._wake:
                    self._wake.wait_for(lambda: self._frame is not None or self._ended)
                    frame, self._frame = self._frame, None
                    ended = self._ended
                if frame is not None:
                    self._stream.show(frame)
                while self._events:
                    self._stream.tell(self._events.popleft())
                if ended and frame is None:
                    self._stream.close()
                    return
        except Exception:  # a viewer's troubles are not the robot's
            logger.exception("the view of a robot ended")


class ViewWatcher:
    """Shows one agent."""

    def __init__(self, stream: Stream) -> None:
        """Start showing."""
        self._view = Handover(stream)

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Gather references to what the agent knows now, if a frame is due."""
        if agent.scan is not None and self._view.is_due(now_ns):
            self._show(agent, sensed.scan, now_ns)

    def _show(self, agent: Agent, scan: Scan | None, now_ns: int) -> None:
        maps, T_own_team = dict(agent.node.store.maps), se2.inverse(agent.team.layout.T_team_own)
        self._view.show(
            Frame(
                t_ns=now_ns,
                T_map_base=agent.T_map_base,
                scan=scan,
                masked=agent.scan,
                particles=agent.T_map_base[None] if agent.tracking.is_on else agent.mapper.particles,
                maps=maps,
                T_own_map={name: T for name in maps if (T := agent.team.layout.T_own_map(name)) is not None},
                teammates={peer: se2.compose(T_own_team, T) for peer, T in agent.teammates(now_ns).items()},
            )
        )

    def on_event(self, agent: Agent, event: Event) -> None:
        """Pass on what is worth showing; a base station, which has no scans, shows its maps at events."""
        if event.kind in SHOWN:
            self._view.tell(event)
        if agent.mode == "central" and self._view.is_due(event.t_ns):
            self._show(agent, None, event.t_ns)

    def close(self, agent: Agent, now_ns: int) -> None:
        """Write what is left, within bounds; of a base station, its last maps."""
        if agent.mode == "central":
            self._show(agent, None, now_ns)
        self._view.close()


class MapperWatcher:
    """Shows a mapper that has no agent around it: where it is, what it sees, and the points it has seen."""

    def __init__(self, mapper: Mapper, stream: Stream) -> None:
        """Start showing."""
        self._mapper, self._view = mapper, Handover(stream)
        self._start_ns: int | None = None

    def on_scan(self, scan: Scan) -> None:
        """Take a scan that was just mapped."""
        self._start_ns = scan.stamp_ns if self._start_ns is None else self._start_ns
        now_ns = scan.stamp_ns - self._start_ns
        if self._view.is_due(now_ns):
            mapper = self._mapper
            self._view.show(Frame(now_ns, mapper.T_map_base, scan, scan, mapper.particles))

    def close(self) -> None:
        """Write what is left, within bounds."""
        self._view.close()
