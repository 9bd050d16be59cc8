"""Recordings as files: the robots' parts joined to one, and opened in the viewer."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from mrslam.sim_driver.missions.run_files import VIEW_FILE
from mrslam.sim_driver.missions.run_folder import robots_of
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file

VIEWER_MEMORY = "1GB"
"""Most memory the viewer takes; it then forgets what is oldest."""
PORT = 9876
"""TCP port of the viewer on this machine: Rerun's own default, so that a viewer that runs already is taken."""
UP_WITHIN_S = 5.0
"""Time that a viewer may take to start, seconds, beside the five that it is given by its library."""
MAGIC = b"RRF2"
"""First bytes of a recording, as Rerun 0.22 and later write it."""


def join_recordings(parts: Sequence[Path | None], target: Path) -> None:
    """Make one recording of the robots' parts, which then go; raise ``InputError`` where that does not work."""
    there = [part for part in parts if part is not None and part.exists()]
    if not there:
        raise InputError(f"{target}: no robot recorded anything")
    target.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "rerun", "rrd", "merge", *(str(part) for part in there), "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(f"{target}: the recordings could not be joined ({done.stderr.strip()[-300:]})")
    for part in there:
        part.unlink()


def open_recording(run: Path) -> None:
    """Open a run's recording (or an .rrd file) in the viewer and wait until it is closed."""
    files = [str(path) for path in recordings(run)]
    command = [sys.executable, "-m", "rerun", "--memory-limit", VIEWER_MEMORY, *files]
    if subprocess.run(command, check=False).returncode != 0:
        raise InputError("the viewer could not open a window; copy the .rrd file to a machine that has a screen")


def recordings(run: Path) -> list[Path]:
    """Return a run's recording, or its robots' parts of it; raise ``InputError`` where there is none that is whole."""
    if not run.exists():
        raise InputError(f"{run}: no such folder of a run, and no such recording")
    found = [run] if is_file(run) else sorted(run.glob("*.rrd")) or _parts(run)
    if not found:
        raise InputError(
            f"{run}: holds no recording; make one with mrslam run ... --rrd {run / 'run.rrd'}, "
            f"or of a run that is over with mrslam run --from {run} --out OTHER --rrd {run / 'run.rrd'}"
        )
    for path in found:
        if not is_file(path):
            raise InputError(f"{path}: is no file")
        with path.open("rb") as file:
            if not file.read(4).startswith(MAGIC):
                raise InputError(f"{path}: not a recording of the viewer, or its beginning is damaged")
    return found


def _parts(run: Path) -> list[Path]:
    """Return what each of the run's robots recorded, where it was not joined."""
    robots = robots_of(run)
    parts = run.glob("*/view.rrd") if robots is None else (run / robot_id / VIEW_FILE for robot_id in robots)
    return sorted(part for part in parts if part.exists())


def start_viewer() -> str:
    """Start a viewer beside this process, or take the one that is there; return its address."""
    import rerun as rr

    beside = Path(sys.executable).with_name("rerun")  # mrslam may run without its environment on the path
    path = str(beside) if beside.exists() else None
    try:
        rr.spawn(
            port=PORT, connect=False, memory_limit=VIEWER_MEMORY, hide_welcome_screen=True, executable_path=path,
            recording=rr.RecordingStream("mrslam"),  # without one nothing is started
        )  # fmt: skip
    except (RuntimeError, OSError) as error:
        raise InputError(f"the viewer does not start ({error}); record with --rrd FILE instead") from error
    if not _listens(PORT):
        raise InputError("the viewer does not start, as where there is no screen; record with --rrd FILE instead")
    return f"rerun+http://127.0.0.1:{PORT}/proxy"


def _listens(port: int) -> bool:
    """Return whether somebody listens at a TCP port of this machine before ``UP_WITHIN_S`` are over."""
    end_s = time.monotonic() + UP_WITHIN_S
    while time.monotonic() < end_s:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
            return True
        time.sleep(0.1)
    return False
