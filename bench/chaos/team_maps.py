"""What a user gets: the team map is true, shows all that is known, and has no teammates in it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence, Set

import numpy as np
from numpy.typing import NDArray

from bench.chaos.scene import SPOILS, Report, Scene
from bench.chaos.schedule import REST_S
from mrslam.agent import Agent
from mrslam.mutual_detection import place_covariance
from mrslam.sim_driver.evaluate.robot_rows import GHOST_M
from mrslam.sim_driver.evaluate.truth import values_from
from mrslam.spatial import OccupancyGrid, se2
from mrslam.spatial.se2 import Transform

PRECISION = 0.95
"""At least this share of a team map's walls lies within two cells of true ones, and as much farther off as its robot
says that it may (``SIGMAS``). Measured: 0.989 and more."""
SIGMAS, UNSURE_MOST_M = 2.0, 0.25
"""Standard deviations of teammates' places by which walls may be off, and most metres: maps that share 6 m of wall are
laid on each other to a decimetre, and say so."""
KEPT = 0.9
"""A team map shows at least this share of the floor that the maps in it show. Measured: 0.971 and more."""
COVERAGE = 0.7
"""A fault-free robot knows at least this share of the reachable floor at the end. Measured: 0.88 and more."""
COVERED_M2 = 65.0
"""Of large worlds, which no robot sees whole in so short a time, at least so much. Measured: 71 m2 of a hotel's 162."""
GHOSTS_MOST = 15
"""Wall cells where placed teammates drove, away from true walls. Measured: 9 at most."""


class TeamMaps:
    """Holds every robot's team map against the world at the end."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._ways: defaultdict[str, list[NDArray[np.float64]]] = defaultdict(list)
        self._epochs: dict[str, int] = {}
        self._begun: dict[str, int] = {}
        """By robot: how many of its ways' places are older than the map that it has now."""
        self._stopped: dict[str, NDArray[np.float64]] = {}
        """Where robots stand whose process stopped, for another had their id: they no longer say where they are."""

    def step(self, scene: Scene) -> None:
        """Note where robots are while lasers see them, and when they begin another map."""
        for robot_id, agent in scene.agents.items():
            epoch = agent.node.store.own_epoch
            if self._epochs.setdefault(robot_id, epoch) != epoch:
                self._epochs[robot_id], self._begun[robot_id] = epoch, len(self._ways[robot_id])
            if agent.node.must_stop:
                self._stopped[robot_id] = scene.T_world_base[robot_id][:2]
        if scene.now_s < REST_S:
            for robot_id, pose in scene.T_world_base.items():
                self._ways[robot_id].append(pose[:2])

    def at_end(self, scene: Scene) -> None:
        """Judge the team maps of robots whose own map can be right."""
        for robot_id, agent in scene.agents.items():
            if not agent.node.must_stop and not scene.suffers(robot_id, "liar", *SPOILS):
                self._judge(scene, robot_id, agent)

    def _judge(self, scene: Scene, robot_id: str, agent: Agent) -> None:
        T_world_team, team = scene.frame_now(agent, robot_id), agent.team_map()
        mates = team.T_team_map.keys() - {robot_id}
        if T_world_team is None or any(scene.suffers(mate, "liar", *SPOILS) for mate in mates):
            return
        strangers = self._ways.keys() - team.T_team_map.keys()
        unsure_m = min(SIGMAS * max(_sigmas_m(agent, mates), default=0.0), UNSURE_MOST_M)
        or_at = _other_frames(scene, agent, T_world_team)
        precision = self._precision(scene, team.grid, T_world_team, strangers, unsure_m, or_at)
        floor = scene.judge.world.centres(scene.judge.reachable)
        coverage, kept = self._floor(scene, agent, floor, (T_world_team, *or_at))
        floor_m2 = len(floor) * scene.judge.world.resolution_m**2
        ghosts = self._ghosts(scene, team.grid, T_world_team, mates, or_at)
        self._report.figures["team map"].append(
            [robot_id, len(mates), round(precision, 4), round(coverage, 4), round(kept, 4), ghosts, round(unsure_m, 3)]
        )
        if precision < PRECISION:
            self._report.say(f"{100 * precision:.0f} % of the walls in the team map of {robot_id} are true")
        if kept < KEPT:
            self._report.say(f"the team map of {robot_id} shows {100 * kept:.0f} % of the floor its maps show")
        if ghosts > GHOSTS_MOST:
            self._report.say(f"the team map of {robot_id} has {ghosts} wall cells where teammates drove")
        if coverage < min(COVERAGE, COVERED_M2 / floor_m2) and not scene.suffers(robot_id):
            self._report.say(f"the team map of {robot_id} shows {100 * coverage:.0f} % of the floor")

    def _ghosts(
        self,
        scene: Scene,
        grid: OccupancyGrid,
        T_world_team: Transform,
        mates: Set[str],
        or_at: Sequence[Transform] = (),
    ) -> int:
        """Return how many wall cells stand where these robots drove, but for where one that stopped truly stands."""
        standing = np.array([self._stopped[mate] for mate in sorted(mates & self._stopped.keys())]).reshape(-1, 2)
        ways = self._where(mates, of_this_map=True), standing
        drove, stands = (scene.judge.ghosts(grid, T_world_team, places, GHOST_M, or_at) for places in ways)
        return drove - stands

    def _where(self, robot_ids: Set[str], *, of_this_map: bool = False) -> NDArray[np.float64]:
        """Return places ``(N, 2)`` of the world where these robots were; ``of_this_map`` : since their maps began.

        Where a robot was before it gave a map up, nobody knows any more: what others saw of it there stays.
        """
        ways = [self._ways[robot][self._begun.get(robot, 0) if of_this_map else 0 :] for robot in sorted(robot_ids)]
        return np.array([place for way in ways for place in way]).reshape(-1, 2)

    def _precision(
        self,
        scene: Scene,
        grid: OccupancyGrid,
        T_world_team: Transform,
        strangers: Set[str],
        unsure_m: float = 0.0,
        or_at: Sequence[Transform] = (),
    ) -> float:
        """Return the share of a team map's walls that are true, 0..1, but for robots that it has no place for.

        Where they are is not known to it, so they are masked by nobody, and stand in its map as any obstacle does.
        """
        walls = int(grid.is_occupied.sum())
        wrong = round(walls * (1.0 - scene.judge.occupied_precision(grid, T_world_team, unsure_m, or_at)))
        bodies = scene.judge.ghosts(grid, T_world_team, self._where(strangers), GHOST_M, or_at)
        return 1.0 - (wrong - bodies) / max(walls - bodies, 1)

    def _floor(
        self, scene: Scene, agent: Agent, floor: NDArray[np.float64], frames: Sequence[Transform]
    ) -> tuple[float, float]:
        """Return which share of the floor ``(N, 2)`` a team map shows, and of what the maps in it show, 0..1 each.

        ``frames`` : where the team map's frame is in the world; floor counts that is shown in one of them.
        """
        team, shown = agent.team_map(), np.zeros(len(floor), dtype=np.bool_)
        for member in team.T_team_map:
            T_world_member = scene.frame(agent, member)
            if T_world_member is not None:
                grid = agent.node.store.maps[member].map.to_grid()
                shown |= values_from(grid, se2.inverse(T_world_member), floor) == 0
        known = np.any([values_from(team.grid, se2.inverse(T), floor) == 0 for T in frames], axis=0)
        return float(known.mean()), float((known & shown).sum() / max(shown.sum(), 1))


def _other_frames(scene: Scene, agent: Agent, T_world_team: Transform) -> list[Transform]:
    """Return other frames ``T_world_team`` in which parts of a team map are true, two for each that drove blind.

    Its map is off by what its wheels were wrong, from there on, and the others are laid on what it mapped before or
    after. How far off it may be is judged by :mod:`bench.chaos.doubt`.
    """
    frames: list[Transform] = []
    for member in agent.team_map().T_team_map:
        begun, now = scene.frame(agent, member), scene.frame_now(agent, member)
        if begun is not None and now is not None and begun is not now:
            strayed = se2.compose(now, se2.inverse(begun))
            frames += [se2.compose(one, T_world_team) for one in (strayed, se2.inverse(strayed))]
    return frames


def _sigmas_m(agent: Agent, mates: Set[str]) -> Iterator[float]:
    """Yield the largest standard deviation of the middle of each teammate's map by its alignment, metres."""
    for mate in mates:
        covariance = agent.team.covariance_of(mate)
        if covariance is not None:
            grid, T_own_mate = agent.node.store.maps[mate].map.to_grid(), agent.T_team_map[mate]
            middle = se2.apply(T_own_mate, grid.centres(grid.is_known).mean(axis=0))
            yield float(np.sqrt(np.linalg.eigvalsh(place_covariance(T_own_mate, covariance, middle))[-1]))
