"""Live view and recordings with Rerun: off unless asked for, and never in the way of a robot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mrslam.agent import Watcher
from mrslam.sim_driver.missions.view_options import ViewOptions

if TYPE_CHECKING:
    from mrslam.rbpf import Mapper
    from mrslam.sim_driver.view.watch import MapperWatcher

__all__ = ["ViewOptions", "watch_mapper", "watch_robot"]


def watch_robot(robot_id: str, folder: Path, options: ViewOptions) -> Watcher:
    """Return the watcher that shows a robot as the options say."""
    from mrslam.sim_driver.view.stream import Stream  # takes a second to load: only for those who look
    from mrslam.sim_driver.view.watch import ViewWatcher

    return ViewWatcher(Stream(robot_id, options, folder))


def watch_mapper(mapper: Mapper, file: Path | None, address: str | None, name: str) -> MapperWatcher:
    """Return what shows a mapper without an agent, in a recording or to a viewer."""
    from mrslam.sim_driver.view.stream import Stream
    from mrslam.sim_driver.view.watch import MapperWatcher

    options = ViewOptions(record=file is not None, address=address, run_id=name, robots=(name,))
    return MapperWatcher(mapper, Stream(name, options, Path() if file is None else file.parent, file))
