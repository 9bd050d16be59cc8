"""``mrslam feed``: what is in a log."""

from __future__ import annotations

import json
from pathlib import Path

from mrslam.sim_driver.feeds.inspect import describe, inspect
from mrslam.sim_driver.missions.locate import locate


def inspect_file(log: Path, as_json: bool, salvage: bool = False) -> None:
    """Print what the log holds, what is odd in it, and what it lacks."""
    found = inspect(locate(str(log)), salvage=salvage)
    print(json.dumps(found) if as_json else describe(found))
