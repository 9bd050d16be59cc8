"""Where robots place each other: it is true, and what a liar says is not believed."""

from __future__ import annotations

import numpy as np

from bench.chaos.repeats import Repeats, is_repeating
from bench.chaos.scene import SPOILS, Report, Scene
from mrslam.agent import Agent
from mrslam.merge.graph.tree import path
from mrslam.sim_driver.evaluate.truth import FALSE_MERGE_DEG, FALSE_MERGE_M, is_false_merge
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

ALIKE = 0.9
"""A world looks the same after a motion that lays this much of its walls on its walls."""
KNOWABLE_M = 2.0
"""Who has seen so much true wall stand on true floor has seen that it does not, metres."""
LIE_PRECISION = 0.6
"""A liar's map that lies on the true walls with less of its own is a false merge."""
LIE_PLACE_M = 1.0
"""A liar is believed that is shown farther from where it truly is, metres: a turned map fits the walls, and shows its
robot and all its way elsewhere."""


class Places:
    """Holds every placement against where the maps' frames are in the world, once a second."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._repeats = Repeats(report)

    def step(self, scene: Scene) -> None:
        """Look at all placements."""
        if scene.is_due(1):
            self._all(scene, at_end=False)

    def at_end(self, scene: Scene) -> None:
        """Look once more: who has seen by now that a place cannot be must not believe it."""
        self._all(scene, at_end=True)

    def _all(self, scene: Scene, *, at_end: bool) -> None:
        for robot_id, agent in scene.agents.items():
            own = scene.frame(agent, robot_id)
            if own is None or scene.suffers(robot_id, "liar", *SPOILS):
                continue
            for other, T_own_other in agent.T_team_map.items():
                there = scene.frame(agent, other)
                if other == robot_id or there is None or scene.suffers(other, *SPOILS):
                    continue
                if scene.suffers(other, "liar"):
                    self._lie(scene, agent, (other, there), se2.compose(own, T_own_other))
                elif not _leads_over_spoilt(scene, agent, other):
                    self._place(scene, agent, (robot_id, own), (other, there), at_end=at_end)

    def _lie(self, scene: Scene, agent: Agent, liar: tuple[str, Transform], T_world_other: Transform) -> None:
        """Say what of a liar's map is not true: its walls, or where its robot is by it. ``liar`` : id, true frame."""
        other, T_world_map = liar
        share = scene.judge.occupied_precision(agent.node.store.maps[other].map.to_grid(), T_world_other)
        if share < LIE_PRECISION:
            self._report.say(f"{agent.robot_id} believes the lie of {other}: {100 * share:.0f} % of its walls are true")
        T_world_base = scene.T_world_base[other]
        shown = se2.compose(T_world_other, se2.between(T_world_map, T_world_base))
        off_m, _ = se2.difference(shown, T_world_base)
        self._report.figures["liar"].append(
            [agent.robot_id, other, round(scene.now_s, 1), round(share, 3), round(off_m, 2)]
        )
        if off_m > LIE_PLACE_M:
            self._report.say(
                f"{agent.robot_id} believes the lie of {other}, which is {off_m:.1f} m from where it is shown"
            )

    def _place(
        self, scene: Scene, agent: Agent, own: tuple[str, Transform], other: tuple[str, Transform], *, at_end: bool
    ) -> None:
        """Where the whole world, moved as the map is misplaced, looks the same, nobody can know who has not seen where
        it does not. Who has must, at the end.
        """  # noqa: D205
        T_own_other = agent.T_team_map[other[0]]
        off_m, off_rad = se2.difference(T_own_other, se2.between(own[1], other[1]))
        off_deg = float(np.degrees(off_rad))
        if is_repeating(scene):
            self._repeats.judge(scene, own[0], other[0], not is_false_merge(off_m, off_deg))
            return
        moved = se2.compose(se2.compose(own[1], T_own_other), se2.inverse(other[1]))
        strayed_m = scene.strayed_m(agent, own[0]) + scene.strayed_m(agent, other[0])
        if off_m > FALSE_MERGE_M + strayed_m or off_deg > FALSE_MERGE_DEG:
            is_alike = scene.judge.occupied_precision(scene.judge.world, moved) >= ALIKE
            if is_alike and not (at_end and _could_know(scene, agent, own, other, moved)):
                return
            self._report.say(f"{own[0]} places {other[0]} {off_m:.2f} m and {off_deg:.1f} deg off")
        self._report.figures["off"].append(
            [own[0], other[0], round(scene.now_s, 1), round(off_m, 3), round(off_deg, 2)]
        )


def _could_know(
    scene: Scene, agent: Agent, own: tuple[str, Transform], other: tuple[str, Transform], moved: Transform
) -> bool:
    """Return whether two maps, one moved in the world, show enough that cannot be at one place."""
    one, two = ((agent.node.store.maps[name].map.to_grid(), T_world_map) for name, T_world_map in (own, other))
    contradiction_m = scene.judge.contradiction_m
    return contradiction_m(two, one, moved) + contradiction_m(one, two, se2.inverse(moved)) >= KNOWABLE_M


def _leads_over_spoilt(scene: Scene, agent: Agent, other: str) -> bool:
    """Return whether a robot places another only by way of one whose own map may be torn.

    Nobody can know that before the two fit each other.
    """
    pairs = [edge.pair for edge in agent.team.layout.placement.edges]
    sound = [pair for pair in pairs if not any(scene.suffers(name, *SPOILS) for name in pair)]
    return len(sound) < len(pairs) and not path(sound, agent.robot_id, other)
