"""A team's keys: a certificate authority, one certificate a robot, and who may write under which name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class RobotKeys:
    """What one robot needs to speak in a closed team."""

    ca: Path
    certificate: Path
    key: Path
    roster: Mapping[str, str]
    """Everyone with a certificate: name -> "robot" or "router"."""


def access_rules(team: str, roster: Mapping[str, str]) -> dict[str, Any]:
    """Return Zenoh access rules: a robot writes only under its own name, a router passes on for all, others nothing."""
    raise NotImplementedError
