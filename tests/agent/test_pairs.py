from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.config import AgentConfig
from mrslam.agent.pairs import UNCONFIRMED, WEAK, PairBook
from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.spatial import OccupancyGrid, TiledMap, se2

S = 1_000_000_000


def tiled(cells: int, revision: int = 1) -> TiledMap:
    return TiledMap.from_grid(OccupancyGrid(np.zeros((cells, cells), dtype=np.int8), 0.05), revision)


def found(x: float = 1.0, confidence: float = 0.9) -> Alignment:
    return Alignment(np.array([x, 0.0, 0.0]), confidence, Evidence(), np.eye(3) * 1e-4, "auto")


def book(*robots: str) -> PairBook:
    made = PairBook("r2", AgentConfig(align_interval_s=10.0, align_growth=0.1))
    for robot in robots:
        made.map_changed(robot, (1, 1), tiled(64))
    return made


PLACED = {"r1": se2.IDENTITY, "r2": np.array([1.0, 0.0, 0.0])}


def merged() -> PairBook:
    pairs = book("r1", "r2")
    for t in (0, 10):
        job = pairs.next_job(t * S, {})
        assert job is not None
        pairs.settle(job, found(), t * S)
    assert pairs.pairs["r1", "r2"].status == "accepted"
    return pairs


def next_pair(pairs: PairBook, t_s: float) -> tuple[str, str] | None:
    job = pairs.next_job(round(t_s * S), {})
    return None if job is None else (job.a, job.b)


def test_pairs_with_the_own_map_come_first_and_are_named_in_order() -> None:
    pairs = book("r3", "r1", "r2")
    assert next_pair(pairs, 0) == ("r1", "r2")
    assert set(pairs.pairs) == {("r1", "r2"), ("r1", "r3"), ("r2", "r3")}


def test_an_alignment_is_believed_when_a_second_one_agrees() -> None:
    pairs = book("r1", "r2")
    first = pairs.next_job(0, {})
    assert first is not None
    verdict = pairs.settle(first, found(), 0)
    assert verdict.edge is None and verdict.reason == UNCONFIRMED
    assert next_pair(pairs, 5) is None  # too soon
    second = pairs.next_job(10 * S, {})
    assert second is not None and second.attempt == first.attempt + 1
    verdict = pairs.settle(second, found(1.05), 10 * S)
    assert verdict.edge is not None and verdict.is_new
    row = pairs.pairs["r1", "r2"].row("r1", "r2")
    assert row["status"] == "accepted" and row["accepted_at_s"] == 10.0 and row["T_a_b"] == [1.05, 0.0, 0.0]


def walls(matched_m: float, contradicted_m: float) -> Evidence:
    side = WallEvidence(matched_m=matched_m, contradicted_m=contradicted_m)
    return Evidence(a=side, b=side)


def weak(wall_m: float) -> Alignment:
    return Alignment(np.array([1.0, 0.0, 0.0]), 0.58, walls(wall_m, 0.0), np.eye(3) * 1e-4, "auto")


def test_weak_evidence_looked_at_twice_is_not_believed_until_it_has_grown() -> None:
    pairs = book("r1", "r2")
    for t, wall_m in ((0, 10.0), (10, 11.0)):
        job = pairs.next_job(t * S, {})
        assert job is not None
        assert pairs.settle(job, weak(wall_m), t * S).edge is None
    assert pairs.pairs["r1", "r2"].reason == WEAK
    assert next_pair(pairs, 30) is None  # nothing has changed
    pairs.map_changed("r1", (1, 2), tiled(96, 2))
    job = pairs.next_job(40 * S, {})
    assert job is not None
    verdict = pairs.settle(job, weak(12.5), 40 * S)  # a fourth more than when it was found
    assert verdict.edge is not None and verdict.is_new


def stained(wall_m: float, against_m: float, confidence: float = 0.7) -> Alignment:
    return Alignment(np.array([1.0, 0.0, 0.0]), confidence, walls(wall_m, against_m), np.eye(3) * 1e-4, "auto")


@pytest.mark.parametrize(
    ("second", "is_believed"), [((18.0, 2.3), False), ((24.0, 3.5), False), ((24.0, 2.4), True), ((60.0, 7.0), True)]
)
def test_a_fit_that_is_not_clean_is_believed_only_once_what_came_to_it_is(
    second: tuple[float, float], is_believed: bool
) -> None:
    pairs = book("r1", "r2")
    for t, (wall_m, against_m) in ((0, (18.0, 2.3)), (10, second)):
        job = pairs.next_job(t * S, {})
        assert job is not None
        verdict = pairs.settle(job, stained(wall_m, against_m), t * S)
    assert (verdict.edge is not None) is is_believed


@pytest.mark.parametrize(("x", "against_m", "is_over"), [(1.1, 6.0, True), (1.1, 4.0, False), (9.0, 6.0, False)])
def test_a_merged_pair_is_unmerged_where_its_maps_come_to_contradict(x: float, against_m: float, is_over: bool) -> None:
    pairs = merged()
    pairs.map_changed("r1", (1, 2), tiled(90, 2))
    job = pairs.next_job(45 * S, PLACED)
    assert job is not None
    evidence = stained(14.0, against_m).evidence
    verdict = pairs.settle(job, Rejection("no", 0.1, evidence, "auto", np.array([x, 0.0, 0.0])), 45 * S)
    assert (verdict.status == "revoked") is is_over
    assert ("where the other map is free" in verdict.reason) is is_over


def test_two_that_disagree_are_not_believed() -> None:
    pairs = book("r1", "r2")
    for t, x in ((0, 1.0), (10, 5.0)):
        job = pairs.next_job(t * S, {})
        assert job is not None
        assert pairs.settle(job, found(x), t * S).edge is None
    assert pairs.pairs["r1", "r2"].status == "rejected"


def test_a_rejected_pair_waits_for_growth() -> None:
    pairs = book("r1", "r2")
    job = pairs.next_job(0, {})
    assert job is not None
    pairs.settle(job, Rejection("overlap 2 %", 0.1, None, "auto"), 0)
    assert pairs.pairs["r1", "r2"].reason == "overlap 2 %"
    assert next_pair(pairs, 100) is None  # nothing changed
    pairs.map_changed("r1", (1, 2), tiled(65, 2))
    assert next_pair(pairs, 100) is None  # hardly grown
    pairs.map_changed("r1", (1, 3), tiled(80, 3))
    assert next_pair(pairs, 100) == ("r1", "r2")


def test_a_rejection_does_not_outweigh_what_is_accepted_but_revoking_does() -> None:
    pairs = merged()
    pairs.map_changed("r1", (1, 2), tiled(66, 2))
    job = pairs.next_job(45 * S, PLACED)
    assert job is not None
    pairs.settle(job, Rejection("no", 0.0, None, "auto"), 20 * S)
    assert pairs.pairs["r1", "r2"].status == "accepted"
    pairs.revoke("r2", "r1", "walls contradict")
    status = pairs.pairs["r1", "r2"]
    assert (status.status, status.alignment, status.reason) == ("revoked", None, "walls contradict")


def test_a_robot_that_starts_a_new_map_is_a_new_robot() -> None:
    pairs = book("r1", "r2")
    job = pairs.next_job(0, {})
    assert job is not None
    pairs.map_changed("r1", (2, 1), tiled(64))
    assert pairs.settle(job, found(), 1).reason.startswith("a map was started anew")
    assert pairs.pairs["r1", "r2"].alignment is None
    assert next_pair(pairs, 100) == ("r1", "r2")


def test_a_merged_pair_is_aligned_anew_when_its_maps_have_changed() -> None:
    pairs = merged()
    assert next_pair(pairs, 100) is None  # nothing changed
    pairs.map_changed("r1", (1, 2), tiled(66, 2))
    assert next_pair(pairs, 25) is None  # hardly grown
    assert next_pair(pairs, 40) == ("r1", "r2")
    pairs.map_changed("r1", (1, 3), tiled(90, 3))
    assert next_pair(pairs, 25) == ("r1", "r2")


def test_a_merged_pair_whose_maps_have_grown_is_looked_for_everywhere_again() -> None:
    pairs = merged()
    pairs.map_changed("r1", (1, 2), tiled(66, 2))
    job = pairs.next_job(45 * S, PLACED)
    assert job is not None and job.prior is not None  # hardly grown: followed only
    pairs.settle(job, found(), 45 * S)
    pairs.map_changed("r1", (1, 3), tiled(90, 3))
    job = pairs.next_job(60 * S, PLACED)
    assert job is not None and job.prior is None
    pairs.settle(job, found(), 60 * S)
    pairs.map_changed("r1", (1, 4), tiled(91, 4))
    job = pairs.next_job(95 * S, PLACED)
    assert job is not None and job.prior is not None


@pytest.mark.parametrize(
    ("outcome", "status"),
    [
        (Rejection("ambiguous", 0.0, Evidence(margin=0.1), "auto"), "revoked"),
        (Rejection("not quite clear", 0.0, Evidence(margin=0.5), "auto"), "rejected"),
        (Rejection("too little wall", 0.0, None, "auto"), "rejected"),
        (found(x=8.0), "revoked"),
        (found(x=1.2), "accepted"),
    ],
)
def test_a_merge_that_turns_out_ambiguous_or_lies_elsewhere_is_revoked(
    outcome: Alignment | Rejection, status: str
) -> None:
    pairs = merged()
    pairs.map_changed("r1", (1, 2), tiled(90, 2))
    job = pairs.next_job(60 * S, PLACED)
    assert job is not None
    assert pairs.settle(job, outcome, 60 * S).status == status


def test_a_merge_that_was_not_confirmed_is_looked_for_everywhere_until_it_is() -> None:
    pairs = merged()
    for revision, t_s, is_open in ((2, 60, True), (3, 95, True), (4, 130, False)):
        pairs.map_changed("r1", (1, revision), tiled(88 + revision, revision))
        job = pairs.next_job(t_s * S, PLACED)
        assert job is not None and (job.prior is None) == is_open
        unsure = Rejection("not quite clear", 0.0, Evidence(margin=0.5), "auto")
        pairs.settle(job, unsure if revision == 2 else found(), t_s * S)
    assert pairs.pairs["r1", "r2"].status == "accepted"
