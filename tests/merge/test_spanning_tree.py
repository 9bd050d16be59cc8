"""Maps are placed, and contradictions blamed, along the alignments of most confidence."""

from __future__ import annotations

import numpy as np

from mrslam.merge import TeamGraph
from mrslam.spatial import OccupancyGrid, se2
from tests.merge.plans import alignment, truth


def test_a_contradiction_is_blamed_on_the_weakest_of_the_best_alignments_between() -> None:
    graph = TeamGraph()
    poses = {"a": np.zeros(3), "b": se2.transform(3.0, 1.0, 0.4), "c": se2.transform(-2.0, 4.0, -1.2)}
    for robot_id in poses:
        graph.set_map(robot_id, OccupancyGrid(np.zeros((50, 50), dtype=np.int8), 0.1))
    confidence = {("a", "b"): 0.9, ("b", "c"): 0.8, ("a", "c"): 0.3}
    found = {pair: alignment(truth(poses, *pair), value) for pair, value in confidence.items()}

    def conflict(a: str, b: str, T_a_b: se2.Transform, between: int) -> str | None:
        return "walls on floor" if (a, b) == ("a", "c") and between == 2 else None

    placement = graph.place(found, anchor="a", conflict=conflict)
    assert placement.dropped == {("b", "c"): "contradicted: placed through it, walls on floor"}
    assert sorted(placement.T_team_map) == ["a", "b", "c"]


def test_in_loops_of_four_the_alignment_that_is_wrong_goes_and_no_other() -> None:
    rng = np.random.default_rng(0)
    poses = {robot_id: se2.transform(*rng.uniform(-9, 9, 2), rng.uniform(-3, 3)) for robot_id in "abxyz"}
    graph = TeamGraph()
    for robot_id in poses:
        graph.set_map(robot_id, OccupancyGrid(np.zeros((50, 50), dtype=np.int8), 0.1))
    confidence = {"ax": 0.9, "ay": 0.9, "az": 0.2, "bx": 0.8, "by": 0.7, "bz": 0.4}
    found = {(a, b): alignment(truth(poses, a, b), value) for (a, b), value in confidence.items()}
    found["b", "y"] = alignment(truth(poses, "b", "y") + np.array([3.0, 0.0, 0.0]), confidence["by"])
    assert list(graph.place(found).dropped) == [("b", "y")]
