"""Making the robots of a mission: agents with their seeds, and recorded bodies."""

from __future__ import annotations

from agent import Agent
from sim_driver.feeds import open_feed
from sim_driver.mission import Mission, RobotConfig
from sim_driver.recorded import RecordedBody
from sim_driver.seeds import seed_for
from sim_driver.traces import LinkTrace


def make_agent(mission: Mission, robot: RobotConfig, boot_id: int) -> Agent:
    """Return the agent of one robot."""
    return Agent(
        robot.id,
        mission.settings,
        team=mission.mission.name,
        mode=robot.mode,
        seed=seed_for(mission, f"agent/{robot.id}"),
        boot_id=boot_id,
    )


def recorded_body(mission: Mission, robot: RobotConfig) -> RecordedBody:
    """Return the body that plays the robot's log."""
    assert robot.log is not None
    return RecordedBody(open_feed(mission.find(robot.log)).readings, robot.first, robot.last)


def read_trace(mission: Mission) -> LinkTrace | None:
    """Return the mission's trace of link qualities, if that is where they come from."""
    if mission.links.trace is None:
        return None
    return LinkTrace.read(mission.find(mission.links.trace))
