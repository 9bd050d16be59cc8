"""``mrslam ros``: one robot's agent as a ROS 2 node, until it is stopped."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrslam.agent import Agent, Event, Keeper, ProcessShell, Runner, Sensed, WallClock, Watcher
from mrslam.comms import load_keys
from mrslam.sim_driver.cli.live.agent_messages import DoubtMessages, begin
from mrslam.sim_driver.cli.progress import Lines
from mrslam.sim_driver.cli.signals import signals_heard
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.agent_record import AgentRecord
from mrslam.sim_driver.missions.run_files import CHECKPOINT
from mrslam.sim_driver.missions.settings import as_table
from mrslam.sim_driver.missions.usage import write_usage
from mrslam.sim_driver.ros.outlook import Onlooker, RosBody
from mrslam.sim_driver.ros.sessions import Sessions
from mrslam.sim_driver.run.known_area import KnownArea
from mrslam.sim_driver.run.team import go_online, take_maps
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import held

if TYPE_CHECKING:
    from mrslam.sim_driver.ros.node.node import RosNode

LOG_S = 60.0
"""How often the node logs how it fares, seconds."""


def main() -> None:
    """Run the node from ROS's own commands, with their arguments: the entry point of the ROS package."""
    try:
        run_ros({}, sys.argv[1:])
    except InputError as error:
        print(f"mrslam: {error}", file=sys.stderr)
        sys.exit(1)


def run_ros(overrides: Mapping[str, Any], arguments: Sequence[str]) -> None:
    """Run until SIGINT or SIGTERM; ``overrides`` : parameters by name, ``arguments`` : ``--ros-args ...``.

    Raises ``InputError`` where ROS is not installed, or a parameter makes no sense.
    """
    try:
        from mrslam.sim_driver.ros.node.node import RosNode
    except ImportError as error:
        raise InputError(
            f"ROS 2 is not here ({error}): source the robot's (source /opt/ros/kilted/setup.bash), or make an "
            "environment of wheels with .ci/ros-env FOLDER (docs/robots.md)"
        ) from error
    with closing(RosNode(arguments, overrides)) as node:
        ensure_compiled(node.say)
        received = signals_heard(signal.SIGINT, signal.SIGTERM)
        _run(node, lambda: bool(received) or node.failure is not None)
        if node.failure is not None:
            raise node.failure


def _run(node: RosNode, is_stopped: Callable[[], bool]) -> None:
    """Run one agent after another: a service may put another in its place."""
    options = node.options
    out = Path(options.out or Path("out") / options.robot)
    clock = WallClock(time.monotonic_ns() - time.time_ns())  # one for all: a scan's age is a difference of its times
    body = RosBody(clock, node.now_ns, period_s=options.map_period_s)
    sessions = Sessions(out, lambda: _make_agent(node))
    with held(out):
        agent: Agent | None = sessions.make()
        assert agent is not None
        past = begin(agent, out, options.fresh, clock.now_ns(), node.say)
        node.connect(body, sessions, out)
        while agent is not None:
            body.begin()
            _play(node, agent, body, clock, past, out, lambda: is_stopped() or sessions.is_over)
            agent, past = (None if is_stopped() else sessions.take_next()), []


def _make_agent(node: RosNode) -> Agent:
    options = node.options
    boot_id = time.time_ns() // 1_000_000
    name = {"team": options.team, "mode": options.mode}
    agent = Agent(options.robot, node.settings, **name, seed=options.seed, boot_id=boot_id)
    if taken := take_maps(agent, [Path(path) for path in options.maps], options.near or None, "near"):
        node.say(taken)
    return agent


def _play(
    node: RosNode, agent: Agent, body: RosBody, clock: WallClock, past: Sequence[Event], out: Path,
    is_over: Callable[[], bool],
) -> None:  # fmt: skip
    """Run one agent until it is over, and leave its files; ``clock`` is the body's."""
    options = node.options
    keys = load_keys(Path(options.keys), options.robot, options.team) if options.keys else None
    network = {"listen": list(options.listen), "connect": list(options.connect), "multicast": options.multicasts}
    known = KnownArea()
    lines = Lines(node.say, LOG_S)
    with closing(go_online(agent, **network, keys=keys)) as transport:  # type: ignore[arg-type]
        body.on_ready = transport.inbox.wake
        now_s = clock.now_ns() / 1e9
        is_resumed = any(event.fields["checkpoint"] for event in past)
        record = AgentRecord(
            id=options.robot, team=options.team, mode=options.mode, log=None, settings=as_table(node.settings),
            begun_s=AgentRecord.begin_of(out, now_s, is_resumed),
        )  # fmt: skip
        record.write(out)
        keeper = Keeper(out / CHECKPOINT, node.settings.agent.checkpoint_interval_s)
        watchers: list[Watcher] = [Onlooker(body), DoubtMessages(node.warn, node.say), MergeMessages(node.say), known]
        runner = Runner(agent, body, transport, out, watchers=watchers, keeper=keeper)
        runner.perform(past)
        node.say(f"{options.robot} of team {options.team} is up")
        shell = ProcessShell(runner, clock)

        def over() -> bool:
            lines.tell(f"{agent.scans} scans, {known.words}; {len(agent.node.peers)} teammates here")
            return is_over()

        shell.run(over)
        write_usage(shell, out)
        replace(record, ended=True).write(out)


class MergeMessages:
    """Says when maps of two robots find each other, and when they part."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """Take what says a line."""
        self._say = say

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Scans are counted elsewhere."""

    def on_event(self, agent: Agent, event: Event) -> None:
        """Say what became of a pair of maps."""
        if event.kind == "merged":
            self._say(f"merged the maps of {event.fields['a']} and {event.fields['b']}")
        elif event.kind == "unmerged":
            self._say(f"parted the maps of {event.fields['a']} and {event.fields['b']}: {event.fields['reason']}")

    def close(self, agent: Agent, now_ns: int) -> None:
        """Nothing to close."""
