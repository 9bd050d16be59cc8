"""What is believed of a pair of maps after each alignment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent.effects import Event, JoinJob
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.belief import UNCONFIRMED, WEAK
from mrslam.alignment import Alignment, Evidence, Rejection
from mrslam.merge import BentTeam
from mrslam.merge.joint.bend import Bend
from mrslam.spatial import Keyframes, KeyScans, LocalMap, OccupancyGrid, TiledMap, se2
from mrslam.spatial.se2 import Transform
from tests.agent.pairs.floors import Floors, S, found, merged, walls, weak


def test_an_alignment_is_believed_when_a_second_one_agrees() -> None:
    team = Floors("r1", "r2")
    first = team.align(found(), 0)
    assert (first["status"], first["reason"], first["T_a_b"]) == ("rejected", UNCONFIRMED, None)
    assert list(team.layout.T_team_map) == ["r2"]
    second = team.align(found(1.05), 10)
    assert (second["status"], second["T_a_b"]) == ("accepted", [1.05, 0.0, 0.0])
    row = team.beliefs["r1", "r2"].row("r1", "r2")
    assert row["status"] == "accepted" and row["accepted_at_s"] == 10.0 and row["T_a_b"] == [1.05, 0.0, 0.0]
    assert team.layout.T_team_map["r1"] == pytest.approx([-1.05, 0.0, 0.0])


def test_weak_evidence_looked_at_twice_is_not_believed_until_it_has_grown() -> None:
    team = Floors("r1", "r2")
    for t_s, wall_m in ((0, 10.0), (10, 11.0)):
        assert team.align(weak(wall_m), t_s)["status"] == "rejected"
    assert team.beliefs["r1", "r2"].reason == WEAK
    assert team.due(30) is None  # nothing has changed
    team.grow("r1", 96, 2)
    assert team.align(weak(12.5), 40)["status"] == "accepted"  # a fourth more than when it was found


def test_parts_found_twice_are_believed_though_nothing_has_grown() -> None:
    team = Floors("r1", "r2")
    told = [team.align(replace(weak(300.0), is_in_parts=True), t_s)["status"] for t_s in (0, 10)]
    assert told == ["rejected", "accepted"]  # two parts found one by one are no chance that agrees with itself


@pytest.mark.parametrize(
    ("second_m", "overlap_m2", "is_believed"),
    [(30.0, 20.0, False), (35.0, 20.0, False), (37.0, 20.0, True), (30.0, 90.0, True), (40.0, 20.0, True)],
)
def test_a_place_in_a_saved_map_is_confirmed_by_wall_that_came_to_it(
    second_m: float, overlap_m2: float, is_believed: bool
) -> None:
    team = Floors()
    team.grow("r2", 64)
    team.save("office@monday")  # 100 m2
    first_m = 30.0 if second_m < 40.0 else 39.0  # a few rooms, which need no more
    assert team.align(found(wall_m=first_m), 0)["reason"] == UNCONFIRMED
    verdict = team.align(found(wall_m=second_m, overlap_m2=overlap_m2), 10)
    assert (verdict["status"], verdict["reason"]) == (("accepted",) * 2 if is_believed else ("rejected", WEAK))


@pytest.mark.parametrize(
    ("guess", "second", "saved", "is_believed"),
    [
        (walls(13.0, 0.0), weak(19.0), "office@monday", True),  # a room, and what came to it
        (walls(13.0, 0.0), found(3.0, wall_m=19.0), "office@monday", False),  # elsewhere
        (walls(16.5, 0.0), weak(19.0), "office@monday", False),  # hardly more than what chose the place
        (walls(4.0, 0.0), weak(19.0), "office@monday", False),  # what agrees anywhere
        (walls(13.0, 0.5), found(confidence=0.6, wall_m=19.0, against_m=2.0), "office@monday", False),  # contradicts
        (walls(13.0, 0.0), replace(weak(19.0), evidence=replace(walls(19.0, 0.0), margin=0.6)), "office@monday", False),
        (walls(13.0, 0.0), weak(19.0), "r1", False),  # a teammate's map grows, too
        (None, weak(19.0), "office@monday", False),
    ],
)
def test_the_best_place_of_a_search_that_did_not_suffice_is_confirmed_by_wall_that_came_to_it(
    guess: Evidence | None, second: Alignment, saved: str, is_believed: bool
) -> None:
    team = Floors()
    team.grow("r2", 64)
    if saved == "r1":
        team.grow("r1", 64)
    else:
        team.save(saved)
    place = None if guess is None else np.array([1.0, 0.0, 0.0])
    assert team.align(Rejection("ambiguous", 0.2, guess, "auto", place), 0)["status"] == "rejected"
    team.grow("r2", 80, 2)
    verdict = team.align(second, 20)
    assert (verdict["status"], verdict["reason"]) == (
        ("accepted", "accepted") if is_believed else ("rejected", UNCONFIRMED)
    )


@pytest.mark.parametrize(
    "between", [Rejection("ambiguous", 0.2, walls(12.0, 0.0), "auto", np.array([5.0, 0.0, 0.0])), found(5.0, wall_m=12)]
)
def test_what_was_foreseen_by_an_earlier_search_than_the_last_confirms_nothing(between: Alignment | Rejection) -> None:
    team = Floors()
    team.grow("r2", 64)
    team.save("office@monday")
    guess = Rejection("ambiguous", 0.2, walls(10.0, 0.0), "auto", np.array([1.0, 0.0, 0.0]))
    for t_s, outcome in ((0, guess), (20, between)):
        team.align(outcome, t_s)
        team.grow("r2", 80 + t_s, 2 + t_s)
    job = team.job(40)
    assert job.prior is None  # everywhere
    assert team.end(job, found(wall_m=30.0), 40)["reason"] == UNCONFIRMED


@pytest.mark.parametrize(("wall_m", "against_m"), [(30.0, 0.0), (18.0, 1.5)])
def test_two_saved_maps_which_do_not_grow_need_no_more_wall_to_be_merged(wall_m: float, against_m: float) -> None:
    team = Floors()
    for day in ("monday", "tuesday"):
        team.save(f"office@{day}")
    for t_s in (0, 10):
        verdict = team.align(found(wall_m=wall_m, against_m=against_m), t_s)
    assert verdict["status"] == "accepted"


def stained(wall_m: float, against_m: float, confidence: float = 0.7) -> Alignment:
    return Alignment(np.array([1.0, 0.0, 0.0]), confidence, walls(wall_m, against_m), np.eye(3) * 1e-4, "auto")


@pytest.mark.parametrize(
    ("second", "is_believed"), [((18.0, 2.3), False), ((24.0, 3.5), False), ((24.0, 2.4), True), ((60.0, 7.0), True)]
)
def test_a_fit_that_is_not_clean_is_believed_only_once_what_came_to_it_is(
    second: tuple[float, float], is_believed: bool
) -> None:
    team = Floors("r1", "r2")
    for t_s, (wall_m, against_m) in ((0, (18.0, 2.3)), (10, second)):
        verdict = team.align(stained(wall_m, against_m), t_s)
    assert (verdict["status"] == "accepted") is is_believed


@pytest.mark.parametrize(
    ("first", "second", "is_believed"),
    [
        ((15.0, 0.3), (16.0, 0.3), True),  # a fiftieth
        ((15.0, 0.5), (16.0, 0.5), False),  # a thirtieth: a room that fits by chance
        ((15.0, 0.5), (18.5, 0.5), True),  # a fifth more, and clean
        ((15.0, 0.5), (18.5, 0.7), False),  # and not
        ((29.0, 1.5), (30.0, 1.5), True),  # real maps are bent
        ((29.0, 2.4), (30.0, 2.4), False),
        ((39.0, 3.5), (39.5, 3.5), True),
    ],
)
def test_the_less_wall_agrees_the_less_may_contradict_where_two_looks_suffice(
    first: tuple[float, float], second: tuple[float, float], is_believed: bool
) -> None:
    team = Floors("r1", "r2")
    for t_s, (wall_m, against_m) in ((0, first), (10, second)):
        verdict = team.align(stained(wall_m, against_m), t_s)
    assert (verdict["status"] == "accepted") is is_believed


@pytest.mark.parametrize(
    ("wall_m", "overlap", "ground_m2", "is_believed"),
    [
        ((12.0, 14.6), 0.3, (23.0, 25.0), False),  # the same room from nearer: its like agrees as well
        ((12.0, 12.5), 0.3, (23.0, 29.0), True),  # the next room, too
        ((12.0, 12.5), 0.4, (23.0, 25.0), True),  # most of what the robot has seen
        ((19.5, 20.5), 0.3, (33.0, 35.0), True),  # several rooms
    ],
)
def test_one_room_of_several_is_believed_only_once_more_ground_is_shared(
    wall_m: tuple[float, float], overlap: float, ground_m2: tuple[float, float], is_believed: bool
) -> None:
    team = Floors("r1", "r2")
    for t_s, agrees_m, shared_m2 in zip((0, 10), wall_m, ground_m2, strict=True):
        one = found(wall_m=agrees_m)
        verdict = team.align(replace(one, evidence=replace(one.evidence, overlap=overlap, overlap_m2=shared_m2)), t_s)
    assert (verdict["status"] == "accepted") is is_believed
    assert verdict["reason"] == ("accepted" if is_believed else WEAK)


def test_one_room_of_a_saved_map_needs_no_more_ground() -> None:
    team = Floors()
    team.grow("r2", 64)
    team.save("office@monday")
    for t_s, wall_m in ((0, 12.0), (10, 14.6)):
        one = found(wall_m=wall_m)
        verdict = team.align(replace(one, evidence=replace(one.evidence, overlap=0.3, overlap_m2=23.0)), t_s)
    assert verdict["status"] == "accepted"  # by wall that came to it


def test_a_place_in_a_saved_map_may_contradict_more_for_the_wall_that_confirms_it_is_new() -> None:
    team = Floors()
    team.grow("r2", 64)
    team.save("office@monday")
    for t_s, wall_m in ((0, 12.0), (10, 16.0)):
        verdict = team.align(stained(wall_m, 0.05 * wall_m), t_s)
    assert verdict["status"] == "accepted"


@pytest.mark.parametrize(("x", "against_m", "is_over"), [(1.1, 6.0, True), (1.1, 4.0, False), (9.0, 6.0, False)])
def test_a_merged_pair_is_unmerged_where_its_maps_come_to_contradict(x: float, against_m: float, is_over: bool) -> None:
    team = merged()
    team.grow("r1", 90, 2)
    evidence = stained(14.0, against_m).evidence
    verdict = team.align(Rejection("no", 0.1, evidence, "auto", np.array([x, 0.0, 0.0])), 45)
    assert (verdict["status"] == "revoked") is is_over
    assert ("where the other map is free" in verdict["reason"]) is is_over
    assert ("r1" not in team.layout.T_team_map) is is_over


KEYS, STAMPS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.arange(2)


def scanned(T_team_map: dict[str, Transform]) -> Floors:
    """Return a merged team whose maps came with scans; some are bent, to where they are given."""
    team = merged()
    scans = KeyScans.of_points([np.empty((0, 2))] * 2, np.zeros((2, 2)))
    for name in ("r1", "r2"):
        tiles = TiledMap.from_grid(OccupancyGrid(np.zeros((90, 90), dtype=np.int8), 0.05), 2)
        team.take_map(name, KnownMap((1, 2), LocalMap(tiles, Keyframes(STAMPS, KEYS), scans)))
    bends = {name: Bend(KEYS, se2.compose(T, KEYS)) for name, T in T_team_map.items()}
    team.layout.bend(BentTeam(bends=bends, stamps_ns=dict.fromkeys(bends, STAMPS)))
    assert isinstance(team.next_job(45 * S), JoinJob)  # which did not end yet
    return team


@pytest.mark.parametrize(("bent", "is_over"), [(("r1", "r2"), False), (("r1", "r3"), True), ((), True)])
def test_bent_maps_of_a_merged_pair_are_not_unmerged_because_they_do_not_fit_rigidly(
    bent: tuple[str, ...], is_over: bool
) -> None:
    team = scanned(dict.fromkeys(bent, se2.IDENTITY))
    job = team.job(45)
    outcome = Rejection("no", 0.1, stained(14.0, 6.0).evidence, "auto", np.array([1.1, 0.0, 0.0]))
    assert (team.end(job, outcome, 45)["status"] == "revoked") is is_over


def test_two_that_disagree_are_not_believed() -> None:
    team = Floors("r1", "r2")
    for t_s, x in ((0, 1.0), (10, 5.0)):
        assert team.align(found(x), t_s)["status"] == "rejected"
    assert team.beliefs["r1", "r2"].status == "rejected"


def test_two_that_agree_are_not_believed_where_one_between_them_found_nothing() -> None:
    team = Floors("r1", "r2")
    for t_s, outcome in ((0, found()), (10, Rejection("too little wall", 0.0, None, "auto")), (20, found(1.05))):
        assert team.align(outcome, t_s)["status"] == "rejected"
        team.grow("r1", 96 + 4 * t_s, 2 + t_s)
    assert team.align(found(1.1), 40)["status"] == "accepted"


def test_a_rejection_does_not_outweigh_what_is_accepted_but_revoking_does() -> None:
    team = merged()
    team.grow("r1", 66, 2)
    team.align(Rejection("no", 0.0, None, "auto"), 45)
    belief = team.beliefs["r1", "r2"]
    assert belief.status == "accepted"
    belief.revoke("walls contradict")
    assert (belief.status, belief.alignment, belief.reason) == ("revoked", None, "walls contradict")
    assert team.map().unplaced == {"r1": "no accepted alignment (r1-r2: walls contradict)"}


def test_a_robot_that_starts_a_new_map_is_a_new_robot() -> None:
    team = Floors("r1", "r2")
    job = team.job(0)
    team.grow("r1", 64, epoch=2)
    assert team.end(job, found(), 1)["reason"].startswith("a map was started anew")
    assert team.beliefs["r1", "r2"].alignment is None
    assert team.due(100) == ("r1", "r2")


def test_a_merge_is_forgotten_when_a_robot_starts_a_new_map() -> None:
    team = merged()
    team.grow("r1", 64, epoch=2)
    assert list(team.layout.T_team_map) == ["r2"]  # at once
    assert team.beliefs["r1", "r2"].reason == "r1 started a new map"


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
    team = merged()
    team.grow("r1", 90, 2)
    assert team.align(outcome, 60)["status"] == status


@pytest.mark.parametrize(("rival_m", "is_over"), [(20.0, False), (30.0, True)])
def test_scraps_that_fit_anywhere_are_no_other_place_of_maps_merged_by_much_wall(rival_m: float, is_over: bool) -> None:
    team = Floors("r1", "r2")
    for t_s in (0, 10):
        team.align(found(wall_m=50.0), t_s)
    team.grow("r1", 90, 2)
    outcome = Rejection("ambiguous", 0.0, replace(walls(rival_m, 0.0), margin=0.1), "auto")
    assert (team.align(outcome, 60)["status"] == "revoked") is is_over


@pytest.mark.parametrize(
    ("bent", "rivals", "is_over"),
    [(("r1", "r2"), (), False), (("r1", "r2"), (np.array([4.0, 0.0, 3.0]),), True), ((), (), True)],
)
def test_places_of_which_each_is_as_bad_as_the_other_do_not_make_bent_maps_ambiguous(
    bent: tuple[str, ...], rivals: tuple[Transform, ...], is_over: bool
) -> None:
    team = scanned(dict.fromkeys(bent, se2.IDENTITY))
    job = team.job(45)
    outcome = Rejection("ambiguous", 0.0, Evidence(margin=0.1), "auto", np.array([1.0, 0.0, 0.0]), rivals=rivals)
    assert (team.end(replace(job, prior=None), outcome, 60)["status"] == "revoked") is is_over


def test_a_pair_that_is_aligned_again_where_it_is_merged_is_reported_as_merged_no_second_time() -> None:
    team, merges = Floors("r1", "r2"), []
    for k in range(4):
        team.grow("r1", 64 + 32 * k, k + 1)
        effects = team.on_aligned(team.job(100.0 * k), found(), round(100 * k * S))
        merges.append([effect.kind for effect in effects if isinstance(effect, Event)].count("merged"))
    assert merges == [0, 1, 0, 0]


def test_a_pair_that_was_unmerged_has_no_time_of_its_merge() -> None:
    team = merged()
    assert team.beliefs["r1", "r2"].row("r1", "r2")["accepted_at_s"] == 10.0
    team.unmerge(("r1", "r2"), "nobody was there", 20 * S)
    assert team.beliefs["r1", "r2"].row("r1", "r2")["accepted_at_s"] is None


@pytest.mark.parametrize(("off_m", "is_again"), [(0.0, False), (0.4, False), (0.7, True)])
def test_a_pair_that_third_robots_hold_where_it_was_aligned_is_not_aligned_again(off_m: float, is_again: bool) -> None:
    T_a_b = found().T_a_b
    team = scanned({"r1": se2.IDENTITY, "r2": T_a_b + np.array([off_m, 0.0, 0.0])})
    assert (team.due(45) == ("r1", "r2")) is is_again
