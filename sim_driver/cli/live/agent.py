"""``mrslam agent``: one robot's agent on the robot itself, fed by its drivers or by a log, until it is stopped."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.status import Status

from mrslam.agent import Agent, Body, Event, Keeper, ProcessShell, Runner, SensorBody, Settings, WallClock
from mrslam.comms import load_keys
from mrslam.comms.zenoh import ZenohSensors
from mrslam.sim_driver.cli.console import console, say
from mrslam.sim_driver.cli.live.agent_messages import DoubtMessages, begin
from mrslam.sim_driver.cli.live.agent_status import status_of
from mrslam.sim_driver.cli.progress import Lines
from mrslam.sim_driver.cli.signals import signals_heard
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.agent_record import AgentRecord
from mrslam.sim_driver.missions.locate import locate
from mrslam.sim_driver.missions.mission import make_settings
from mrslam.sim_driver.missions.run_files import CHECKPOINT
from mrslam.sim_driver.missions.settings import as_table, check_keys, made_with, read_toml
from mrslam.sim_driver.missions.usage import write_usage
from mrslam.sim_driver.run.known_area import KnownArea
from mrslam.sim_driver.run.team import NoBody, go_online, take_maps
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.spatial.files.atomic import held

SHOW_S = 1.0
"""How often the line of status is renewed, seconds."""
LOG_S = 60.0
"""How often it is printed where there is no terminal, as in a service's log, seconds."""


@dataclass(frozen=True, kw_only=True)
class AgentOptions:
    """What the command line says."""

    robot: str
    team: str
    mode: str
    listen: list[str]
    connect: list[str]
    multicast: bool
    keys: Path | None
    log: Path | None
    maps: list[Path]
    near: str | None
    sensors: str
    config: Path | None
    assignments: list[str]
    out: Path
    fresh: bool
    duration_s: float | None
    seed: int


def run_agent(options: AgentOptions) -> None:
    """Run until SIGINT or SIGTERM, or until the log has ended and the time is over; then leave the robot's files."""
    settings = _settings(options)
    keys = None if options.keys is None else load_keys(options.keys, options.robot, options.team)
    log = None if options.log is None else locate(str(options.log)).resolve()
    ensure_compiled(say)
    clock = WallClock(time.monotonic_ns() - time.time_ns())  # the world's time, so that robots' events can be compared
    boot_id = time.time_ns() // 1_000_000
    name = {"team": options.team, "mode": options.mode}
    agent = Agent(options.robot, settings, **name, seed=options.seed, boot_id=boot_id)
    if taken := take_maps(agent, options.maps, options.near):
        say(taken)
    known = KnownArea()
    with (
        held(options.out),
        _body(options, log, clock) as (body, words),
        _until_stopped(options, lambda: status_of(agent, known, words())) as over,
        closing(
            go_online(agent, listen=options.listen, connect=options.connect, multicast=options.multicast, keys=keys)
        ) as transport,
    ):
        past = begin(agent, options.out, options.fresh, clock.now_ns())
        if isinstance(body, RecordedBody) and (skipped := _skip_played(body, agent)):
            say(skipped)
        record = _record(options, settings, log, past, clock.now_ns() / 1e9)
        record.write(options.out)
        keeper = Keeper(options.out / CHECKPOINT, settings.agent.checkpoint_interval_s)
        runner = Runner(agent, body, transport, options.out, watchers=[DoubtMessages(), known], keeper=keeper)
        runner.perform(past)
        say(f"{options.robot} of team {options.team} is up; Ctrl-C ends it")
        shell = ProcessShell(runner, clock)
        shell.run(over)
        write_usage(shell, options.out)
        replace(record, ended=True).write(options.out)
    say(f"everything is in {options.out}")


def _skip_played(body: RecordedBody, agent: Agent) -> str | None:
    """Continue a log after the last scan that a resumed robot has mapped; return a line on it, None for a fresh one."""
    seen_ns = [agent.mapper.online_trajectory().stamps_ns, agent.tracking.rows().stamps_ns]
    seen_ns = [stamps[-1] for stamps in seen_ns if stamps.size]
    if not seen_ns or not body.go_on_after(int(max(seen_ns))):
        return None
    if body.finished:
        return "the log was played to its end before; --fresh plays it again"
    return "the log continues after the last scan that the checkpoint holds"


def _settings(options: AgentOptions) -> Settings:
    tables = {} if options.config is None else read_toml(options.config)
    where = "options" if options.config is None else str(options.config)

    def make(tables: dict[str, Any]) -> Settings:
        check_keys(tables, list(Settings.__dataclass_fields__), where)
        return make_settings(tables, where)

    return made_with(make, tables, options.assignments, where)


def _record(
    options: AgentOptions, settings: Settings, log: Path | None, past: Sequence[Event], now_s: float
) -> AgentRecord:
    """Return what the agent says of itself; one that resumed from a checkpoint began its map before."""
    is_resumed = any(event.fields["checkpoint"] for event in past)
    return AgentRecord(
        id=options.robot,
        team=options.team,
        mode=options.mode,
        log=None if log is None else str(log),
        settings=as_table(settings),
        begun_s=AgentRecord.begin_of(options.out, now_s, is_resumed),
    )


@contextmanager
def _body(options: AgentOptions, log: Path | None, clock: WallClock) -> Iterator[tuple[Body, Callable[[], str]]]:
    """Yield where scans come from, and what says in a few words how that goes."""
    if options.mode == "central":
        yield NoBody(), lambda: "no laser"
    elif log is not None:
        played = RecordedBody(open_feed(log).readings, start_ns=clock.now_ns())
        yield played, lambda: "the log has ended" if played.finished else "playing the log"
    else:
        body = SensorBody(clock)
        sensors = ZenohSensors(options.robot, options.team, options.sensors, body.on_scan, body.on_odometry)
        try:
            yield body, lambda: f"{body.scans_lost} scans lost" if body.scans_lost else f"drivers: {options.sensors}"
        finally:
            sensors.close()


@contextmanager
def _until_stopped(options: AgentOptions, status: Callable[[], str]) -> Iterator[Callable[[], bool]]:
    """Yield what says whether it is over: a signal came, or the time is up; meanwhile it shows the status."""
    received = signals_heard(signal.SIGINT, signal.SIGTERM)
    end_s = math.inf if options.duration_s is None else time.monotonic() + options.duration_s
    shown_s = 0.0
    lines = Lines(say, LOG_S)
    with Status("", console=console) as line:

        def over() -> bool:
            nonlocal shown_s
            now_s = time.monotonic()
            if now_s - shown_s > SHOW_S:
                shown_s = now_s
                line.update(status())
                if not console.is_terminal:
                    lines.tell(status())
            return bool(received) or now_s >= end_s

        yield over
