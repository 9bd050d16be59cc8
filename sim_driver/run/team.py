"""Making the robots of a mission: agents with their seeds, bodies, and what tells them of their links."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from mrslam.agent import Agent, Body, Event, LinkSource, Sensed, Watcher, read_saved_maps, resume
from mrslam.agent.config import FARTHEST_M, check_start
from mrslam.comms import MapSeal, RobotKeys
from mrslam.comms.zenoh import ZenohTransport
from mrslam.sim_driver.drivers import DRIVERS, Driver, Explorer, IdleDriver, TrajectoryDriver, WaypointDriver
from mrslam.sim_driver.faults.liar import WAYS, Liar
from mrslam.sim_driver.feeds import shared_readings
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import LINKS_FILE, SCANS_FILE
from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.sim_driver.missions.seeds import seed_for
from mrslam.sim_driver.missions.traces import LinkTrace, TracedLinks
from mrslam.sim_driver.replay import Recorder, ReplayedBody, read_recording
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.sim_driver.simulation.simulated import Port, SimulatedBody
from mrslam.sim_driver.simulation.simulation import is_simulated, start_of
from mrslam.sim_driver.view import watch_robot
from mrslam.spatial import InputError, se2
from mrslam.spatial.files.tum import read_tum


class NoBody:
    """A robot that senses nothing: a base station that only merges."""

    next_ns: int | None = None
    finished = True

    def sense(self, now_ns: int) -> Sensed | None:
        """Return None: there is no laser."""

    def act(self, agent: Agent, now_ns: int) -> None:
        """Nothing to drive."""


class ToldLinks:
    """Link qualities as a function tells them, now."""

    def __init__(self, tell: Callable[[], dict[str, float]]) -> None:
        """Take the function."""
        self._tell = tell

    def qualities(self, now_ns: int) -> dict[str, float]:
        """Return the quality of the link to each peer."""
        return self._tell()


def make_agent(mission: Mission, robot: RobotConfig, boot_id: int) -> Agent:
    """Return the agent of one robot; one that lies does so from the start."""
    lies = any(fault.kind == "liar" and fault.robot == robot.id for fault in mission.faults)
    kind = partial(Liar, way=WAYS[seed_for(mission, "lies") % len(WAYS)]) if lies else Agent
    agent = kind(
        robot.id,
        mission.settings_of[robot.id],
        team=mission.mission.name,
        mode=robot.mode,
        seed=seed_for(mission, f"agent/{robot.id}"),
        boot_id=boot_id,
    )
    if robot.mode == "distributed":
        given = [one for one in mission.maps if one.robots is None or robot.id in one.robots]
        paths = {one.path: (mission.find(one.path), one.id) for one in given}
        take_saved_maps(agent, paths, {one.path: one.near for one in given})
    return agent


def take_saved_maps(
    agent: Agent,
    saved: Mapping[str, tuple[Path, str | None]],
    near: Mapping[str, Sequence[float] | None] | None = None,
) -> list[str]:
    """Give an agent the maps saved at some paths, each with a name or None for the usual; return all their names.

    ``near`` : by path as in ``saved``, where the robot begins in that map, if that is known.
    """
    names = []
    for said, (path, chosen) in saved.items():
        found = read_saved_maps(path)
        hint = (near or {}).get(said)
        if hint is not None and len(found) > 1:
            raise InputError(f"{said}: holds the maps {', '.join(found)}; name the one that near is a place of")
        if chosen is not None and len(found) > 1:
            raise InputError(f"{said}: holds the maps {', '.join(found)}; one name ({chosen}) is not enough for them")
        for name, known in found.items():
            names.append(chosen or name)
            agent.take_saved_map(names[-1], known, hint)
    return names


def take_maps(agent: Agent, paths: Sequence[Path], near: str | None, option: str = "--near") -> str:
    """Give an agent the maps saved at these paths; return a line that names them, empty where there are none.

    ``near`` : "x,y" or "x,y,theta", where the robot's map begins in the only one, if that is known; ``option`` : what
    is blamed where that makes no sense.
    """
    hint = None if near is None else place_of(near, option)
    if hint is not None and len(paths) != 1:
        raise InputError(f"{option} is a place of one saved map: name one map with it")
    said = {str(path): (path, None) for path in paths}
    names = take_saved_maps(agent, said, dict.fromkeys(said, hint))
    where = "" if near is None else f", first near {near}"
    return f"{agent.robot_id} looks for its place in {', '.join(names)}{where}" if names else ""


def place_of(words: str, option: str) -> list[float]:
    """Return ``x,y`` or ``x,y,theta`` as numbers; raise ``InputError`` that blames the option where they are none."""
    try:
        place = [float(word) for word in words.split(",")]
        check_start(option, place)
    except ValueError as error:
        wants = f"X,Y or X,Y,THETA in metres and radians, none beyond {FARTHEST_M:g}"
        raise InputError(f"{option} wants {wants}, got {words!r}") from error
    return place


def make_body(mission: Mission, robot: RobotConfig, port: Port | None) -> Body:
    """Return what the robot senses and drives with: a log, the simulation at the other end of ``port``, or nothing."""
    if robot.log is not None:
        return RecordedBody(shared_readings(mission.find(robot.log)), robot.first, robot.last)
    if mission.replay is not None and is_simulated(mission, robot):
        return ReplayedBody(read_recording(mission.replay / robot.id / SCANS_FILE))
    if robot.mode == "central" or port is None:
        return NoBody()
    return SimulatedBody(port, _driver(mission, robot))


def _driver(mission: Mission, robot: RobotConfig) -> Driver:
    seed = seed_for(mission, f"driver/{robot.id}")
    if robot.driver == "explore":
        return Explorer(mission.driver, seed)
    if robot.driver == "idle":
        return IdleDriver()
    start = start_of(mission, robot)
    # Waypoints and trajectories are of the world; the robot drives in its own map, whose origin is its start.
    if robot.driver == "waypoints" and robot.waypoints and start is not None:
        points = se2.apply(se2.inverse(start), np.array(robot.waypoints, dtype=np.float64))
        return WaypointDriver(points, mission.driver, seed, loop=robot.patrol)
    if robot.driver == "trajectory" and robot.trajectory is not None and start is not None:
        stamps_ns, T_world_base = read_tum(mission.find(robot.trajectory))
        return TrajectoryDriver(stamps_ns, se2.between(start, T_world_base), mission.driver)
    if robot.driver == "waypoints":
        raise InputError(f'robot {robot.id}: the driver "waypoints" needs waypoints = [[x_m, y_m], ...] and a start')
    if robot.driver == "trajectory":
        raise InputError(f'robot {robot.id}: the driver "trajectory" needs trajectory = "a TUM file"')
    raise InputError(f"robot {robot.id}: no driver {robot.driver!r}; there are {', '.join(DRIVERS)}")


def go_online(
    agent: Agent, *, listen: list[str], connect: list[str], multicast: bool = False, keys: RobotKeys | None = None
) -> ZenohTransport:
    """Return the agent's end of the real network; with keys its links are encrypted and its maps signed."""
    robot_id, team = agent.robot_id, agent.node.team
    if keys is not None:
        agent.node.seal_maps(MapSeal.load(keys, team, robot_id))
    return ZenohTransport(robot_id, team, listen=listen, connect=connect, multicast=multicast, keys=keys)


def read_trace(mission: Mission) -> LinkTrace | None:
    """Return the mission's trace of link qualities, if that is where they come from: its own, or that of a replay."""
    if mission.links.trace is not None:
        trace = LinkTrace.read(mission.find(mission.links.trace))
        ids = {robot.id for robot in mission.robots}
        if not any(ids.issuperset(pair) for pair in trace.pairs):
            told = ", ".join(f"{a}-{b}" for a, b in trace.pairs[:5])
            raise InputError(f"{mission.links.trace}: tells of {told}, and of no pair of {', '.join(sorted(ids))}")
        return trace
    if mission.replay is not None and (mission.replay / LINKS_FILE).exists():
        return LinkTrace.read(mission.replay / LINKS_FILE)
    _check_radio(mission)
    return None


def _check_radio(mission: Mission) -> None:
    """Refuse link qualities from where there are none, for then nobody would meet."""
    source = mission.settings.comms.link_source
    if source == "trace":
        raise InputError('comms.link_source is "trace", but no trace is given: name it as links.trace')
    if source == "model" and not any(is_simulated(mission, robot) for robot in mission.robots):
        raise InputError('comms.link_source is "model", but no robot is simulated, so there is no radio to model')


def radio_of(mission: Mission, robot: RobotConfig, trace: LinkTrace | None, port: Port | None) -> LinkSource | None:
    """Return what the radio really does at one robot: by the trace, by the simulation, or None (all is heard)."""
    if trace is not None:
        others = [other for other in mission.robots if other.id != robot.id]
        if mission.links.trace is None:  # what was recorded of a simulation knows its own robots only
            if not is_simulated(mission, robot):
                return None
            others = [other for other in others if is_simulated(mission, other)]
        return TracedLinks(trace, robot.id, [other.id for other in others])
    return None if port is None else ToldLinks(port.qualities)


def watchers_of(mission: Mission, robot: RobotConfig, folder: Path) -> list[Watcher]:
    """Return those who look on while the robot runs."""
    records = mission.mission.record and mission.replay is None and is_simulated(mission, robot)
    watchers: list[Watcher] = [Recorder(folder)] if records else []
    if mission.view:
        watchers.append(watch_robot(robot.id, folder, mission.view))
    return watchers


def told_links(mission: Mission, radio: LinkSource | None) -> LinkSource | None:
    """Return what tells the agent its link qualities; None where it measures them itself."""
    return None if mission.settings.comms.link_source == "measured" else radio


def take_up(agent: Agent, checkpoint: Path, now_ns: int) -> list[Event]:
    """Let a robot that starts again go on from its checkpoint, or from nothing where there is none to be used."""
    try:
        resume(agent, checkpoint, now_ns)
    except InputError as error:
        return [Event(now_ns, "restarted", {"checkpoint": False, "reason": str(error)})]
    return [Event(now_ns, "restarted", {"checkpoint": True, "scans": agent.mapper.stats.scans})]
