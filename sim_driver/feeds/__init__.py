"""Recorded scans: one reader a format, behind one protocol. A new format is one new file and one line in ``FEEDS``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from mrslam.sim_driver.feeds.base import Feed, Reading
from mrslam.sim_driver.feeds.carmen import CarmenFeed
from mrslam.sim_driver.feeds.floats import warm_up
from mrslam.sim_driver.feeds.rosbag import RosbagFeed
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file, is_folder

FEEDS: dict[str, Callable[[Path], Feed]] = {"carmen": CarmenFeed, "rosbag": RosbagFeed}
"""Format name -> reader."""

SALVAGED: dict[str, Callable[[Path], Feed]] = {
    "carmen": partial(CarmenFeed, salvage=True),
    "rosbag": partial(RosbagFeed, salvage=True),
}
"""Format name -> reader that uses what is whole of a file that was cut off, where it can."""

SUFFIXES = {
    ".clf": "carmen",
    ".log": "carmen",
    ".script": "carmen",
    ".bag": "rosbag",
    ".db3": "rosbag",
    ".mcap": "rosbag",
}
"""Suffix of a file (before .gz) -> format name. A folder with a metadata.yaml is a ROS2 recording."""


def guess_format(path: Path) -> str:
    """Return the format that the file's name tells, or raise ``InputError``."""
    if is_folder(path):
        if is_file(path / "metadata.yaml"):
            return "rosbag"
        raise InputError(
            f"{path}: a folder without metadata.yaml is no ROS2 recording; name the log file itself, or "
            f"make it with ros2 bag reindex {path.name}"
        )
    if not is_file(path):
        raise InputError(f"{path}: no such log")
    suffix = path.with_suffix("").suffix if path.suffix == ".gz" else path.suffix
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path}: unknown log format {suffix or 'without suffix'!r}; known are {', '.join(SUFFIXES)} (or .gz)"
        )
    return SUFFIXES[suffix]


def open_feed(path: Path | str, format: str | None = None, salvage: bool = False) -> Feed:
    """Open a recorded log; the format is guessed from its name unless given.

    ``salvage`` : use what is whole of a CARMEN log or ROS1 bag that was cut off; its notes say so.
    """
    path = Path(path)
    name = format or guess_format(path)
    if name not in FEEDS:
        raise InputError(f"unknown log format {name!r}; known are {', '.join(FEEDS)}")
    return SALVAGED[name](path) if salvage else FEEDS[name](path)


__all__ = ["FEEDS", "Feed", "Reading", "guess_format", "open_feed", "warm_up"]
