"""In a building that repeats itself nobody can know a place before robots meet; from then on they must."""

from __future__ import annotations

import numpy as np

from bench.chaos.scene import Report, Scene

KNOWN_S = 30.0
"""A wrong place is given up at the latest so long after the two robots first saw each other while it was believed."""
SIGHT_M = 5.0
"""Robots nearer than this with no wall between them see each other, metres."""


def is_repeating(scene: Scene) -> bool:
    """Return whether a mission's world is made to look alike in several places."""
    return scene.mission.world is not None and scene.mission.world.name.startswith("hotel:")


class Repeats:
    """Follows wrong places of fault-free robots that have stood face to face."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._met_s: dict[tuple[str, str], float] = {}

    def judge(self, scene: Scene, one: str, other: str, is_right: bool) -> None:
        """Take whether a robot places another's map rightly now."""
        if is_right or scene.suffers(one) or scene.suffers(other):
            self._met_s.pop((one, other), None)
            return
        assert scene.team.simulation is not None
        a, b = (scene.T_world_base[name][:2] for name in (one, other))
        if np.hypot(*(a - b)) <= SIGHT_M and scene.team.simulation.radio.walls(a, b) == 0:
            self._met_s.setdefault((one, other), scene.now_s)
        met_s = self._met_s.get((one, other))
        if met_s is not None and scene.now_s - met_s > KNOWN_S:
            self._report.say(f"{one} places {other} wrongly {KNOWN_S:.0f} s after the two had met")
            del self._met_s[one, other]
