"""``mrslam keys`` and ``mrslam doctor``: a team's certificates, and what this machine's network is like."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from mrslam.comms import make_team_keys
from mrslam.comms.doctor import examine
from mrslam.sim_driver.cli.console import say

MARKS = {"ok": "ok", "warning": "look", "error": "BAD"}
"""Level of a finding -> what is printed before it."""


def make_keys(team: str, robots: list[str], routers: list[str], out: Path) -> None:
    """Make the keys of robots that have none yet, all signed by the team's one authority."""
    made = make_team_keys(out, team, robots, routers)
    for folder in made:
        say(f"{folder}: copy this folder to {folder.name}")
    if not made:
        say("all of them have keys already")
    say(f"{out / 'ca'}: the team's authority; keep it, and keep it to yourself")


def diagnose(listen: list[str], connect: list[str], multicast: bool, as_json: bool) -> None:
    """Look at interfaces, ports, multicast, clock and throughput, and say what was found."""
    findings = examine(listen, connect, with_multicast=multicast)
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings]))
        return
    for finding in findings:
        say(f"{MARKS.get(finding.level, finding.level):>4}  {finding.topic}: {finding.words}")
