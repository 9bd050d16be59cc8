import numpy as np
import pytest

from mrslam.merge import MergeConfig, TeamGraph, team_graph
from mrslam.merge.graph.consistency import SEEN_CONFIDENCE
from mrslam.merge.graph.solve import jointly
from mrslam.spatial import InputError, OccupancyGrid, se2
from tests.merge.plans import alignment, truth


def square(metres: float) -> OccupancyGrid:
    cells = round(metres / 0.1)
    return OccupancyGrid(np.zeros((cells, cells), dtype=np.int8), 0.1)


class Graph(TeamGraph):
    """A team graph with the alignments that a test has joined so far."""

    def __init__(self, config: MergeConfig | None = None) -> None:
        super().__init__(config)
        self.found = {}

    def place(self, *args, **kwargs):
        return super().place(self.found, *args, **kwargs)


def graph_of(sizes: dict[str, float], config: MergeConfig | None = None) -> tuple[Graph, dict[str, np.ndarray]]:
    rng = np.random.default_rng(len(sizes))
    graph = Graph(config)
    poses = {}
    for robot_id, metres in sizes.items():
        graph.set_map(robot_id, square(metres))
        poses[robot_id] = se2.transform(*rng.uniform(-9, 9, 2), rng.uniform(-3, 3))
    return graph, poses


def join(graph, poses, a, b, confidence=0.9, off=(0.0, 0.0, 0.0)):
    graph.found[a, b] = alignment(truth(poses, a, b) + np.array(off), confidence)


def two_groups(component: str) -> Graph:
    graph, poses = graph_of({"a": 10, "b": 10, "c": 2, "d": 2, "e": 2}, MergeConfig(component=component))
    join(graph, poses, "a", "b")
    join(graph, poses, "c", "d")
    join(graph, poses, "e", "d")
    return graph


@pytest.mark.parametrize(("component", "placed"), [("area", ["a", "b"]), ("count", ["c", "d", "e"])])
def test_the_largest_component_is_placed_and_the_others_are_named(component, placed):
    placement = two_groups(component).place()
    assert list(placement.T_team_map) == placed
    assert placement.anchor == placed[0]
    assert sorted([*placement.T_team_map, *placement.unplaced]) == list("abcde")
    if component == "area":
        assert placement.unplaced["d"] == "fits only c, e, not placed either"


@pytest.mark.parametrize("component", ["area", "count"])
def test_of_components_alike_the_one_that_was_placed_before_stays(component):
    graph, poses = graph_of({"a": 5, "b": 5, "c": 5, "d": 5}, MergeConfig(component=component))
    join(graph, poses, "a", "b")
    join(graph, poses, "c", "d")
    assert list(graph.place().T_team_map) == ["a", "b"]
    for before, placed in (("b", ["a", "b"]), ("d", ["c", "d"]), ("c", ["c", "d"])):
        placement = graph.place(before=before)
        assert list(placement.T_team_map) == placed and placement.anchor == before


def test_the_anchors_component_is_placed_in_the_anchors_frame():
    graph = two_groups("area")
    placement = graph.place(anchor="d")
    assert list(placement.T_team_map) == ["c", "d", "e"]
    assert placement.anchor == "d"
    assert (placement.T_team_map["d"] == 0.0).all()
    alone = graph.place(anchor="nobody")
    assert alone.T_team_map == {}
    assert alone.unplaced == dict.fromkeys("abcde", "nobody has no map")


def test_a_robot_that_fits_nothing_says_so():
    graph, poses = graph_of({"a": 5, "b": 5, "c": 5})
    join(graph, poses, "a", "b")
    assert graph.place().unplaced == {"c": "no accepted alignment"}
    join(graph, poses, "a", "c")
    assert graph.place().unplaced == {}


def test_alignments_below_the_asked_confidence_are_not_used():
    graph, poses = graph_of({"a": 5, "b": 5}, MergeConfig(min_confidence=0.8))
    join(graph, poses, "a", "b", confidence=0.7)
    placement = graph.place()
    assert placement.dropped == {("a", "b"): "confidence 0.70 < 0.80"}
    assert "confidence 0.70 < 0.80" in placement.unplaced["b"]


def test_an_edge_shown_wrong_by_a_third_robot_is_dropped_and_the_team_heals():
    graph, poses = graph_of({"a": 8, "b": 8, "c": 8})
    join(graph, poses, "a", "b", confidence=0.6, off=(4.0, 1.0, 0.0))
    wrong = graph.place()
    assert se2.difference(wrong.T_team_map["b"], truth(poses, "a", "b"))[0] > 3.0
    join(graph, poses, "a", "c")
    join(graph, poses, "b", "c")
    healed = graph.place()
    assert list(healed.dropped) == [("a", "b")]
    assert "a-b-c" in healed.dropped["a", "b"]
    for x in "abc":
        np.testing.assert_allclose(healed.T_team_map[x], truth(poses, "a", x), atol=1e-6)


def test_what_robots_saw_of_each_other_is_dropped_last_however_many_look_alikes_agree():
    """Robots c and d saw each other, and a both b and c; for c and d b lies in a look-alike, the same for both."""
    graph, poses = graph_of({"a": 8, "b": 8, "c": 8, "d": 8})
    for pair in ("ab", "ac", "cd"):
        join(graph, poses, *pair, confidence=SEEN_CONFIDENCE)
    elsewhere = poses | {"b": se2.compose(poses["b"], np.array([8.0, 0.0, 0.0]))}
    join(graph, elsewhere, "b", "c", confidence=0.89)
    join(graph, elsewhere, "b", "d", confidence=0.84)
    placement = graph.place()
    assert ("a", "b") not in placement.dropped and ("b", "c") in placement.dropped
    for x in "abcd":
        np.testing.assert_allclose(placement.T_team_map[x], truth(poses, "a", x), atol=1e-6)
    # Where robots saw each other at places that cannot all be right, the least supported goes as ever.
    join(graph, elsewhere, "b", "c", confidence=SEEN_CONFIDENCE)
    assert ("a", "b") in graph.place().dropped


def test_edges_before_maps_and_removed_maps():
    graph, poses = graph_of({"a": 5, "b": 5})
    poses["z"] = se2.transform(1.0, 2.0, 3.0)
    join(graph, poses, "a", "z")
    assert "z" not in graph.place().unplaced
    graph.set_map("z", square(5))
    assert "z" in graph.place().T_team_map
    graph.remove_map("z")
    assert graph.robots == ["a", "b"]
    assert graph.place().edges == ()


def test_known_poses_place_maps_without_overlap():
    graph, poses = graph_of({"a": 5, "b": 5, "c": 5})
    graph.set_known_poses({"a": poses["a"], "b": poses["b"]})
    placement = graph.place()
    assert placement.anchor is None
    assert list(placement.T_team_map) == ["a", "b"]
    for x in "ab":
        np.testing.assert_allclose(placement.T_team_map[x], poses[x], atol=1e-9)
    join(graph, poses, "b", "c")
    placement = graph.place()
    np.testing.assert_allclose(placement.T_team_map["c"], poses["c"], atol=1e-9)
    assert len(placement.edges) == 1


def test_alignments_correct_known_poses_within_their_doubt_and_never_beat_them():
    graph, poses = graph_of({"a": 5, "b": 5})
    graph.set_known_poses({"a": poses["a"], "b": poses["b"] + [0.2, 0.0, 0.0]})
    join(graph, poses, "a", "b")
    found = graph.place()
    assert se2.difference(se2.between(found.T_team_map["a"], found.T_team_map["b"]), truth(poses, "a", "b"))[0] < 0.02
    join(graph, poses, "a", "b", off=(5.0, 0.0, 0.0))
    found = graph.place()
    assert list(found.dropped) == [("a", "b")]
    assert "known poses" in found.dropped["a", "b"]
    assert found.edges == ()


def test_known_poses_stand_though_the_maps_contradict_each_other():
    graph, poses = graph_of({"a": 5, "b": 5})
    graph.set_known_poses(poses)
    placement = graph.place(conflict=lambda *_: "walls on free space")
    assert list(placement.T_team_map) == ["a", "b"] and placement.dropped == {}


def test_known_poses_in_an_anchors_frame():
    graph, poses = graph_of({"a": 5, "b": 5})
    graph.set_known_poses(poses)
    placement = graph.place(anchor="b")
    np.testing.assert_allclose(placement.T_team_map["a"], truth(poses, "b", "a"), atol=1e-9)


def test_content_that_contradicts_drops_the_weakest_edge_between():
    graph, poses = graph_of({"a": 5, "b": 5, "c": 5})
    join(graph, poses, "a", "b", confidence=0.9)
    join(graph, poses, "b", "c", confidence=0.6)

    def far(a, b, T, hops):
        return "walls on free space" if (a, b, hops) == ("a", "c", 2) else None

    placement = graph.place(conflict=far)
    assert placement.dropped == {("b", "c"): "contradicted: placed through it, walls on free space"}
    assert "walls on free space" in placement.unplaced["c"]
    direct = graph.place(conflict=lambda a, b, T, hops: "no" if (a, b) == ("a", "b") else None)
    assert direct.dropped == {("a", "b"): "contradicted: no"}


def test_maps_are_placed_and_judged_along_the_surest_alignments():
    """a and d contradict each other: an edge of the way a-b-c-d is wrong, not one of the way over the weak a-c."""
    graph, poses = graph_of({"a": 5, "b": 5, "c": 5, "d": 5})
    for a, b, confidence in (("a", "b", 0.9), ("b", "c", 0.8), ("a", "c", 0.6), ("c", "d", 0.7)):
        join(graph, poses, a, b, confidence)
    placement = graph.place(conflict=lambda a, b, T, hops: "walls on free space" if (a, b) == ("a", "d") else None)
    assert list(placement.dropped) == [("c", "d")]
    assert list(placement.T_team_map) == ["a", "b", "c"]


def test_nonsense_is_refused_in_words():
    graph = TeamGraph()
    with pytest.raises(InputError, match="id must not be empty"):
        graph.set_map("", square(1))
    with pytest.raises(InputError, match="known pose of a must be x"):
        graph.set_known_poses({"a": [1.0, 2.0]})


def test_an_empty_team_is_nothing():
    placement = TeamGraph().place({})
    assert (placement.anchor, placement.T_team_map, placement.unplaced, placement.edges) == (None, {}, {}, ())


def test_what_was_solved_is_not_solved_again_and_whatever_changes_is(monkeypatch: pytest.MonkeyPatch) -> None:
    solved = []
    monkeypatch.setattr(team_graph, "jointly", lambda *asked: solved.append(asked) or jointly(*asked))
    graph, poses = graph_of({"a": 10.0, "b": 10.0, "c": 10.0})
    for a, b, off in (("a", "b", 0.0), ("b", "c", 0.0), ("a", "c", 0.05)):
        join(graph, poses, a, b, off=(off, 0.0, 0.0))
    first = graph.place("a")
    first.T_team_map["b"][0] += 9.0  # what a caller does with it is its own affair
    again = graph.place("a")
    assert len(solved) == 1 and again.T_team_map["b"][0] != first.T_team_map["b"][0]
    for change in (
        lambda: join(graph, poses, "a", "c", off=(0.06, 0.0, 0.0)),
        lambda: join(graph, poses, "a", "c", 0.8, off=(0.06, 0.0, 0.0)),
    ):
        change()
        before, now = len(solved), graph.place("a")
        fresh, _ = graph_of({"a": 10.0, "b": 10.0, "c": 10.0})
        fresh.found = graph.found
        assert len(solved) == before + 1
        assert {x: T.tobytes() for x, T in now.T_team_map.items()} == {
            x: T.tobytes() for x, T in fresh.place("a").T_team_map.items()
        }
    assert graph.place("b").anchor == "b" and np.allclose(graph.place("b").T_team_map["b"], 0.0)


@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_known_poses_are_as_sure_as_set_however_little_alignments_are_believed(scale: float) -> None:
    graph, _ = graph_of({"a": 5, "b": 5}, MergeConfig(covariance_scale=scale, known_pose_sigma_m=0.05))
    graph.set_known_poses({"a": np.zeros(3), "b": np.array([3.0, 0.0, 0.0])})
    graph.found["a", "b"] = alignment(np.array([3.1, 0.0, 0.0]), sigma_m=0.05, sigma_rad=0.01)
    T_a, T_b = (graph.place().T_team_map[x] for x in "ab")
    moved_m = abs(T_b[0] - T_a[0] - 3.0)
    assert 0.04 < moved_m < 0.08 if scale == 1.0 else moved_m < 0.005
