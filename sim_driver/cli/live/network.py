"""``mrslam keys`` and ``mrslam doctor``: a team's certificates, and what this machine's network is like."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from mrslam.comms import make_team_keys, revoke_robots
from mrslam.comms.doctor import examine
from mrslam.comms.security.team_keys import VALID_DAYS
from mrslam.sim_driver.cli.console import say
from mrslam.spatial.errors import require

MAX_DAYS = 36_500.0
"""Longest lifetime of a certificate, days: a date a century from now still fits every tool's calendar."""
MARKS = {"ok": "ok", "warning": "look", "error": "BAD"}
"""Level of a finding -> what is printed before it."""


def make_keys(
    team: str, robots: list[str], routers: list[str], out: Path, *, days: float = VALID_DAYS, renew: bool = False
) -> None:
    """Make the keys of robots that have none yet, all signed by the team's one authority; renew those that have."""
    require(0.0 < days <= MAX_DAYS, "--days", f"above 0, at most {MAX_DAYS:g}", days)
    made = make_team_keys(out, team, robots, routers, valid_days=days, renew=renew)
    for folder in made:
        say(f"{folder}: copy this folder to {folder.name}")
    if not made:
        say("all of them have keys already")
    say(f"{out / 'ca'}: the team's authority; keep it, and keep it to yourself")


def revoke_keys(team: str, names: list[str], out: Path) -> None:
    """Revoke robots; agents that run take up the list when it is copied into their folders."""
    for path in revoke_robots(out, team, names):
        if path.parent.name not in ("ca", *names):
            say(f"{path}: copy this file to {path.parent.name}'s key folder; a running agent reads it within a second")


def diagnose(listen: list[str], connect: list[str], multicast: bool, as_json: bool) -> None:
    """Look at interfaces, ports, multicast, clock and throughput, and say what was found."""
    findings = examine(listen, connect, with_multicast=multicast)
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings]))
        return
    for finding in findings:
        say(f"{MARKS.get(finding.level, finding.level):>4}  {finding.topic}: {finding.words}")
