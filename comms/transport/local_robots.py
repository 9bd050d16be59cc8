"""Which robots run on this machine and where they listen, so that ``mrslam top`` needs no address and opens no port.

Each robot leaves a small file in a folder that only its user can enter. Nothing of it goes over a network.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from mrslam.spatial.files.atomic import write_text

ANYWHERE = {"0.0.0.0": "127.0.0.1", "[::]": "[::1]"}
"""Wildcard addresses, and the loopback address that reaches each."""


@dataclass(frozen=True)
class LocalRobot:
    """One robot of this machine."""

    team: str
    robot: str
    pid: int
    endpoints: list[str]

    @property
    def is_secure(self) -> bool:
        """Whether one needs the team's keys to reach it."""
        return any(endpoint.startswith(("tls/", "quic/")) for endpoint in self.endpoints)


def folder() -> Path:
    """Return where the files lie."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return Path(runtime) / "mrslam" if runtime else Path(tempfile.gettempdir()) / f"mrslam-{os.getuid()}"


def announce(team: str, robot: str, listen: Sequence[str]) -> Path | None:
    """Leave a file that says where a robot listens; return it, None where it listens nowhere or no file can be made."""
    if not listen:
        return None
    place = folder()
    try:
        place.mkdir(mode=0o700, exist_ok=True)
        if place.stat().st_uid != os.getuid():  # another user made it first
            return None
        path = place / f"{team}.{robot}.{os.getpid()}.json"
        write_text(path, json.dumps(asdict(LocalRobot(team, robot, os.getpid(), [_reachable(e) for e in listen]))))
    except OSError:
        return None
    return path


def withdraw(path: Path | None) -> None:
    """Remove the file."""
    if path is not None:
        path.unlink(missing_ok=True)


def local_robots() -> list[LocalRobot]:
    """Return the robots that run on this machine now; files of processes that were killed are removed."""
    found = []
    place = folder()
    if not place.is_dir() or place.stat().st_uid != os.getuid():
        return []
    for path in sorted(place.glob("*.json")):
        try:
            robot = LocalRobot(**json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            continue
        if _is_alive(robot.pid):
            found.append(robot)
        else:
            withdraw(path)
    return found


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _reachable(endpoint: str) -> str:
    bare = endpoint.partition("#")[0]
    for everywhere, here in ANYWHERE.items():
        bare = bare.replace(f"/{everywhere}:", f"/{here}:")
    return bare
