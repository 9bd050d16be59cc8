"""Messages of a robot's agent beside its line of status: where it resumed, when it is blind or in doubt."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from mrslam.agent import Agent, Event, Sensed
from mrslam.comms import is_saved
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.missions.run_files import CHECKPOINT
from mrslam.sim_driver.run.team import take_up
from mrslam.spatial.files.atomic import unused

KEPT = f"{CHECKPOINT}.old"
"""Name of a checkpoint that an agent did not resume from, the second one with -2 and so on: no option or setting makes
anybody lose a map."""
WORDS = {
    "blind": "cannot use what its laser gives: {reason}; it continues by odometry",
    "sees": "sees again, after {blind_s} s",
    "doubtful": "doubts where it is; teammates get no new map of it until it knows",
    "recovered": "knows again where it is",
    "given_up": "does not find its place in its map again; it begins a new one",
    "localised": "knows where it is in {map}: x {x_m} m, y {y_m} m, theta {theta_rad} rad in that map's frame",
    "tracking": "tracks its place in {map} from now on, and maps no more",
    "lost": "has lost its place in {map}: {reason}; it begins a new map and looks for its place again",
    "not_here": "is not in {map}, as far as can be told: {reason}; it goes on looking",
    "not_localised": "does not know any more where it is in {map}: {reason}",
}
"""Event -> what the robot does, with the event's fields."""
GOOD = ("sees", "recovered", "localised", "tracking")
"""Those that are no cause for worry."""


def begin(
    agent: Agent, folder: Path, fresh: bool, now_ns: int, tell: Callable[[str], None] | None = None
) -> list[Event]:
    """Resume an agent from the checkpoint in its folder and say so; else keep that under another name.

    ``tell`` says a line, by default on the terminal.
    """
    tell = tell or say
    path = folder / CHECKPOINT
    if not path.exists():
        return []
    kept = unused(folder / KEPT)
    if fresh:
        path.replace(kept)
        tell(f"{agent.robot_id} begins a new map; its checkpoint is kept as {kept}")
        return []
    saved = datetime.fromtimestamp(path.stat().st_mtime)
    (event,) = take_up(agent, path, now_ns)
    if event.fields["checkpoint"]:
        unsure = ", and doubted where it is" if agent.self_doubt.doubtful else ""
        tell(
            f"{agent.robot_id} resumes from its checkpoint of {saved:%Y-%m-%d %H:%M:%S}, which holds "
            f"{event.fields['scans']} scans{unsure}; --fresh begins a new map"
        )
    else:
        path.replace(kept)
        tell(f"{event.fields['reason']}; {agent.robot_id} begins a new map, and the checkpoint is kept as {kept}")
    return [event]


class DoubtMessages:
    """Says when a robot is blind or doubts its pose, and how that ends; and where it is in saved maps."""

    def __init__(self, warn: Callable[[str], None] | None = None, tell: Callable[[str], None] | None = None) -> None:
        """``warn`` says what is amiss and ``tell`` the rest, by default on the terminal."""
        self._warn, self._tell = warn, tell

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Scans are counted in the line of status."""

    def on_event(self, agent: Agent, event: Event) -> None:
        """Say the events of ``WORDS``, and saved maps that come; the agent's clock shows the world's time."""
        is_saved_map = event.kind == "map_updated" and is_saved(event.fields["robot_id"])
        if event.kind not in WORDS and not is_saved_map:
            return
        words = "got the saved map {robot_id} from {source}" if is_saved_map else WORDS[event.kind]
        out = self._tell if is_saved_map or event.kind in GOOD else self._warn
        when = f"{datetime.fromtimestamp(event.t_ns / 1e9):%H:%M:%S}"
        (out or say)(f"{when} {agent.robot_id} {words.format(**event.fields)}")

    def close(self, agent: Agent, now_ns: int) -> None:
        """Nothing to close."""
