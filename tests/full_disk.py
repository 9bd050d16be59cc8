"""A disk without room, for tests of what is told and kept then."""

from __future__ import annotations

import errno
from typing import NoReturn


def full_disk(*_args: object, **_kwargs: object) -> NoReturn:
    """Fail as any write does there."""
    raise OSError(errno.ENOSPC, "No space left on device")
