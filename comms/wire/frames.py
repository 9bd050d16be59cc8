"""The eleven bytes before every message: protocol, version, team, checksum. See docs/protocol.md."""

from __future__ import annotations

import re
import struct
import zlib
from hashlib import blake2b

from mrslam.spatial.errors import InputError

MAGIC = b"MR"
PROTOCOL_VERSION = 4
"""4 carries keyframes' scans, see docs/protocol.md. A robot drops messages of any other version."""
HEADER = struct.Struct("<2sBII")
"""Magic, protocol version, team tag, CRC-32 of the body; little endian."""
NAME = re.compile(r"(?!\.)[A-Za-z0-9_.-]{1,64}")


class WireError(ValueError):
    """A received message that cannot be used; ``kind`` says why, for counting."""

    def __init__(self, kind: str, detail: str = "") -> None:
        super().__init__(f"{kind}: {detail}" if detail else kind)
        self.kind = kind


def check_name(name: str, what: str) -> str:
    """Return a robot's or team's name, or raise ``InputError`` where it would break key expressions and file names."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise InputError(f"{what} must be 1 to 64 letters, digits, '_', '-' or '.', not '.' first, got {name!r}")
    return name


def team_tag(team: str) -> int:
    """Return the first four bytes of BLAKE2b-32 of a team's name as a number: messages with another are foreign."""
    return int.from_bytes(blake2b(team.encode(), digest_size=4).digest(), "little")


def frame(body: bytes, tag: int) -> bytes:
    """Return the header for a team's tag, and the body."""
    return HEADER.pack(MAGIC, PROTOCOL_VERSION, tag, zlib.crc32(body)) + body


def unframe(payload: bytes, tag: int, max_bytes: int) -> bytes:
    """Return the body; raise :class:`WireError` for what is too long, cut off, of another tag, or corrupt."""
    if len(payload) > max_bytes:
        raise WireError("oversized", f"{len(payload)} bytes > {max_bytes}")
    if len(payload) < HEADER.size:
        raise WireError("truncated", f"{len(payload)} bytes")
    magic, version, its_tag, checksum = HEADER.unpack_from(payload)
    if magic != MAGIC:
        raise WireError("foreign protocol")
    if version != PROTOCOL_VERSION:
        raise WireError(f"protocol version {version}, not {PROTOCOL_VERSION}")
    if its_tag != tag:
        raise WireError("foreign team")
    body = payload[HEADER.size :]
    if zlib.crc32(body) != checksum:
        raise WireError("corrupt")
    return body
