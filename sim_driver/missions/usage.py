"""What a robot's process took of the machine."""

from __future__ import annotations

import contextlib
import json
import resource
import time
from pathlib import Path
from typing import TYPE_CHECKING

from mrslam.spatial.files.atomic import write_text

if TYPE_CHECKING:
    from mrslam.agent import ProcessShell

USAGE = "usage.json"
"""File in the robot's folder."""


def write_usage(shell: ProcessShell, folder: Path) -> None:
    """Write CPU seconds, peak memory and the age of scans when they had been mapped."""
    usage = {
        "cpu_s": round(time.process_time(), 3),
        "peak_rss_mb": round(peak_kb() / 1024, 1),
        "scan_age_ms": shell.scan_age_ms(),
    }
    write_text(folder / USAGE, json.dumps(usage) + "\n")


def peak_kb() -> int:
    """Return this process's peak memory; the resource module's figure counts what its parent held when it started."""
    with contextlib.suppress(OSError, ValueError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
