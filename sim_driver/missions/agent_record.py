"""What ``mrslam agent`` says of itself in its folder: whose it is, and with which settings it ran."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from mrslam.sim_driver.missions.run_files import AGENT_FILE
from mrslam.sim_driver.missions.settings import as_table
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.full_disk import unwritten_is_logged


@dataclass(frozen=True, kw_only=True)
class AgentRecord:
    """One agent's robot, team, input and settings."""

    id: str
    team: str
    mode: str
    log: str | None
    """The log that stood in for the laser; None where drivers sent scans."""
    settings: dict[str, dict[str, Any]]
    """All settings by section, as in ``config.json`` of a run."""
    begun_s: float
    """When it began its map, by the world's clock."""
    ended: bool = False
    """Whether it left its maps since it was started last."""

    def write(self, folder: Path) -> None:
        """Write it into the robot's folder; where that cannot be, as on a full disk, the robot goes on without."""
        path = folder / AGENT_FILE
        with unwritten_is_logged(self.id, path):
            write_text(path, json.dumps(as_table(self), indent=1) + "\n")

    @classmethod
    def begin_of(cls, folder: Path, now_s: float, is_resumed: bool) -> float:
        """Return when the agent of a folder began its map: now, or where it resumed what its record says."""
        if is_resumed:
            with suppress(InputError):
                return cls.read(folder).begun_s
        return round(now_s, 3)

    @classmethod
    def read(cls, folder: Path) -> AgentRecord:
        """Read it; raise ``InputError`` where the folder is no agent's."""
        path = folder / AGENT_FILE
        try:
            return msgspec.json.decode(path.read_bytes(), type=cls)
        except OSError as error:
            raise InputError(f"{folder}: not the folder of an agent ({AGENT_FILE} is missing)") from error
        except msgspec.DecodeError as error:
            raise InputError(f"{path}: not what an agent writes ({error})") from error
