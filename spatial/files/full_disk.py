"""Files that a robot can do without: where one cannot be written, as on a full disk, the robot continues."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

log = logging.getLogger(__name__)


@contextmanager
def unwritten_is_logged(robot_id: str, path: Path) -> Iterator[None]:
    """Log a warning of one line where the block cannot write the file (``OSError``), and continue after the block."""
    try:
        yield
    except OSError as error:
        log.warning("%s: %s cannot be written (%s)", robot_id, path, error.strerror)
