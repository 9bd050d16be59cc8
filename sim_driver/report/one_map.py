"""What bending did: the maps laid over each other as alignment found them, and the map that the joint solution made."""

from __future__ import annotations

from collections import Counter
from typing import Any

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.run_files import TEAM_IMAGE_FILE, TEAM_OVERLAY_FILE
from mrslam.sim_driver.report.png import data_uri


def one_map_data(run: RunResults) -> dict[str, Any] | None:
    """Return both pictures as one robot has them, the first by id that has, and the matches of each pair; else None."""
    for robot_id, robot in run.robots.items():
        before, after = run.picture(robot_id, TEAM_OVERLAY_FILE), run.picture(robot_id, TEAM_IMAGE_FILE)
        if before is None or after is None:
            continue
        kept = Counter(f"{a}-{b}" for a, b, _, _, believed in robot.get("ties", []) if believed)
        dropped = Counter(f"{a}-{b}" for a, b, _, _, believed in robot.get("ties", []) if not believed)
        return {
            "robot": robot_id,
            "before": data_uri(before),
            "after": data_uri(after),
            "ties": [[pair, kept[pair], dropped[pair]] for pair in sorted(kept | dropped)],
        }
    return None
