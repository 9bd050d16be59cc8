"""Recorded scans behind one protocol. A new format is a file with its :class:`Format`, and a word in ``FORMATS``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from mrslam.sim_driver.feeds.base import Feed, Format, Reading
from mrslam.sim_driver.feeds.carmen import CARMEN
from mrslam.sim_driver.feeds.floats import warm_up
from mrslam.sim_driver.feeds.rosbag import ROSBAG
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file, is_folder

FORMATS: dict[str, Format] = {format.name: format for format in (CARMEN, ROSBAG)}
"""Every format that can be read, by name."""


def guess_format(path: Path) -> str:
    """Return the name of the format that the file's name stands for; raise ``InputError`` where it stands for none."""
    if is_folder(path):
        return _format_of_folder(path).name
    if not is_file(path):
        raise InputError(f"{path}: no such log")
    suffix = path.with_suffix("").suffix if path.suffix == ".gz" else path.suffix
    for format in FORMATS.values():
        if suffix in format.suffixes:
            return format.name
    known = ", ".join(suffix for format in FORMATS.values() for suffix in format.suffixes)
    raise InputError(f"{path}: unknown log format {suffix or 'without suffix'!r}; known are {known} (or .gz)")


def _format_of_folder(path: Path) -> Format:
    for format in FORMATS.values():
        if format.folder_file is not None and is_file(path / format.folder_file):
            return format
    raise InputError(
        f"{path}: a folder without metadata.yaml is no ROS2 recording; name the log file itself, or "
        f"make it with ros2 bag reindex {path.name}"
    )


def open_feed(path: Path | str, format: str | None = None, salvage: bool = False) -> Feed:
    """Open a recorded log; the format is guessed from its name unless given.

    ``salvage`` : use what is whole of a CARMEN log or ROS1 bag that was cut off; its notes say so.
    """
    path = Path(path)
    name = format or guess_format(path)
    if name not in FORMATS:
        raise InputError(f"unknown log format {name!r}; known are {', '.join(FORMATS)}")
    return FORMATS[name].read(path, salvage)


def shared_readings(path: Path) -> Sequence[Reading]:
    """Return a log's readings, not to be changed: the robots of a run that play one log, and its report, share them."""
    about = path.stat()
    return _newest_readings(path, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=1)
def _newest_readings(path: Path, mtime_ns: int, size: int) -> Sequence[Reading]:
    """Read a log; the time it was changed and its size are there to tell whether it is still the one read before."""
    return open_feed(path).readings


__all__ = ["FORMATS", "Feed", "Format", "Reading", "guess_format", "open_feed", "shared_readings", "warm_up"]
