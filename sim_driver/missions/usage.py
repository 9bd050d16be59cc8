"""What a robot's process took of the machine."""

from __future__ import annotations

import contextlib
import json
import resource
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrslam.sim_driver.missions.run_files import USAGE_FILE
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.full_disk import unwritten_is_logged

if TYPE_CHECKING:
    from mrslam.agent import ProcessShell


def write_usage(shell: ProcessShell, folder: Path) -> None:
    """Write CPU seconds, peak memory and the age of scans when they had been mapped; log where that cannot be."""
    usage = {
        "cpu_s": round(time.process_time(), 3),
        "peak_rss_mb": round(peak_kb() / 1024, 1),
        "scan_age_ms": shell.scan_age_ms(),
    }
    path = folder / USAGE_FILE
    with unwritten_is_logged(shell.runner.agent.robot_id, path):
        write_text(path, json.dumps(usage) + "\n")


def read_usage(folder: Path) -> dict[str, Any] | None:
    """Return what :func:`write_usage` left in a robot's folder, None where there is nothing, or nothing whole."""
    try:
        usage = json.loads((folder / USAGE_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return usage if isinstance(usage, dict) else None


def peak_kb() -> int:
    """Return this process's peak memory; the resource module's figure counts what its parent held when it started."""
    with contextlib.suppress(OSError, ValueError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
