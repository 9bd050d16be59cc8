"""A closed team on an in-memory network."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from mrslam.comms import MapSeal, load_keys, make_team_keys
from tests.comms.team import Team


def team_keys(folder: Path, robots: Iterable[str]) -> Path:
    """Make the keys of a team named "team" and return their folder."""
    make_team_keys(folder, "team", list(robots))
    return folder


def seal(keys: Path, robot: str) -> MapSeal:
    return MapSeal.load(load_keys(keys / robot, robot, "team"), "team", robot)


class SealedTeam(Team):
    """A team whose robots sign their maps, also after a restart."""

    def __init__(self, keys: Path, ids: Iterable[str], **options) -> None:
        self.keys = keys
        super().__init__(ids, **options)

    def start(self, robot: str, boot_id: int | None = None) -> None:
        super().start(robot, boot_id)
        self.nodes[robot].seal_maps(seal(self.keys, robot))
