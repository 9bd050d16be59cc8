"""When a pair of maps is aligned, and whether everywhere or near where it was found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent.effects import AlignJob
from mrslam.agent.pairs.belief import UNCONFIRMED, WEAK
from mrslam.agent.pairs.schedule import LAST_LOOK_S, PATIENCE_S, PATIENT_AFTER
from mrslam.alignment import Evidence, Rejection
from mrslam.comms import TeammateHint
from mrslam.merge import BentTeam
from tests.agent.pairs.floors import Floors, S, found, merged, weak

NOWHERE = Rejection("overlap 2 %", 0.1, None, "auto")


def test_pairs_with_the_own_map_come_first_and_are_named_in_order() -> None:
    team = Floors("r3", "r1", "r2")
    assert team.due(0) == ("r1", "r2")
    assert set(team.beliefs) == {("r1", "r2"), ("r1", "r3"), ("r2", "r3")}


def test_a_pair_found_once_is_tried_again_as_soon_as_may_be() -> None:
    team = Floors("r1", "r2")
    first = team.job(0)
    team.end(first, found(), 0)
    assert team.due(5) is None  # too soon
    assert team.job(10).attempt == first.attempt + 1


def test_a_rejected_pair_waits_for_growth() -> None:
    team = Floors("r1", "r2")
    team.align(Rejection("overlap 2 %", 0.1, None, "auto"), 0)
    assert team.beliefs["r1", "r2"].reason == "overlap 2 %"
    assert team.due(100) is None  # nothing changed
    team.grow("r1", 65, 2)
    assert team.due(100) is None  # hardly grown
    team.grow("r1", 80, 3)
    assert team.due(100) == ("r1", "r2")


@pytest.mark.parametrize(("others", "found_already", "growth"), [(5, 0, 0.1), (8, 0, 0.16), (8, 2, 0.12), (8, 4, 0.1)])
def test_where_many_maps_are_not_found_each_is_searched_for_after_as_much_more_growth(
    others: int, found_already: int, growth: float
) -> None:
    team = Floors("r2", *(f"x{k}" for k in range(others)))
    team.save("office@monday")  # no robot's
    while team.due(0.0) is not None:
        team.align(Rejection("overlap 2 %", 0.1, None, "auto"), 0.0)
    for k in range(found_already):
        team.beliefs["r2", f"x{k}"].stability.previous = found()
    rows = np.arange(64, 90)
    grown = int(rows[rows**2 >= (1.0 + growth) * 64**2][0])
    team.grow("x4", grown - 1, 2)
    assert team.due(20.0) is None
    team.grow("x4", grown, 3)
    assert team.due(20.0) == ("r2", "x4")
    team.grow("x4", 67, 4)
    assert team.due(PATIENCE_S) is None
    team.grow("x4", 68, 5)
    assert team.due(PATIENCE_S) == ("r2", "x4")  # a tenth, after a while


def test_a_merged_pair_is_aligned_again_when_its_maps_have_changed() -> None:
    team = merged()
    assert team.due(100) is None  # nothing changed
    team.grow("r1", 66, 2)
    assert team.due(25) is None  # hardly grown
    assert team.due(40) == ("r1", "r2")
    team.grow("r1", 90, 3)
    assert team.due(25) == ("r1", "r2")


def test_a_merged_pair_whose_maps_have_grown_is_searched_for_everywhere_again() -> None:
    team = merged()
    team.grow("r1", 66, 2)
    job = team.job(45)
    assert job.prior is not None  # hardly grown: followed only
    team.end(job, found(), 45)
    team.grow("r1", 90, 3)
    job = team.job(60)
    assert job.prior is None
    team.end(job, found(), 60)
    team.grow("r1", 91, 4)
    assert team.job(95).prior is not None


def test_a_merged_pair_whose_scans_tie_it_is_searched_for_again_when_a_map_is_twice_as_large() -> None:
    tied, untied = merged(), merged()
    tied.layout.bend(BentTeam(places={("r1", "r2"): found().T_a_b[None]}))
    for team, side, is_due in ((untied, 80, True), (tied, 80, False), (tied, 88, False), (tied, 92, True)):
        team.grow("r1", side, side)  # 64 x 64 cells before: half as much again, 1.9 times, 2.07 times
        assert (team.due(100) is not None) == is_due
    job = tied.job(100)
    assert job.prior is None  # everywhere
    tied.end(job, found(), 100)
    tied.grow("r1", 128, 200)
    assert tied.due(300) is None  # twice what it was by then, not what it was at first
    tied.grow("r1", 131, 201)
    assert tied.job(300).prior is None


def test_a_merge_that_was_not_confirmed_is_searched_for_everywhere_until_it_is() -> None:
    team = merged()
    for revision, t_s, is_everywhere in ((2, 60, True), (3, 95, True), (4, 130, False)):
        team.grow("r1", 88 + revision, revision)
        job = team.job(t_s)
        assert (job.prior is None) == is_everywhere
        unsure = Rejection("not quite clear", 0.0, Evidence(margin=0.5), "auto")
        team.end(job, unsure if revision == 2 else found(), t_s)
    assert team.beliefs["r1", "r2"].status == "accepted"


def test_the_own_map_under_another_label_keeps_its_pairs_and_another_map_does_not() -> None:
    team = merged()
    team.grow("r2", 66, 2, epoch=9)  # above what a teammate held of an earlier life
    assert team.beliefs["r1", "r2"].status == "accepted" and "r1" in team.layout.T_team_map
    team.grow("r2", 64, 1, epoch=10)  # fewer revisions: not the same map
    assert team.beliefs["r1", "r2"].status == "untried" and "r1" not in team.layout.T_team_map
    team = merged()
    team.displace("r2")  # given up
    team.grow("r2", 66, 2, epoch=9)
    assert team.beliefs["r1", "r2"].status == "untried" and "r1" not in team.layout.T_team_map
    team = merged()
    team.grow("r1", 66, 2, epoch=9)  # nobody can know what a teammate's label means
    assert team.beliefs["r1", "r2"].status == "untried" and "r1" not in team.layout.T_team_map


def test_a_pair_that_was_tried_often_waits_for_more_growth() -> None:
    team = Floors("r1", "r2")
    cells, t_s = 64, 0.0
    for revision in range(2, 2 + PATIENT_AFTER):
        team.align(Rejection("overlap 2 %", 0.1, None, "auto"), t_s)
        cells, t_s = round(1.06 * cells), t_s + 20.0  # an eighth more area
        team.grow("r1", cells, revision)
    assert team.due(t_s) is None  # now it waits for both to grow by a quarter
    assert team.due(t_s - 20.0 + PATIENCE_S) == ("r1", "r2")  # or for a while
    team.grow("r1", round(1.12 * cells), 50)
    team.grow("r2", round(1.12 * 64), 50)
    assert team.due(t_s) == ("r1", "r2")


def test_weak_evidence_is_looked_at_again_once_it_can_have_grown() -> None:
    team = Floors("r1", "r2")
    for t_s in (0.0, 20.0):
        team.align(weak(10.0, overlap_m2=10.24), t_s)  # the maps have all their ground in common
    assert team.beliefs["r1", "r2"].reason == WEAK
    team.grow("r1", 68, 2)  # 13 % more area
    assert team.due(40.0) is None
    team.grow("r1", 71, 3)  # 23 %
    assert team.due(40.0) == ("r1", "r2") and team.job(40.0).place is None


def test_weak_evidence_is_looked_at_where_it_was_found_after_a_while_though_maps_have_only_changed() -> None:
    team = Floors("r1", "r2")
    for t_s in (0.0, 20.0):
        team.align(weak(10.0, overlap_m2=10.24), t_s)
    assert team.due(20.0 + PATIENCE_S) is None
    team.grow("r1", 65, 2)  # 3 %: it was corrected, and walls that were there fit now
    assert team.due(40.0) is None
    place = team.job(20.0 + PATIENCE_S).place
    assert place is not None and place == pytest.approx(weak(10.0).T_a_b)
    team.align(weak(12.5), 20.0 + PATIENCE_S)
    assert team.beliefs["r1", "r2"].status == "accepted"


def test_weak_evidence_on_part_of_two_maps_waits_for_that_part_to_grow_and_one_of_the_maps() -> None:
    team = Floors("r1", "r2")
    for t_s in (0.0, 20.0):
        team.align(weak(10.0, overlap_m2=4.0), t_s)
    team.grow("r1", 66, 2)
    team.grow("r2", 66, 2)  # 1.3 m2 together, 6 % of either map
    assert team.due(40.0) is None
    team.grow("r1", 68, 3)  # 13 %
    assert team.due(40.0) == ("r1", "r2")


def test_weak_evidence_is_looked_at_once_one_map_has_grown_though_the_other_was_corrected_to_less() -> None:
    team = Floors("r1", "r2")
    for t_s in (0.0, 20.0):
        team.align(weak(10.0, overlap_m2=4.0), t_s)
    team.grow("r1", 58, 2)  # 1.8 m2 less
    team.grow("r2", 68, 2)  # 1.3 m2 more
    assert team.due(40.0) == ("r1", "r2")


def test_own_pairs_come_before_pairs_of_others_which_are_tied_no_more_than_loops_need() -> None:
    team = Floors("r1", "r2", "r3", "r4", "r5")
    tried = []
    for t_s in range(0, 400, 2):
        if team.due(t_s) is not None:
            job = team.job(t_s)
            team.end(job, found(float(int(job.b[1]) - int(job.a[1]))), t_s)
            tried.append((job.a, job.b))
    assert tried[:4] == [("r1", "r2"), ("r2", "r3"), ("r2", "r4"), ("r2", "r5")]
    merged_pairs = {pair for pair, belief in team.beliefs.items() if belief.alignment is not None}
    assert merged_pairs == {*tried[:4], ("r1", "r3"), ("r1", "r4"), ("r1", "r5")}  # none of r3-r4, r3-r5, r4-r5


def test_a_pair_of_others_that_closes_a_loop_is_followed_where_it_is_and_never_searched_for_again() -> None:
    team = Floors("r1", "r2", "r3")
    t_s = 0.0
    while any(belief.alignment is None for belief in team.beliefs.values()):
        t_s += 10.0
        while (job := team.next_job(round(t_s * S))) is not None:
            assert isinstance(job, AlignJob)
            team.end(job, found(float(int(job.b[1]) - int(job.a[1]))), t_s)
    t_s += 20.0
    team.grow("r1", 90, 9)
    jobs = {}
    while (job := team.next_job(round(t_s * S))) is not None:
        assert isinstance(job, AlignJob) and (job.a, job.b) not in jobs
        jobs[job.a, job.b] = job
        team.end(job, found(float(int(job.b[1]) - int(job.a[1]))), t_s)
    assert jobs["r1", "r2"].prior is None and jobs["r1", "r3"].place == pytest.approx([2.0, 0.0, 0.0])
    team.grow("r1", 91, 10)
    assert team.due(t_s + 11.0) is None  # followed when it has grown, like any


def test_an_own_pair_comes_before_one_of_others_that_waits_longer() -> None:
    team, nothing = Floors("r1", "r2", "r3"), Rejection("nothing fits", 0.0, None, "auto")
    for _ in range(2):
        team.align(nothing, 0.0)
    team.hints.hear(TeammateHint("r1", 1, "r3", np.array([2.0, 0.0, 0.0])))
    job = team.job(5.0)
    assert job.hinted_by == "r1"
    team.end(job, found(2.0), 5.0)  # to be confirmed from 15 s on
    for t_s, cells in ((20.0, 80), (35.0, 100)):
        team.grow("r3", cells, cells)
        assert team.due(t_s) == ("r2", "r3")
        team.align(nothing, t_s)
    assert team.due(36.0) == ("r1", "r3")


def test_a_place_in_a_saved_map_is_looked_for_whenever_the_own_map_has_grown() -> None:
    team = Floors()
    team.grow("r2", 64)
    team.save("office@monday")
    nothing, cells = Rejection("overlap 2 %", 0.1, None, "auto"), 64
    for revision in range(2, 4 + PATIENT_AFTER):
        team.align(nothing, 2.0 * revision)
        team.grow("r2", cells + 1, 100 + revision)
        assert team.due(2.0 * revision + 1.0) is None  # hardly grown
        cells = round(1.06 * cells)
        team.grow("r2", cells, revision)
        assert team.due(2.0 * revision + 1.0) == ("office@monday", "r2")  # neither interval nor patience


def test_a_place_found_once_in_a_saved_map_is_looked_at_again_as_soon_as_there_is_a_little_more() -> None:
    team = Floors()
    team.grow("r2", 100)
    team.save("office@monday")
    assert team.align(found(wall_m=20.0), 0.0)["reason"] == UNCONFIRMED
    assert team.due(1.0) is None  # nothing new
    team.grow("r2", 102, 2)  # by 4 %
    job = team.job(2.0)
    assert job.place is not None and job.place.tolist() == [1.0, 0.0, 0.0]
    team.end(job, found(wall_m=21.0), 2.0)  # no fifth more
    assert team.beliefs["office@monday", "r2"].reason == WEAK
    team.grow("r2", 104, 3)
    assert team.align(found(wall_m=25.0), 3.0)["status"] == "accepted"


def test_a_teammates_map_and_a_place_once_believed_wait_for_their_time() -> None:
    team = Floors("r1", "r2")
    team.align(Rejection("overlap 2 %", 0.1, None, "auto"), 0.0)
    team.grow("r2", 80, 2)
    assert team.due(2.0) is None
    team = Floors()
    team.grow("r2", 64)
    team.save("office@monday")
    for revision, t_s in ((2, 0.0), (3, 2.0)):
        team.grow("r2", 64 * revision, revision)
        team.align(found(wall_m=50.0), t_s)
    assert team.beliefs["office@monday", "r2"].status == "accepted"
    team.grow("r2", 640, 9)
    assert team.due(4.0) is None
    assert team.due(13.0) == ("office@monday", "r2")


def test_each_map_of_a_pair_goes_with_its_own_keyframes() -> None:
    team = Floors("r1", "r2")
    job = team.job(0)
    assert job.trails is not None and [job.a, job.b] == ["r1", "r2"]
    assert job.trails[0] is team.maps["r1"].trail and job.trails[1] is team.maps["r2"].trail


def test_an_own_pair_is_looked_at_in_parts_now_and_then_until_it_is_merged() -> None:
    team = Floors("r1", "r2")
    asked = []
    for k, outcome in enumerate((NOWHERE, NOWHERE, NOWHERE, NOWHERE, found(), found())):
        team.grow("r1", 64 + 6 * k, k + 1)
        job = team.job(20.0 * k)
        asked.append(job.by_parts)
        team.end(job, outcome, 20.0 * k)
    assert asked == [True, False, False, True, False, True]  # one search in three, and what confirms a find
    assert team.beliefs["r1", "r2"].alignment is not None
    team.grow("r1", 300, 9)
    assert not team.job(200.0).by_parts


def test_an_own_pair_not_looked_at_for_minutes_is_looked_at_in_parts_however_little_has_grown() -> None:
    team = Floors("r1", "r2", "r3")

    def jobs(t_s: float) -> list[tuple[str, str, bool]]:
        done = []
        while team.due(t_s) is not None:
            done.append(job := team.job(t_s))
            team.end(job, NOWHERE, t_s)
        return [(job.a, job.b, job.by_parts) for job in done]

    for k in range(8):
        for robot in ("r1", "r2", "r3"):
            team.grow(robot, round(40 * 1.2**k), k + 2)
        last = jobs(20.0 * k)
    assert len(last) == 3  # of which one is of two others, who did not find each other
    team.grow("r1", 145, 20)  # 2 % more area
    assert jobs(139.0 + LAST_LOOK_S) == []
    assert jobs(141.0 + LAST_LOOK_S) == [("r1", "r2", True)]
    assert jobs(142.0 + 3.0 * LAST_LOOK_S) == []  # nothing has changed


@pytest.mark.parametrize("is_in_parts", [False, True])
def test_what_confirms_a_find_of_parts_looks_at_parts_of_others_maps_too(is_in_parts: bool) -> None:
    team = Floors("r1", "r2", "r3")
    hinted = replace(team.job(0.0), a="r1", b="r3", hinted_by="r1", place=found().T_a_b)
    team.end(hinted, replace(found(), is_in_parts=is_in_parts), 0.0)
    while (job := team.job(10.0)) and "r2" in (job.a, job.b):
        team.end(job, NOWHERE, 10.0)
    assert (job.a, job.b, job.by_parts) == ("r1", "r3", is_in_parts)


def test_a_pair_of_others_is_not_searched_for_in_parts() -> None:
    team = Floors("r1", "r2", "r3")
    by_parts = {}
    for t_s in (*range(0, 40, 2), *range(1000, 1040, 2)):
        if team.due(t_s) is not None:
            job = team.job(t_s)
            by_parts.setdefault((job.a, job.b), job.by_parts)
            team.end(job, found(float(int(job.b[1]) - int(job.a[1]))), t_s)
    assert by_parts == {("r1", "r2"): True, ("r2", "r3"): True, ("r1", "r3"): False}
