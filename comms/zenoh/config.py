"""Zenoh's settings for a robot or watcher, as a dict."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from mrslam.comms.security.access import access_rules
from mrslam.comms.security.team_keys import RobotKeys
from mrslam.spatial import InputError

LEASE_MS = 2000
"""A robot whose link is silent for this long is gone, milliseconds: below ``comms.peer_timeout_s``."""
CLIENT_TIMEOUT_MS = 5000
"""A client gives up on its router after this long, milliseconds."""
BATCH_BYTES = 16_384
"""Most bytes that Zenoh sends in one piece: what is urgent waits for one piece at most."""
DATAGRAM_LEASE_MS = 10_000
"""Half of the datagrams may be lost without the session taking its peer for dead, milliseconds."""
DATAGRAM_OPEN_MS = 1000
"""A handshake whose datagrams were lost is repeated after this, milliseconds."""
SEND_BUFFER_BYTES = 32_768
"""Small, so that what is urgent need not queue behind map chunks inside the kernel."""
SECURE = ("tls", "quic")
PLAIN = ("tcp", "udp", "ws")


def settings(
    team: str,
    *,
    mode: str,
    listen: Sequence[str],
    connect: Sequence[str],
    multicast: bool,
    keys: RobotKeys | None,
) -> dict[str, Any]:
    """Return Zenoh's settings by key; raise ``InputError`` for an endpoint that cannot work."""
    endpoints = [*listen, *connect]
    for endpoint in endpoints:
        check_endpoint(endpoint, keys)
    chosen: dict[str, Any] = {
        "mode": mode,
        "scouting/multicast/enabled": multicast,
        "scouting/gossip/enabled": True,
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/batch_size": BATCH_BYTES,
        "connect/timeout_ms": -1,  # robots may come later, or come back: keep trying, without holding up the start
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 1.5},
        "connect/exit_on_failure": False,
        "listen/exit_on_failure": True,
    }
    if mode == "client":  # without its router it is nothing
        chosen |= {"connect/timeout_ms": CLIENT_TIMEOUT_MS, "connect/exit_on_failure": True}
    if listen or not multicast:
        chosen["listen/endpoints"] = [_tuned(endpoint) for endpoint in listen]
    if connect:
        chosen["connect/endpoints"] = [_tuned(endpoint) for endpoint in connect]
    if keys is not None:
        tls = "transport/link/tls/"
        chosen |= {
            tls + "root_ca_certificate": str(keys.ca),
            tls + "enable_mtls": True,
            tls + "close_link_on_expiration": True,
            tls + "verify_name_on_connect": False,  # robots move between addresses; the access rules go by name
            tls + "listen_private_key": str(keys.key),
            tls + "listen_certificate": str(keys.certificate),
            tls + "connect_private_key": str(keys.key),
            tls + "connect_certificate": str(keys.certificate),
            "access_control": access_rules(team, keys.roster),
        }
        if multicast:
            chosen["listen/endpoints"] = [_tuned(endpoint) for endpoint in listen] or ["tls/[::]:0"]
    return chosen


def split_datagrams(endpoints: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the endpoints that lose nothing, and those that carry datagrams: ``udp/...`` and ``quic/...?rel=0``."""
    datagrams = [e for e in endpoints if e.startswith("udp/") or (e.startswith("quic/") and "rel=0" in e)]
    return [e for e in endpoints if e not in datagrams], datagrams


def stays_here(endpoints: Sequence[str]) -> bool:
    """Return whether all endpoints are this machine's own, so that nobody else reaches what goes over them."""
    return all(e.partition("/")[2].startswith(("127.", "localhost:", "[::1]:")) for e in endpoints)


def datagram_settings(
    team: str, listen: Sequence[str], connect: Sequence[str], keys: RobotKeys | None
) -> dict[str, Any]:
    """Return the settings of the session that carries beacons as datagrams, where a lost one holds up nothing."""
    return settings(team, mode="peer", listen=listen, connect=connect, multicast=False, keys=keys) | {
        "transport/link/tx/lease": DATAGRAM_LEASE_MS,
        "transport/unicast/open_timeout": DATAGRAM_OPEN_MS,
        "transport/unicast/accept_timeout": DATAGRAM_OPEN_MS,
        "scouting/gossip/enabled": False,
    }


def watcher_settings(
    team: str, listen: Sequence[str], connect: Sequence[str], multicast: bool, keys: RobotKeys | None
) -> dict[str, Any]:
    """Return the settings of a watcher: it scouts, but is not found, and opens no port unless asked to."""
    chosen = settings(team, mode="peer", listen=listen, connect=connect, multicast=multicast, keys=keys)
    return chosen | {
        "listen/endpoints": [_tuned(endpoint) for endpoint in listen],
        "scouting/multicast/listen": False,
    }


def as_json(chosen: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return each setting with its value as JSON text, as Zenoh takes it."""
    return [(key, json.dumps(value)) for key, value in chosen.items()]


def check_endpoint(endpoint: str, keys: RobotKeys | None = None) -> None:
    """Raise ``InputError`` for an endpoint that cannot work, with or without the team's keys."""
    protocol, slash, address = endpoint.partition("/")
    if not slash or not address or protocol not in (*SECURE, *PLAIN):
        raise InputError(f"endpoint must look like tcp/192.168.1.5:7447 or tls/..., got {endpoint!r}")
    if keys is not None and protocol not in SECURE:
        raise InputError(f"with team keys every endpoint must be tls/ or quic/, got {endpoint!r}")
    if keys is None and protocol in SECURE:
        raise InputError(f"endpoint {endpoint!r} needs the team's keys (mrslam keys makes them)")


def _tuned(endpoint: str) -> str:
    if endpoint.startswith(("tcp/", "tls/")) and "#" not in endpoint and "?" not in endpoint:
        return f"{endpoint}#so_sndbuf={SEND_BUFFER_BYTES}"
    return endpoint
