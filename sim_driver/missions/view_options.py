"""What to show, and to whom; read by the command, carried to every robot's process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mrslam.sim_driver.missions.run_files import VIEW_FILE


@dataclass(frozen=True, kw_only=True)
class ViewOptions:
    """Where a run is shown."""

    record: bool = False
    """Whether every robot writes ``view.rrd`` into its folder."""
    address: str | None = None
    """gRPC address of a viewer, or None."""
    run_id: str = "run"
    """Robots with one id show up as one recording."""
    robots: tuple[str, ...] = ()
    """Names of all robots, for the window's layout."""

    def __bool__(self) -> bool:
        """Return whether anything is shown at all."""
        return self.record or self.address is not None

    def file_of(self, folder: Path) -> Path | None:
        """Return the recording of the robot with this folder."""
        return folder / VIEW_FILE if self.record else None
