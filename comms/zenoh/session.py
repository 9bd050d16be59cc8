"""Opening and closing Zenoh sessions."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import zenoh

from mrslam.comms.security.team_keys import RobotKeys
from mrslam.comms.zenoh.config import as_json, stays_here
from mrslam.spatial import InputError

log = logging.getLogger(__name__)


def open_session(chosen: Mapping[str, Any]) -> zenoh.Session:
    """Open a session with these settings; raise ``InputError`` where it cannot be."""
    config = zenoh.Config()
    try:
        for key, value in as_json(chosen):
            config.insert_json5(key, value)
        return zenoh.open(config)
    except zenoh.ZError as error:
        endpoints = [*chosen.get("listen/endpoints", []), *chosen.get("connect/endpoints", [])]
        raise InputError(f"the network cannot be opened with {endpoints}: {error}") from error


def close_session(session: zenoh.Session, declared: Iterable[Any] = ()) -> None:
    """Undeclare what was declared and close the session; what Zenoh fails at is logged, and the rest is done.

    On a machine that is too busy closing takes longer than Zenoh waits.
    """
    steps = [*(one.undeclare for one in declared), session.close]
    for step in steps:
        try:
            step()
        except zenoh.ZError as error:
            log.warning("a network session was not closed in good order: %s", error)


def warn_if_open(team: str, endpoints: Sequence[str], multicast: bool, keys: RobotKeys | None) -> None:
    """Log a warning where strangers could take part in the team."""
    if keys is None and (multicast or not stays_here(endpoints)):
        log.warning("team %s is open: anyone on this network can read and write its maps (see mrslam keys)", team)
