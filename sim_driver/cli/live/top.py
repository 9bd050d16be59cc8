"""``mrslam top``: a live view of the robots that are here, of any team that can be reached."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from mrslam.comms import TeamView, own_keys
from mrslam.comms.transport.local_robots import LocalRobot, local_robots
from mrslam.comms.zenoh import ZenohWatcher
from mrslam.sim_driver.cli.live.top_tables import render
from mrslam.sim_driver.cli.signals import signals_heard

console = Console(soft_wrap=False)
"""The view is what was asked for, so it goes to the standard output."""
LOOK_S = 0.1
"""How often what came is taken, seconds."""
REFRESH_S = 0.5
"""How often the view is redrawn, seconds."""
GATHER_S = 1.2
"""Least wait of one snapshot, seconds: each robot publishes its status once a second."""
LOOKING = "looking for robots ..."
"""Shown until somebody is found, or the longest wait is over."""


@dataclass(frozen=True, kw_only=True)
class TopOptions:
    """What the command line says."""

    team: str | None
    listen: list[str]
    connect: list[str]
    keys: Path | None
    multicast: bool
    once: bool
    wait_s: float
    as_json: bool


class Watch:
    """A watcher of one team or all, that also follows the robots which start on this machine later."""

    def __init__(
        self, team: str | None, listen: Sequence[str], connect: Sequence[str], keys: Path | None, multicast: bool
    ) -> None:
        """Begin to watch; raises ``InputError`` for keys or endpoints that cannot be used."""
        self.keys = None if keys is None else own_keys(keys)
        self.team = self.keys[0] if self.keys is not None and team is None else team
        self.view = TeamView()
        self._listen, self._connect, self._multicast = listen, connect, multicast
        self._here = self._local_endpoints()
        self._watcher = self._open()

    def _open(self) -> ZenohWatcher:
        keys = None if self.keys is None else self.keys[1]
        ends = [*self._connect, *self._here]
        return ZenohWatcher(self.team, listen=self._listen, connect=ends, multicast=self._multicast, keys=keys)

    def _local_endpoints(self) -> list[str]:
        if self._connect:
            return []  # the user said where to look
        found = [r for r in local_robots() if self._may_join(r) and r.is_secure == (self.keys is not None)]
        return sorted({endpoint for robot in found for endpoint in robot.endpoints})

    def _may_join(self, robot: LocalRobot) -> bool:
        return self.team is None or robot.team == self.team

    def closed_teams(self) -> list[str]:
        """Return the teams on this machine that can be seen with their keys only, where none were given."""
        return sorted({r.team for r in local_robots() if r.is_secure and self._may_join(r)} if not self.keys else [])

    def look(self) -> None:
        """Take what came; go to robots that started on this machine since."""
        self.view.take(self._watcher.poll(), time.monotonic())
        here = self._local_endpoints()
        if not set(here) <= set(self._here):
            self._here = here
            self._watcher.close()
            self._watcher = self._open()

    def close(self) -> None:
        """Look away."""
        self._watcher.close()


@contextmanager
def _watch(*args: Any) -> Iterator[Watch]:
    watch = Watch(*args)
    try:
        yield watch
    finally:
        watch.close()


def top(options: TopOptions) -> None:
    """Show the robots until interrupted, or once; an empty place ends a single look with exit code 1."""
    with _watch(options.team, options.listen, options.connect, options.keys, options.multicast) as watch:
        if options.once or options.as_json:
            _show_once(watch, options.wait_s, options.as_json)
        else:
            _show_live(watch, options.wait_s)


def _show_once(watch: Watch, wait_s: float, as_json: bool) -> None:
    begun = time.monotonic()
    while (passed_s := time.monotonic() - begun) < wait_s:
        watch.look()
        if passed_s >= GATHER_S and watch.view.is_complete():
            break
        time.sleep(LOOK_S)
    robots = watch.view.snapshot(time.monotonic())
    if as_json:
        print(json.dumps({"robots": robots, "closed_teams": watch.closed_teams(), "bad": dict(watch.view.dropped)}))
    else:
        console.print(render(robots, nobody(watch, wait_s)))
    if not robots:
        raise typer.Exit(1)


def _show_live(watch: Watch, wait_s: float) -> None:
    told = signals_heard(signal.SIGINT)
    begun, drawn_s = time.monotonic(), 0.0
    with Live(Text(LOOKING), console=console, auto_refresh=False) as live:
        while not told:
            watch.look()
            now_s = time.monotonic()
            if now_s - drawn_s >= REFRESH_S:
                drawn_s = now_s
                words = nobody(watch, now_s - begun) if now_s - begun > wait_s else LOOKING
                live.update(render(watch.view.snapshot(now_s), words), refresh=True)
            time.sleep(LOOK_S)


def nobody(watch: Watch, waited_s: float) -> str:
    """Say plainly that nobody is here, and what to check."""
    which = "no robot of any team" if watch.team is None else f"no robot of team {watch.team!r}"
    lines = [f"nobody is here: {which} was seen in {waited_s:.3g} s"]
    lines += [
        f"  team {team!r} runs on this machine and is closed: give a key folder, --keys KEYS/ROBOT"
        for team in watch.closed_teams()
    ]
    lines += [
        "  on this machine: is one running? (mrslam demo, or mrslam run MISSION --shell process)",
        "  on another: does it listen on an address of the network? then --connect tcp/ADDRESS:PORT",
        "  what this machine's network can do: mrslam doctor",
    ]
    return "\n".join(lines)
