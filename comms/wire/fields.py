"""Types of the messages' fields, with their bounds, and what all messages share."""

from __future__ import annotations

from typing import Annotated

import msgspec

Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.-]+\Z")]
"""A robot id. ``frames.check_name`` also refuses a leading "." for the own names, which become file names."""
SAVED_NAME = r"(?!\.)[A-Za-z0-9_.-]{1,64}@[A-Za-z0-9_.-]{1,64}"
"""Names of saved maps; no robot has an ``@`` in its name."""
SavedName = Annotated[str, msgspec.Meta(max_length=129, pattern=rf"^{SAVED_NAME}\Z")]
MapName = Annotated[str, msgspec.Meta(max_length=129, pattern=rf"^([A-Za-z0-9_.-]{{1,64}}|{SAVED_NAME})\Z")]
"""Whose map it is: a robot id, or the name of a saved map."""
Percent = Annotated[int, msgspec.Meta(ge=0, le=100)]
U32 = Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
"""Boot ids, epochs, revisions, sequence numbers, bytes: below 2^63 with room for sums."""
I32 = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31 - 1)]
Milliseconds = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
TileCoordinate = Annotated[int, msgspec.Meta(ge=-(2**20), le=2**20)]
"""Row or column of a tile, tiles."""
MAX_LIST = 65_536
"""Entries of one list: tiles or blocks of the largest map (``max_tiles`` and ``max_keyframes`` / 64 end there)."""

Version = tuple[int, int]
"""(epoch, revision): a newer epoch beats any revision of an older one."""

Digest = Annotated[list[tuple[Name, Count, Count]], msgspec.Meta(max_length=4096)]
"""(robot, epoch, revision), by robot."""
SavedDigest = Annotated[list[tuple[SavedName, Count, Count]], msgspec.Meta(max_length=4096)]
"""(saved map, epoch, revision), by name."""


def is_saved(name: str) -> bool:
    """Return whether a map's name is that of a saved map."""
    return "@" in name


class Message(msgspec.Struct, array_like=True, frozen=True, tag_field="k"):
    """What all messages share: who sends it."""

    sender: Name
