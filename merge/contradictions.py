"""Whether placed maps contradict each other; an answer is cached while neither map changes."""

from __future__ import annotations

import numpy as np

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import Pair
from mrslam.merge.grids.agreement import Walls, compare
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.ways import Ways
from mrslam.spatial import se2

_Compared = tuple[TiledGrid, TiledGrid, str | None]
REMEMBERED = 4
"""Comparisons kept for each pair of robots: the alignment tried, the placement, and one of each from before."""


class Contradictions:
    """Compares placed maps under the limits ``merge.contradiction_*``, and caches the answers."""

    def __init__(self, config: MergeConfig) -> None:
        self.config = config
        self._walls: dict[str, Walls] = {}
        self._compared: dict[Pair, dict[tuple[bytes, int], _Compared]] = {}
        self._bent: dict[Pair, tuple[Ways | None, TiledGrid, TiledGrid, str | None]] = {}

    def forget(self, robot_id: str) -> None:
        """Forget a robot's maps, and what they were compared with."""
        self._walls.pop(robot_id, None)
        self._compared = {pair: held for pair, held in self._compared.items() if robot_id not in pair}
        self._bent = {pair: held for pair, held in self._bent.items() if robot_id not in pair}

    def against(self, a: str, b: str, maps: tuple[TiledGrid, TiledGrid], T_a_b: se2.Transform, hops: int) -> str | None:
        """Return how two robots' maps contradict each other placed like this, or None.

        ``T_a_b`` : ``(3,)``, where b's map is placed in a's. ``hops`` : the number of alignments on the path between
        the two, whose errors add up: the tolerance grows with its square root.
        """
        key = (np.asarray(T_a_b).tobytes(), hops)
        held = self._compared.setdefault((a, b), {})
        if key in held and held[key][0] is maps[0] and held[key][1] is maps[1]:
            return held[key][2]
        near_m = self.config.contradiction_tolerance_m * float(np.sqrt(hops))
        against = self._compare(a, b, (self._prepared(a, maps[0]), self._prepared(b, maps[1])), T_a_b, near_m)
        held[key] = (*maps, against)
        for old in list(held)[:-REMEMBERED]:
            del held[old]
        return against

    def of_bent(
        self, a: str, b: str, bent: BentTeam, maps: tuple[TiledGrid, TiledGrid], T_a_b: se2.Transform
    ) -> str | None:
        """Return how two bent maps contradict each other where ties hold them, or None; arguments as for the others.

        Tied by their own scans, there are no alignments between them whose errors would add up.
        """
        held = self._bent.get((a, b))
        if held is None or held[0] is not bent.ways or held[1] is not maps[0] or held[2] is not maps[1]:
            parts = bent.part(a, b, maps[0]), bent.part(b, a, maps[1])
            against = self._compare(
                a, b, (Walls(parts[0]), Walls(parts[1])), T_a_b, self.config.contradiction_tolerance_m
            )
            held = self._bent[a, b] = (bent.ways, *maps, against)
        return held[3]

    def _compare(self, a: str, b: str, walls: tuple[Walls, Walls], T_a_b: se2.Transform, near_m: float) -> str | None:
        found = compare(*walls, T_a_b, near_m)
        if found.share_against <= self.config.contradiction_share or found.against_m < self.config.contradiction_min_m:
            return None
        share = 100 * found.share_against
        return f"{found.against_m:.1f} m of wall of {a} and {b} ({share:.0f} %) is on the other's free space"

    def _prepared(self, robot_id: str, tiled: TiledGrid) -> Walls:
        held = self._walls.get(robot_id)
        if held is None or held.tiled is not tiled:
            held = self._walls[robot_id] = Walls(tiled)
        return held
