"""The search of many maps, with alignments whose outcome is given: who is tried with whom, and what is kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from mrslam.alignment import Alignment, Prior, Rejection
from mrslam.merge import MergeConfig
from mrslam.merge.batch.all_pairs import try_every_pair
from mrslam.merge.batch.cluster_search import ClusterSearch
from mrslam.merge.batch.pair_aligner import PairAligner
from mrslam.merge.batch.vetting import doubt
from mrslam.merge.graph.edges import Pair
from mrslam.merge.graph.nodes import node_of
from mrslam.merge.team import TeamMap
from mrslam.spatial import OccupancyGrid, se2
from tests.merge.plans import alignment, building, part, truth

PLAN = building(11, rooms=7)
Fits = Callable[[frozenset[str], frozenset[str]], bool]


class Told(PairAligner):
    """Aligns maps where they truly lie, if it is told that they fit: two maps, or two fused ones."""

    def __init__(self, spans: Mapping[str, tuple[float, float]], pool: Executor, pairs: Sequence[Pair], fused: Fits):
        """``spans`` : by name, which share of the building's length a map shows, from and to."""
        rng = np.random.default_rng(1)
        self.poses = {name: se2.transform(*rng.uniform(-5, 5, 2), rng.uniform(-3, 3)) for name in spans}
        grids = {
            name: part(PLAN, *(round(x * PLAN.shape[1]) for x in span), se2.inverse(self.poses[name]))
            for name, span in spans.items()
        }
        super().__init__(grids, "auto", pool, MergeConfig())
        self.fitting, self.fused, self.confidence = set(pairs), fused, 0.9
        self.asked: list[tuple[frozenset[str], frozenset[str]]] = []
        self._names: dict[int, tuple[OccupancyGrid, frozenset[str], str]] = {}

    def _align(self, job: tuple[str, str, Prior | None]) -> Alignment | Rejection:
        a, b, _ = job
        return self._found(a, b, (a, b) in self.fitting or (b, a) in self.fitting)

    def _found(self, a: str, b: str, fits: bool) -> Alignment | Rejection:
        if fits:
            return alignment(truth(self.poses, a, b), self.confidence)
        return Rejection("told so", 0.1, None, "told")

    def cluster(self, names: Sequence[str]) -> TeamMap:
        made = super().cluster(names)
        self._names[id(made.grid)] = made.grid, frozenset(made.T_team_map), next(iter(made.T_team_map))
        return made

    def align_grids(self, one: OccupancyGrid, others: Sequence[OccupancyGrid]) -> list[Alignment | Rejection]:
        _, main, a = self._names[id(one)]
        found = []
        for other in others:
            _, joining, b = self._names[id(other)]
            self.asked.append((main, joining))
            found.append(self._found(a, b, self.fused(main, joining)))
        return found

    def edge_error(self, pair: Pair) -> float:
        return float(np.abs(se2.between(truth(self.poses, *pair), self.edges[pair].T_a_b)).max())


@pytest.fixture(scope="module")
def pool():
    with ThreadPoolExecutor(2) as made:
        yield made


def names(cluster: TeamMap) -> set[str]:
    return set(cluster.T_team_map)


def test_clusters_that_fit_by_one_member_only_come_together(pool: Executor) -> None:
    spans = {"a0": (0.0, 0.5), "a1": (0.2, 0.7), "b0": (0.3, 0.8), "b1": (0.5, 1.0)}

    def fused(main: frozenset[str], other: frozenset[str]) -> bool:
        return main != {"b0", "b1"} or other == {"a1"}

    pairs = Told(spans, pool, [("a0", "a1"), ("b0", "b1")], fused)
    ClusterSearch(pairs).run()
    assert ({"b0", "b1"}, {"a0", "a1"}) in pairs.asked  # as wholes first
    assert names(pairs.cluster(sorted(spans))) == set(spans)
    assert max(pairs.edge_error(pair) for pair in pairs.edges) < 1e-6


def test_a_map_that_did_not_fit_a_cluster_is_tried_again_once_that_has_grown(pool: Executor) -> None:
    spans = {"a": (0.0, 0.4), "b": (0.1, 0.5), "c": (0.7, 1.0), "d": (0.3, 0.8)}

    def fused(main: frozenset[str], other: frozenset[str]) -> bool:
        return not (main == {"a", "b"} and other == {"c"})

    pairs = Told(spans, pool, [("a", "b")], fused)
    ClusterSearch(pairs).run()
    asked = [main for main, other in pairs.asked if other == {"c"}]
    assert asked[:2] == [{"a", "b"}, {"a", "b", "d"}]
    assert names(pairs.cluster(sorted(spans))) == set(spans)


def test_what_fits_only_as_a_whole_is_kept_as_an_alignment_of_the_two_that_share_most(pool: Executor) -> None:
    spans = {"a": (0.0, 0.4), "b": (0.2, 0.6), "c": (0.7, 1.0), "d": (0.5, 0.9)}
    pairs = Told(spans, pool, [("a", "b"), ("c", "d")], lambda main, other: True)
    ClusterSearch(pairs).run()
    assert set(pairs.edges) == {("a", "b"), ("b", "d"), ("c", "d")}
    assert pairs.edge_error(("b", "d")) < 1e-6


def test_members_of_a_cluster_are_aligned_with_all_that_they_share_wall_with(pool: Executor) -> None:
    spans = {"a": (0.0, 0.6), "b": (0.2, 0.8), "c": (0.4, 1.0)}
    pairs = Told(spans, pool, [("a", "b"), ("b", "c"), ("a", "c")], lambda main, other: True)
    ClusterSearch(pairs).run()
    assert set(pairs.edges) == {("a", "b"), ("b", "c"), ("a", "c")}


def test_a_bridge_goes_where_the_merged_maps_of_its_sides_do_not_fit(pool: Executor) -> None:
    spans = {"a": (0.0, 0.5), "b": (0.2, 0.6), "c": (0.55, 1.0)}
    kept = {}
    for sides_fit in (True, False):
        pairs = Told(spans, pool, [("a", "b"), ("b", "c")], lambda main, other, fits=sides_fit: fits)
        pairs.confidence = 0.6  # not so sure that it stands alone
        ClusterSearch(pairs).run()
        kept[sides_fit] = set(pairs.edges)
    assert kept[True] == {("a", "b"), ("b", "c")}
    assert len(kept[False]) < 2
    (_, reason) = next(iter(pairs.rejections.items()))
    assert "the merged maps of both sides speak against it: told so" in reason.reason


AS_PLACED = (0.0, 0.0)
REFUSED = Rejection("two places", 0.4, None, "told")


@pytest.mark.parametrize(
    ("confidence", "fused", "off", "against"),
    [
        (0.6, "accepted", AS_PLACED, ""),
        (0.9, "accepted", (0.9, 0.0), ""),
        (0.9, "accepted", (0.0, 0.11), ""),
        (0.9, "accepted", (3.0, 0.0), "they fit better 3.0 m and 0.0 deg away"),
        (0.9, "accepted", (1.1, 0.0), "they fit better 1.1 m and 0.0 deg away"),
        (0.9, "accepted", (0.0, 0.13), "they fit better 0.0 m and 7.4 deg away"),
        (0.75, "proposed", AS_PLACED, ""),
        (0.74, "proposed", AS_PLACED, "two places"),
        (0.9, "proposed", (1.1, 0.0), "two places"),
        (0.9, "nowhere", AS_PLACED, "two places"),
    ],
)
def test_a_bridge_stands_where_the_merged_maps_of_its_sides_fit_as_they_are_placed(
    pool: Executor, confidence: float, fused: str, off: tuple[float, float], against: str
) -> None:
    """``off`` : metres and radians about the middle of a side that its merged map fits beside its place."""
    pairs = Told({"a": (0.0, 0.5), "b": (0.2, 0.6), "c": (0.55, 1.0)}, pool, [("a", "b")], lambda main, other: True)
    pairs.align_pairs([("a", "b", None)])
    place = {"a": se2.IDENTITY, "c": truth(pairs.poses, "a", "c")}
    centre = np.array([*node_of(pairs.cluster(["c"]).grid).centre_m, 0.0])
    beside = se2.compose(se2.compose(centre, np.array([off[0], 0.0, off[1]])), se2.inverse(centre))
    T_a_c = se2.compose(place["c"], beside)
    found = alignment(T_a_c) if fused == "accepted" else replace(REFUSED, T_a_b=T_a_c if fused == "proposed" else None)
    pairs.align_grids = lambda one, others: [found]  # type: ignore[method-assign]
    said = doubt(pairs, confidence, [["a", "b"], ["c"]], place)
    assert (said is None) is (against == "")
    if said is not None:
        assert said.reason.startswith(
            f"accepted by itself, but the merged maps of both sides speak against it: {against}"
        )


class Misled(Told):
    """Finds the maps a and b where their walls contradict each other."""

    def _align(self, job: tuple[str, str, Prior | None]) -> Alignment | Rejection:
        if job[:2] == ("a", "b"):
            return alignment(se2.compose(truth(self.poses, "a", "b"), np.array([0.0, 2.0, 0.3])), self.confidence)
        return super()._align(job)


@pytest.mark.parametrize("search", [lambda pairs: ClusterSearch(pairs).run(), lambda pairs: try_every_pair(pairs, {})])
def test_bridges_of_what_falls_off_a_cluster_are_checked_too(pool: Executor, search: Callable[[Told], None]) -> None:
    spans = {"a": (0.0, 0.5), "b": (0.0, 0.5), "c": (0.2, 0.6), "d": (0.55, 1.0)}
    pairs = Misled(spans, pool, [("b", "c"), ("c", "d")], lambda main, other: False)
    pairs.confidence = 0.6
    search(pairs)
    assert set(pairs.cluster(["a", "b"]).T_team_map) == {"a"}
    assert ("c", "d") not in pairs.edges or ("b", "c") not in pairs.edges


def test_what_further_overlaps_show_to_be_wrong_falls_off_a_cluster_as_a_part_of_its_own(pool: Executor) -> None:
    spans = {"a": (0.0, 0.5), "b": (0.0, 0.5), "c": (0.2, 0.6), "d": (0.55, 1.0)}
    pairs = Misled(spans, pool, [("a", "c"), ("b", "c"), ("c", "d")], lambda main, other: True)
    pairs.align_pairs([("b", "c", None), ("c", "d", None)])
    pairs.edges["a", "b"] = alignment(truth(pairs.poses, "a", "b"), 0.9)
    whole = pairs.cluster(sorted(spans))
    assert names(whole) == set(spans)
    pairs.fitting.clear()
    del pairs.edges["a", "b"]
    pairs.align_pairs([("a", "b", None)])
    assert [names(part) for part in ClusterSearch(pairs)._densify(whole)] == [{"a"}, {"b", "c", "d"}]


def test_a_pair_is_kept_under_its_names_in_order_and_is_rejected_no_more(pool: Executor) -> None:
    pairs = Told({"a": (0.0, 0.6), "b": (0.2, 0.8)}, pool, [], lambda main, other: False)
    assert pairs.align_pairs([("b", "a", None)]) == []
    assert set(pairs.rejections) == {("a", "b")}
    pairs.fitting = {("a", "b")}
    assert pairs.align_pairs([("b", "a", None)]) == [("a", "b")]
    assert pairs.rejections == {} and pairs.edge_error(("a", "b")) < 1e-9
