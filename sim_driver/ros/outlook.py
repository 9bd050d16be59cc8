"""What a node shows of its agent: values taken on the agent's thread, and read on that of ROS.

Every attribute is replaced as a whole, so that neither thread waits for the other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mrslam.agent import Agent, Event, Sensed
from mrslam.agent.chosen_frame import in_frame
from mrslam.agent.shells.clock import Clock
from mrslam.agent.shells.sensors import SensorBody
from mrslam.comms.status.report import PeerStatus, team_status
from mrslam.merge import TeamMap
from mrslam.spatial import OccupancyGrid, Scan, se2
from mrslam.spatial.se2 import Transform

T = TypeVar("T")

PATIENCE_S = 0.5
"""Scans wait this long before newer ones replace them, seconds: longer than a mapper is ever busy with one, on a
processor that is fast enough at all."""
LOOK_NS = 500_000_000
"""Time between two looks at the team, nanoseconds."""


@dataclass(frozen=True, eq=False)
class Located:
    """Where the robot was at its newest scan."""

    stamp_ns: int
    """The scan's stamp."""
    arrived_ns: int
    """When it came, by the node's clock."""
    T_map_base: Transform
    T_map_odom: Transform | None
    """None where no odometry came with the scan, and none before."""
    covariance: NDArray[np.float64]
    """``(3, 3)`` of ``T_map_base``, m^2 and rad^2."""


@dataclass(frozen=True, eq=False)
class TeamSight:
    """The robot's team: where teammates are, and how maps fit together."""

    T_own_team: Transform = field(default_factory=lambda: se2.IDENTITY)
    """Maps points of the team frame into the own map; right near the robot."""
    T_team_base: dict[str, Transform] = field(default_factory=dict)
    """By teammate: where it is now."""
    T_team_map: dict[str, Transform] = field(default_factory=dict)
    """By robot, the own one included: where its map lies."""
    frame: str | None = None
    """The robot whose map frame the team's is."""
    edges: tuple[tuple[str, str, float | None, str], ...] = ()
    """Pairs of maps: two robots, the confidence of their alignment (None: not merged), and words."""
    links: tuple[PeerStatus, ...] = ()


class RosBody(SensorBody):
    """The body of a robot whose laser is a topic; it also lets the agent's thread do what services ask for."""

    def __init__(self, clock: Clock, ros_now_ns: Callable[[], int], *, period_s: float) -> None:
        """``ros_now_ns()`` : the node's clock; ``period_s`` : least time between two looks at a map."""
        super().__init__(clock, patience_s=PATIENCE_S)
        self.located: Located | None = None
        self.own_map: OccupancyGrid | None = None
        self.team_map: OccupancyGrid | None = None
        self.waits_for = ""
        """The saved map in whose frame it shows all, while the robot is not localised there yet."""
        self.team = TeamSight()
        self.on_located: Callable[[Located], None] = lambda located: None
        self.wants_team_map: Callable[[], bool] = lambda: True
        self._ros_now_ns = ros_now_ns
        self._period_ns = round(period_s * 1e9)
        self._arrived: deque[tuple[int, int, bool]] = deque(maxlen=1000)
        self._T_map_odom: Transform | None = None
        self._covariance = np.zeros((3, 3))
        self._next_look_ns = self._next_map_ns = 0
        self._own: Any = None
        self._drawn: TeamMap | None = None
        self._requests: deque[tuple[Callable[[Agent], Any], Future[Any]]] = deque()

    # -- the thread of ROS ---------------------------------------------------------------------------------------------

    def take(self, scan: Scan, T_odom_base: Transform | None) -> None:
        """Take a scan and note when it came."""
        self._arrived.append((scan.stamp_ns, self._ros_now_ns(), T_odom_base is not None))
        self.on_scan(scan, T_odom_base)

    def ask(self, question: Callable[[Agent], T]) -> Future[T]:
        """Have the agent's thread call a function with the agent; the future has its result."""
        answer: Future[T] = Future()
        self._requests.append((question, answer))
        self.on_ready()
        return answer

    def begin(self) -> None:
        """Forget the agent before: the next one has another map. Its thread has ended."""
        self.located = self.own_map = self.team_map = self._own = self._drawn = None
        self._T_map_odom, self.waits_for = None, ""
        self.team = TeamSight()
        self._next_look_ns = self._next_map_ns = 0

    # -- the thread of the agent ---------------------------------------------------------------------------------------

    def _odometry_at(self, stamp_ns: int) -> Transform | None:
        """Return None: scans come with their odometry here, or have none."""
        return None

    def on_mapped(self, agent: Agent, sensed: Sensed) -> None:
        """Note where the robot is after a scan."""
        T_frame_map = agent.frame.T_frame_map
        if agent.mapper.stats.processed == 0 or T_frame_map is None:
            return
        T_map_base = se2.compose(T_frame_map, agent.T_map_base)
        if agent.is_settled:
            self._covariance = se2.turned_covariance(agent.covariance, T_frame_map[2])
        if sensed.T_odom_base is not None:
            self._T_map_odom = se2.compose(T_map_base, se2.inverse(sensed.T_odom_base))
        arrived_ns = self._arrival_of(sensed.scan.stamp_ns)
        self.located = Located(sensed.scan.stamp_ns, arrived_ns, T_map_base, self._T_map_odom, self._covariance)
        self.on_located(self.located)

    def _arrival_of(self, stamp_ns: int) -> int:
        while self._arrived:
            stamp, arrived_ns, _ = self._arrived.popleft()
            if stamp == stamp_ns:
                return arrived_ns
        return self._ros_now_ns()

    def act(self, agent: Agent, now_ns: int) -> None:
        """Answer what was asked, and look at maps and team when it is time to."""
        while self._requests:
            question, answer = self._requests.popleft()
            try:
                answer.set_result(question(agent))
            except Exception as error:  # noqa: BLE001 - raised by the one who asked
                answer.set_exception(error)
        if now_ns >= self._next_look_ns:
            self._next_look_ns = now_ns + LOOK_NS
            self.look(agent, now_ns)

    def look(self, agent: Agent, now_ns: int) -> None:
        """Take what there is to show of the team, and the maps where they changed."""
        T_frame_team = agent.T_frame_team
        self.waits_for = agent.frame.saved_map if T_frame_team is None else ""
        if T_frame_team is None:
            return
        is_own = not agent.frame.saved_map
        beliefs = sorted(agent.team.beliefs.items())
        edges = tuple(
            (a, b, None if belief.alignment is None else float(belief.alignment.confidence), belief.reason)
            for (a, b), belief in beliefs
        )
        self.team = TeamSight(
            T_own_team=se2.inverse(agent.team.layout.T_team_own) if is_own else se2.IDENTITY,
            T_team_base={one: se2.compose(T_frame_team, T) for one, T in agent.teammates(now_ns).items()},
            T_team_map={one: se2.compose(T_frame_team, T) for one, T in agent.T_team_map.items()},
            frame=agent.team.layout.frame,
            edges=edges,
            links=tuple(team_status(agent.node, now_ns)),
        )
        if now_ns < self._next_map_ns:
            return
        self._next_map_ns = now_ns + self._period_ns
        known = agent.team.maps.get(agent.robot_id)
        if known is not None and known is not self._own:
            self._own = known
            self.own_map = in_frame(agent.team.without_ghosts(known.grid, of_own_map=True), agent.frame.T_frame_map)
        if self.wants_team_map() and agent.team.maps:
            team_map = agent.team_map()
            if team_map is not self._drawn:
                self._drawn, self.team_map = team_map, in_frame(team_map.grid, T_frame_team)


class Onlooker:
    """Hands the body what its agent has mapped."""

    def __init__(self, body: RosBody) -> None:
        """Take the body."""
        self._body = body

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Show where the robot is now."""
        self._body.on_mapped(agent, sensed)

    def on_event(self, agent: Agent, event: Event) -> None:
        """Events are in the robot's folder."""

    def close(self, agent: Agent, now_ns: int) -> None:
        """Nothing to close."""
