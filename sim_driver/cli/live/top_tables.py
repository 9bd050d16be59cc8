"""What ``mrslam top`` draws: robots, links and alignments as tables."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from mrslam.comms import WARN_DAYS

STALE_S = 5.0
"""A status older than this is marked, seconds."""


def render(robots: Sequence[dict[str, Any]], empty: str) -> RenderableType:
    """Return what the screen shows of a snapshot; ``empty`` where nobody is in it."""
    if not robots:
        return Text(empty)
    return Group(_team_table(robots), _link_table(robots), *_alignment_lines(robots), *_certificate_lines(robots))


def _team_table(robots: Sequence[dict[str, Any]]) -> Table:
    table = Table("team", "robot", "mode", "up", "maps held (revision)", "beacons", "exchanges", box=None)
    for row in robots:
        status = row["status"]
        if status is None:
            table.add_row(row["team"], row["robot"], "here, no status yet" if row["here"] else "gone")
            continue
        maps = ", ".join(f"{name} {held['revision']}" for name, held in status["maps"].items()) or "none"
        up = f"{status['up_s']:.0f} s" if row["here"] else "gone"
        if row["here"] and status["age_s"] > STALE_S:
            up += f" (silent for {status['age_s']:.0f} s)"
        sizes = _size(status["beacon_bytes"]), _size(status["exchange_bytes"])
        table.add_row(row["team"], row["robot"], status["mode"], up, maps, *sizes)
    return table


def _link_table(robots: Sequence[dict[str, Any]]) -> Table:
    table = Table("link", "quality", "hears", "state", "what goes on", "sent", "received", "saved", box=None)
    for row in robots:
        if row["status"] is None or not row["here"]:
            continue
        for link in row["status"]["links"]:
            sizes = [_size(link[key]) for key in ("bytes_sent", "bytes_received", "bytes_saved")]
            shares = f"{link['quality']:.2f}", f"{link['lq']:.2f}"
            table.add_row(f"{row['robot']} - {link['peer']}", *shares, link["state"], link["activity"], *sizes)
    return table


def _alignment_lines(robots: Sequence[dict[str, Any]]) -> list[Text]:
    return [
        Text(f"{row['robot']}: {pair['a']} and {pair['b']} {pair['words']}")
        for row in robots
        if row["status"] is not None and row["here"]
        for pair in row["status"]["alignments"]
    ]


def _certificate_lines(robots: Sequence[dict[str, Any]]) -> list[Text]:
    lines = []
    for row in robots:
        ends_s = row["status"] and row["status"]["certificate_ends_s"]
        left_days = WARN_DAYS if ends_s is None else (ends_s - time.time()) / 86_400
        if left_days < WARN_DAYS:
            lines.append(Text(f"{row['robot']}: its certificate ends in {left_days:.1f} days; see mrslam keys --renew"))
    return lines


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if abs(count) >= 1e6 else f"{count / 1e3:.1f} kB"
