"""What the node does when asked: give its map, save, begin again, return to a saved session."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import TimeoutError as NotInTimeError
from pathlib import Path
from typing import Any

from nav_msgs.srv import GetMap, LoadMap
from rclpy.node import Node
from std_srvs.srv import Trigger

from mrslam.agent import Agent
from mrslam.agent.chosen_frame import in_frame
from mrslam.agent.shells.files import KEYFRAMES_FILE, MAP_FILE, TEAM_MAP_FILE, TRAJECTORY_FILE
from mrslam.sim_driver.ros.node.outlets import Outlets
from mrslam.sim_driver.ros.outlook import RosBody
from mrslam.sim_driver.ros.sessions import Sessions
from mrslam.spatial import InputError, write_map
from mrslam.spatial.files.keyframes import write_keyframes
from mrslam.spatial.files.tum import write_tum

ANSWER_S = 10.0
"""Longest wait for the agent's thread, seconds: it is busy with one scan, or has ended."""


class Services:
    """The node's services."""

    def __init__(self, node: Node, body: RosBody, outlets: Outlets, sessions: Sessions, folder: Path) -> None:
        """Offer them; ``folder`` : the robot's, where maps are saved."""
        self._node, self._body, self._outlets, self._sessions, self._folder = node, body, outlets, sessions, folder
        node.create_service(GetMap, "dynamic_map", self._get_map)
        node.create_service(LoadMap, "load_session", self._load_session)
        for name, act in (("save", self._save), ("save_session", self._save_session), ("reset", self._reset)):
            node.create_service(Trigger, name, self._triggered(name, act))

    def _triggered(self, name: str, act: Callable[[], str]) -> Callable[[Any, Any], Any]:
        """Return the callback of a service that answers with success and words."""

        def answer(request: Any, response: Any) -> Any:
            try:
                response.message = act()
                response.success = True
            except (InputError, OSError, NotInTimeError) as error:
                response.success, response.message = False, str(error) or "the robot's agent does not answer"
            self._node.get_logger().info(f"{name}: {response.message}")
            return response

        return answer

    def _get_map(self, request: Any, response: Any) -> Any:
        if self._outlets.map.message is not None:
            response.map = self._outlets.map.message
        return response

    def _save(self) -> str:
        def shown(agent: Agent) -> Any:
            team = in_frame(agent.team_map().grid, agent.T_frame_team)
            return agent.own_map(), team, agent.trajectory_laser(), agent.local_map()

        own, team, trajectory, local = self._body.ask(shown).result(ANSWER_S)
        self._folder.mkdir(parents=True, exist_ok=True)
        write_map(self._folder / MAP_FILE, own)
        write_map(self._folder / TEAM_MAP_FILE, team)
        write_tum(self._folder / TRAJECTORY_FILE, trajectory.stamps_ns, trajectory.T_map_base)
        write_keyframes(self._folder / KEYFRAMES_FILE, local.keyframes, local.key_scans)
        return f"{MAP_FILE}, {TEAM_MAP_FILE}, {TRAJECTORY_FILE} and {KEYFRAMES_FILE} are in {self._folder}"

    def _save_session(self) -> str:
        return str(self._body.ask(self._sessions.save).result(ANSWER_S))

    def _load_session(self, request: Any, response: Any) -> Any:
        """Answer LoadMap: ``map_url`` is the session's file, or empty for the newest; the map comes on its topic."""
        try:
            path = Path(request.map_url.removeprefix("file://")) if request.map_url else self._sessions.newest()
            agent = self._sessions.load(path)
            words = f"{path} is loaded, with {agent.mapper.stats.scans} scans"
            response.result = LoadMap.Response.RESULT_SUCCESS
        except (InputError, OSError) as error:
            words, response.result = str(error), LoadMap.Response.RESULT_INVALID_MAP_DATA
            if request.map_url and not Path(request.map_url.removeprefix("file://")).exists():
                response.result = LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST
        self._node.get_logger().info(f"load_session: {words}")
        return response

    def _reset(self) -> str:
        self._sessions.reset()
        return f"a new map begins; the state so far is kept in {self._sessions.folder}"
