"""What robots see of each other decides how their maps lie, and what they tell each other of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob, Event
from mrslam.agent.encounters import Encounters, Standing
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import Hypotheses
from mrslam.agent.pairs.weighing import weighed
from mrslam.agent.witness import CHANGED_LLR, REPEAT_NS, Witness
from mrslam.alignment import Alignment, Evidence, Rejection
from mrslam.alignment.evidence import WallEvidence
from mrslam.comms import TeammateClaim, TeammatePose
from mrslam.comms.effects import EPOCHS
from mrslam.merge.graph.edges import pair_of
from mrslam.mutual_detection import MutualDetectionConfig, find_bodies
from mrslam.mutual_detection.encounters import MOST_HIDDEN_LLR, MOST_SEEN_LLR, MOST_UNSEEN_LLR
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform
from tests.agent.duo import S, live, merge, robot
from tests.mutual_detection.sights import RADIUS_M, sweep
from tests.mutual_detection.test_encounters import FRAMES, MATE, OWN, RIGHT

NEARER = se2.compose(se2.inverse(FRAMES[0]), se2.compose(se2.transform(-1.6, 0.0, 0.0), FRAMES[1]))
"""Where r2's map would have it 1.6 m nearer to r1 than it is: on free floor."""
BEGIN = 100 * S


def met(own: str = "r1") -> Agent:
    """Return a robot that holds the map of r2."""
    one, two = robot(own, 1), robot("r2", 1)
    live([one, two], 0, 60)
    assert pair_of(own, "r2") in one.team.beliefs
    return one


def watch(
    one: Agent, *, mutual: bool = False, encounters: bool = True, epoch: int | None = None
) -> tuple[Witness, list[Event]]:
    """Let a robot see r2 drive towards it, every second; return what it concludes.

    ``mutual`` : r2 tells what it sees; ``epoch`` : of the map in which it says where it is.
    """
    config = MutualDetectionConfig(encounters=encounters, teammates_visible=True)
    witness, effects = Witness(one.robot_id, config), []
    epoch = one.team.maps["r2"].epoch if epoch is None else epoch
    for k, (own, mate) in enumerate(zip(OWN, MATE, strict=True)):
        t_ns = BEGIN + k * S
        witness.on_scan(sweep(own, [mate[:2]], seed=k), se2.between(FRAMES[0], own), t_ns)
        bodies = find_bodies(sweep(mate, [own[:2]], seed=k + 50), RADIUS_M) if mutual else np.empty((0, 2))
        report = TeammatePose("r2", t_ns, se2.between(FRAMES[1], mate), epoch, bodies)
        witness.on_report(report, one.team, t_ns)
        effects += witness.look(one.team, t_ns)
    return witness, effects


def claim(one: Agent, T_r1_r2: Transform, llr: float) -> TeammateClaim:
    """Return what r2 says of the maps that r1 knows now."""
    epochs = (one.team.maps["r2"].epoch, one.team.maps["r1"].epoch)
    return TeammateClaim("r2", epochs[0], "r1", se2.inverse(T_r1_r2), llr, epochs[1] % EPOCHS)


def walls(matched_m: float, contradicted_m: float) -> Evidence:
    one = WallEvidence(matched_m, 0.0, contradicted_m, 0.0)
    return Evidence(a=one, b=one, walls=9, margin=0.1)


def too_little(T: Transform, contradicted_m: float = 0.0) -> Rejection:
    return Rejection("too little wall", 0.3, walls(3.0, contradicted_m), "auto", T)


def test_a_place_where_nobody_is_is_given_up_once_both_robots_have_looked() -> None:
    one = met()
    merge(one, NEARER.tolist())
    witness, effects = watch(one)
    assert effects == [] and "r2" in one.T_team_map  # one robot may be too low for the other's laser
    witness.on_claim(claim(one, NEARER, -2.0), one.team, BEGIN + 20 * S)
    (unmerged,) = witness.look(one.team, BEGIN + 20 * S)
    assert isinstance(unmerged, Event) and unmerged.kind == "unmerged" and "nobody was there" in str(unmerged.fields)
    assert "r2" not in one.T_team_map
    for t_ns in (200 * S, 300 * S):  # maps propose it again
        job = one.next_job(t_ns)
        if isinstance(job, AlignJob):
            one.on_done(job, Alignment(NEARER, 0.9, walls(60.0, 0.0), np.eye(3) * 1e-4, "auto"), t_ns)
    assert "r2" not in one.T_team_map and "nobody was there" in one.team.beliefs["r1", "r2"].reason


def merge_pair(one: Agent, pair: tuple[str, str], T_a_b: Transform, confidence: float = 0.8) -> None:
    """Let a robot find twice how two maps lie."""
    maps = [one.team.maps[name] for name in pair]
    found = Alignment(T_a_b, confidence, walls(60.0, 0.0), np.eye(3) * 1e-4, "auto")
    for t_ns in (0, 20 * S):
        versions, areas = (maps[0].version, maps[1].version), (maps[0].area_m2, maps[1].area_m2 + t_ns / S)
        one.on_done(AlignJob(*pair, maps[0].grid, maps[1].grid, None, versions, areas, 0), found, t_ns)


def through_r3(one: Agent, T_r1_r2: Transform) -> None:
    """Have r1 merge with r3, and r3 with r2, so that r2 lies at ``T_r1_r2``; the second alignment is the weaker."""
    one.team.take_map("r3", one.team.maps["r2"])
    T_r1_r3 = se2.transform(0.3, 0.1, 0.2)
    merge_pair(one, ("r1", "r3"), T_r1_r3, 0.9)
    merge_pair(one, ("r2", "r3"), se2.between(T_r1_r2, T_r1_r3), 0.7)
    assert {"r2", "r3"} <= one.T_team_map.keys() and one.team.beliefs["r1", "r2"].alignment is None


def test_a_place_through_others_where_nobody_is_ends_the_weakest_alignment_between() -> None:
    one = met()
    through_r3(one, NEARER)
    witness, effects = watch(one)
    assert effects == [] and "r2" in one.T_team_map
    ((peer, T, llr, _),) = witness.claims(one.team, BEGIN + 6 * S)
    assert peer == "r2" and se2.difference(T, NEARER)[0] < 0.1 and llr < 0.0  # r2 is asked to look there, too
    witness.on_claim(claim(one, NEARER, -2.0), one.team, BEGIN + 20 * S)
    (unmerged,) = witness.look(one.team, BEGIN + 20 * S)
    assert isinstance(unmerged, Event) and (unmerged.fields["a"], unmerged.fields["b"]) == ("r2", "r3")
    assert one.T_team_map.keys() == {"r1", "r3"} and witness.look(one.team, BEGIN + 21 * S) == []
    T_r2_r3 = se2.between(NEARER, se2.transform(0.3, 0.1, 0.2))
    merge_pair(one, ("r2", "r3"), T_r2_r3, 0.7)  # not merged and unmerged by turns
    assert "r2" not in one.T_team_map and "placed through it, r1 and r2" in one.team.beliefs["r2", "r3"].reason
    merge_pair(
        one, ("r2", "r3"), se2.compose(T_r2_r3, se2.transform(3.0, 0.0, 0.0)), 0.7
    )  # another place is none of it
    assert "r2" in one.T_team_map


def test_of_two_alignments_that_lead_where_nobody_is_the_better_one_is_believed() -> None:
    one = met()
    through_r3(one, NEARER)
    witness, _ = watch(one)
    witness.on_claim(claim(one, NEARER, -2.0), one.team, BEGIN + 20 * S)
    witness.look(one.team, BEGIN + 20 * S)
    merge_pair(one, ("r2", "r3"), se2.between(NEARER, se2.transform(0.3, 0.1, 0.2)), 0.95)
    (unmerged,) = witness.look(one.team, BEGIN + 21 * S)
    assert isinstance(unmerged, Event) and (unmerged.fields["a"], unmerged.fields["b"]) == ("r1", "r3")


def test_what_two_others_saw_of_each_other_ends_an_alignment_between_them() -> None:
    one = met()
    one.team.take_map("r4", one.team.maps["r2"])
    through_r3(one, NEARER)
    merge_pair(one, ("r3", "r4"), se2.transform(0.0, 0.4, 0.0))
    place = one.team.layout.T_between("r2", "r4")
    witness = Witness("r1", MutualDetectionConfig(teammates_visible=True))
    for peer, robot_id, T in (("r2", "r4", place), ("r4", "r2", se2.inverse(place))):
        assert witness.look(one.team, BEGIN) == []
        witness.on_claim(TeammateClaim(peer, one.team.maps[peer].epoch, robot_id, T, -3.0), one.team, BEGIN)
    (unmerged,) = witness.look(one.team, BEGIN)
    assert isinstance(unmerged, Event) and (unmerged.fields["a"], unmerged.fields["b"]) == ("r2", "r3")


def test_the_right_place_through_others_stays() -> None:
    one = met()
    through_r3(one, RIGHT)
    witness, effects = watch(one)
    witness.on_claim(claim(one, RIGHT, -99.0), one.team, BEGIN + 20 * S)
    assert effects == [] == witness.look(one.team, BEGIN + 20 * S) and "r2" in one.T_team_map


def test_the_right_place_is_not_given_up_whatever_one_robot_claims() -> None:
    one = met()
    merge(one, RIGHT.tolist())
    witness, effects = watch(one)
    witness.on_claim(claim(one, RIGHT, -99.0), one.team, BEGIN + 20 * S)
    assert effects == [] == witness.look(one.team, BEGIN + 20 * S) and "r2" in one.T_team_map


def test_without_encounters_nothing_is_concluded() -> None:
    one = met()
    merge(one, NEARER.tolist())
    witness, effects = watch(one, mutual=True, encounters=False)
    assert effects == [] == witness.claims(one.team, BEGIN + 9 * S)
    assert not isinstance(one.next_job(BEGIN + 9 * S), AlignJob) or one.next_job(BEGIN + 9 * S) is None


@pytest.mark.parametrize(("contradicted_m", "merges"), [(0.0, True), (6.0, False)])
def test_robots_that_see_each_other_merge_unless_their_maps_contradict_it(contradicted_m: float, merges: bool) -> None:
    one = met()
    watch(one, mutual=True)
    job = one.next_job(BEGIN + 10 * S)
    assert isinstance(job, AlignJob) and job.sighted is not None and job.prior is not None
    assert se2.difference(job.sighted, RIGHT)[0] < 0.5
    effects = one.on_done(job, too_little(job.sighted, contradicted_m), BEGIN + 10 * S)
    assert ("r2" in one.T_team_map) == merges
    assert any(isinstance(one_effect, Event) and one_effect.kind == "merged" for one_effect in effects) == merges


def test_a_wrong_merge_gives_way_to_where_the_robots_see_each_other() -> None:
    one = met()
    merge(one, NEARER.tolist())
    watch(one, mutual=True)
    job = one.next_job(BEGIN + 10 * S)
    while not isinstance(job, AlignJob):
        job = one.next_job(BEGIN + 10 * S)
    assert job.sighted is not None
    one.on_done(job, too_little(job.sighted), BEGIN + 10 * S)
    assert se2.difference(one.T_team_map["r2"], RIGHT)[0] < 0.5


def test_a_body_seen_decides_between_places_that_fit_alike_and_a_claim_of_the_same_size_for_another_does_not() -> None:
    one = met()
    belief = one.team.beliefs["r1", "r2"]
    belief.places.add(RIGHT, "maps", 0)
    witness, _ = watch(one)
    witness.look(one.team, BEGIN + 20 * S)
    assert belief.places.supported is not None and belief.alignment is None
    ambiguous = Rejection("ambiguous", 0.4, walls(30.0, 1.0), "auto", RIGHT)
    job = AlignJob("r1", "r2", *(one.team.maps[x].grid for x in ("r1", "r2")), None,
                   (one.team.maps["r1"].version, one.team.maps["r2"].version), (1.0, 1.0), 0)  # fmt: skip
    one.on_done(job, ambiguous, BEGIN + 20 * S)
    assert belief.alignment is not None and belief.alignment.method == "sight"
    elsewhere = Rejection("ambiguous", 0.4, walls(50.0, 1.0), "auto", NEARER)  # a search everywhere: margin 0.1
    one.on_done(job, elsewhere, BEGIN + 30 * S)
    assert "r2" in one.T_team_map


def test_claims_are_made_when_they_change_and_repeated_seldom() -> None:
    one = met()
    merge(one, RIGHT.tolist())
    one.team.beliefs["r1", "r2"].places.add(NEARER, "maps", 0)
    witness, _ = watch(one)
    now_ns = BEGIN + 9 * S
    told = {round(llr): T for peer, T, llr, _ in witness.claims(one.team, now_ns)}
    assert set(told) == {6, -3}
    np.testing.assert_allclose(told[6], RIGHT, atol=1e-9)
    assert witness.claims(one.team, now_ns + 2 * S) == []
    epoch = one.team.maps["r2"].epoch
    witness.on_report(TeammatePose("r2", 0, np.zeros(3), epoch), one.team, now_ns + REPEAT_NS)  # still in contact
    assert len(witness.claims(one.team, now_ns + REPEAT_NS)) == 2


def test_a_claim_is_made_again_where_it_changed_by_a_sighting_and_not_within_a_second() -> None:
    one = met()
    merge(one, RIGHT.tolist())
    witness, _ = watch(one)
    (place,) = one.team.beliefs["r1", "r2"].places
    now_ns = BEGIN + (len(OWN) - 1) * S  # of the last report
    assert place.own is not None and [llr for _, _, llr, _ in witness.claims(one.team, now_ns)] == [place.own.llr]
    before = place.own
    place.own = replace(before, seen=before.seen - 2)
    assert abs(place.own.llr - before.llr) > CHANGED_LLR
    assert witness.claims(one.team, now_ns + S // 2) == []
    assert [llr for _, _, llr, _ in witness.claims(one.team, now_ns + S)] == [place.own.llr]
    assert witness.claims(one.team, now_ns + 2 * S) == []


def test_bodies_are_reported_until_the_teammate_is_seen_where_it_is_placed() -> None:
    one = met()
    witness, _ = watch(one)
    assert witness.bodies_m(one.team, BEGIN + 9 * S) is not None
    merge(one, RIGHT.tolist())
    assert witness.bodies_m(one.team, BEGIN + 9 * S) is not None  # what was seen is not weighed yet
    witness.look(one.team, BEGIN + 9 * S)
    assert witness.bodies_m(one.team, BEGIN + 9 * S) is None


def test_no_bodies_are_reported_of_a_teammate_that_is_placed_by_way_of_others_until_it_is_missed_there() -> None:
    for T_r1_r2, is_settled in ((RIGHT, True), (NEARER, False)):
        one = met()
        through_r3(one, T_r1_r2)
        witness, _ = watch(one)
        assert (witness.bodies_m(one.team, BEGIN + 9 * S) is None) == is_settled


def test_furniture_is_reported_for_some_seconds_and_what_moves_always() -> None:
    standing, still = Standing(), np.array([2.0, 1.0])
    said = [standing.are_new(np.array([still, [0.1 * k, 5.0]]), k * S // 2).tolist() for k in range(20)]
    assert said[0] == [True, True] and said[-1] == [False, True]
    assert standing.are_new(still[None], 100 * S).tolist() == [True]  # it was forgotten


def test_a_supported_place_lets_its_maps_be_corrected_but_not_be_laid_elsewhere() -> None:
    places = Hypotheses()
    place = places.add(RIGHT, "sight", 0)
    assert place is not None
    place.told["r2"] = 6.0
    corrected, elsewhere = (
        weighed(places, Alignment(RIGHT + np.array([off_m, 0.0, 0.0]), 0.9, walls(60.0, 0.0), np.eye(3) * 1e-4, "auto"))
        for off_m in (0.8, 3.0)
    )
    assert isinstance(corrected, Alignment)
    assert isinstance(elsewhere, Rejection) and "saw each other" in elsewhere.reason
    place.told["r2"] = -6.0
    refused = weighed(places, Alignment(RIGHT, 0.9, walls(60.0, 0.0), np.eye(3) * 1e-4, "auto"))
    assert isinstance(refused, Rejection) and "nobody was there" in refused.reason


def test_a_robot_that_was_resumed_looks_at_the_places_it_believes() -> None:
    one = met()
    merge(one, NEARER.tolist())
    belief = one.team.beliefs["r1", "r2"]
    belief.places = Hypotheses()  # a checkpoint keeps none
    watch(one)
    (place,) = belief.places
    assert place.own is not None and place.own.not_there >= 3


@pytest.mark.parametrize(
    ("llr_here", "llr_rival", "decided"),
    [(0, 0, None), (-6, 0, "rival"), (0, 6, "rival"), (0, -6, "here"), (-6, -6, None)],
)
def test_of_places_that_fit_alike_sightings_leave_one(llr_here: float, llr_rival: float, decided: str | None) -> None:
    places = Hypotheses()
    for T, llr in ((RIGHT, llr_here), (NEARER, llr_rival)):
        place = places.add(T, "maps", 0)
        assert place is not None
        place.told["r2"] = llr
    found = weighed(places, Rejection("ambiguous", 0.4, walls(30.0, 1.0), "auto", RIGHT, rivals=(NEARER,)))
    if decided is None:
        assert isinstance(found, Rejection)
    else:
        assert isinstance(found, Alignment)
        np.testing.assert_array_equal(found.T_a_b, RIGHT if decided == "here" else NEARER)


def test_places_that_fit_as_well_are_kept() -> None:
    one = met()
    job = one.next_job(BEGIN)
    assert isinstance(job, AlignJob)
    one.on_done(job, Rejection("ambiguous", 0.4, walls(30.0, 1.0), "auto", RIGHT, rivals=(NEARER,)), BEGIN)
    belief = one.team.beliefs["r1", "r2"]
    assert [place.is_at(T) for place, T in zip(belief.places, (RIGHT, NEARER), strict=True)] == [True, True]
    assert "ambiguous between" in belief.words


@pytest.mark.parametrize("own", ["r1", "r3"])
def test_what_is_seen_is_said_of_the_same_place_whatever_the_order_of_names(own: str) -> None:
    one = met(own)
    right, nearer = (T if own < "r2" else se2.inverse(T) for T in (RIGHT, NEARER))
    places = one.team.beliefs[pair_of(own, "r2")].places
    place = places.add(right, "maps", 0)
    witness, _ = watch(one)
    assert place is not None and place.own is not None and place.own.seen >= 3 and place.own.not_there == 0
    wrong = places.add(nearer, "maps", 0)  # weighed by what was seen before
    witness.look(one.team, BEGIN + 9 * S)
    assert wrong is not None and wrong.own is not None and wrong.own.seen == 0 and wrong.own.not_there >= 3
    told = {llr > 0.0: T_own_other for _, T_own_other, llr, _ in witness.claims(one.team, BEGIN + 9 * S)}
    np.testing.assert_allclose(told[True], RIGHT, atol=1e-9)
    np.testing.assert_allclose(told[False], NEARER, atol=1e-9)


@pytest.mark.parametrize("own", ["r1", "r3"])
def test_a_place_by_sight_is_that_of_the_pair_whatever_the_order_of_names(own: str) -> None:
    one = met(own)
    watch(one, mutual=True)
    (place,) = one.team.beliefs[pair_of(own, "r2")].places
    assert place.by == "sight" and place.fix is not None
    for T_a_b in (place.T_a_b, place.fix.T_map_mate):
        assert se2.difference(T_a_b, RIGHT if own < "r2" else se2.inverse(RIGHT))[0] < 0.5


def test_where_a_teammate_is_on_a_map_that_is_not_here_says_nothing_of_the_one_that_is() -> None:
    one = met()
    place = one.team.beliefs["r1", "r2"].places.add(NEARER, "maps", 0)
    watch(one, epoch=one.team.maps["r2"].epoch + 1)
    assert place is not None and place.own is not None and (place.own.seen, place.own.not_there) == (0, 0)


def test_what_was_seen_of_a_teammate_on_its_old_map_says_nothing_of_its_new_one() -> None:
    one = met()
    witness, _ = watch(one)
    epoch, revision = one.team.maps["r2"].version
    one.team.take_map("r2", KnownMap((epoch + 1, revision), one.team.maps["r2"].local))  # through a third robot
    place = one.team.beliefs["r1", "r2"].places.add(NEARER, "maps", 0)
    witness.look(one.team, BEGIN + 9 * S)
    assert place is not None and place.own is not None and (place.own.seen, place.own.not_there) == (0, 0)


def test_only_reports_of_the_time_of_a_scan_count_and_each_place_once() -> None:
    encounters, stamp_ns = Encounters(MutualDetectionConfig()), BEGIN + S // 10
    encounters.on_scan(sweep(OWN[0], [MATE[0][:2]]), OWN[0], BEGIN)
    assert encounters.on_report(TeammatePose("r2", BEGIN + S, MATE[0], 1)) is None
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[0], 1)) is not None
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[0], 1)) is None  # nobody has moved since
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[-1], 1)) is not None
    assert len(encounters.moments("r2", 1)) == 2
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[0], 2)) is not None  # in another map
    assert len(encounters.moments("r2", 2)) == 1 and encounters.moments("r2", 1) == []


def test_what_was_seen_on_a_map_that_was_given_up_is_forgotten() -> None:
    encounters = Encounters(MutualDetectionConfig())
    for k in range(60):  # the other stands there for six seconds
        encounters.on_scan(sweep(OWN[0], [MATE[4][:2]], seed=k), OWN[0], BEGIN + k * S // 10)
        are_new = len(encounters.moving_bodies_m()) > 0
    assert encounters.on_report(TeammatePose("r2", BEGIN + 6 * S, MATE[4], 1)) is not None and not are_new
    encounters.forget()
    assert encounters.moments("r2", 1) == [] and not len(encounters.moving_bodies_m())
    assert encounters.on_report(TeammatePose("r2", BEGIN + 6 * S, MATE[0], 1)) is None  # no scan is left
    encounters.on_scan(sweep(OWN[0], [MATE[4][:2]]), OWN[0], BEGIN + 7 * S)
    assert len(encounters.moving_bodies_m())


@pytest.mark.parametrize(("visible", "most_llr"), [(True, MOST_UNSEEN_LLR), (False, MOST_HIDDEN_LLR)])
def test_free_sight_says_less_where_teammates_may_be_too_low_to_be_seen(visible: bool, most_llr: float) -> None:
    assert Encounters(MutualDetectionConfig(teammates_visible=visible)).most_unseen_llr == most_llr


def test_nothing_is_claimed_of_a_map_that_its_robot_gave_up() -> None:
    one = met()
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness, _ = watch(one)
    t_ns = BEGIN + 40 * S
    epoch = one.team.maps["r2"].epoch
    for reported, claims in ((epoch + 1, 0), (epoch, 1)):  # r2's new map has not come yet
        witness.on_report(TeammatePose("r2", t_ns, np.zeros(3), reported, np.empty((0, 2))), one.team, t_ns)
        assert len(witness.claims(one.team, t_ns)) == claims


@pytest.mark.parametrize(("of_peer", "of_robot", "counts"), [(0, 0, True), (1, 0, False), (0, 1, False)])
def test_a_claim_counts_for_the_maps_that_it_is_about_alone(of_peer: int, of_robot: int, counts: bool) -> None:
    one = met()
    made = claim(one, RIGHT, 6.0)
    about = (made.of_robot or 0) + of_robot
    Witness("r1", MutualDetectionConfig()).on_claim(
        replace(made, epoch=made.epoch + of_peer, of_robot=about), one.team, BEGIN
    )
    assert bool(list(one.team.beliefs["r1", "r2"].places)) == counts


def test_what_was_told_of_places_that_are_gone_is_forgotten() -> None:
    one = met()
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness, _ = watch(one)
    assert witness.claims(one.team, BEGIN + 9 * S) and witness._told
    one.team.beliefs["r1", "r2"] = PairBelief()
    assert not witness.claims(one.team, BEGIN + 10 * S) and not witness._told


@pytest.mark.parametrize(("claimed", "counted"), [(99.0, MOST_SEEN_LLR), (-99.0, MOST_UNSEEN_LLR), (1.5, 1.5)])
def test_a_claim_counts_for_no_more_than_sightings_can_say(claimed: float, counted: float) -> None:
    one = met()
    Witness("r1", MutualDetectionConfig()).on_claim(claim(one, RIGHT, claimed), one.team, BEGIN)
    (place,) = one.team.beliefs["r1", "r2"].places
    assert place.told == {"r2": counted}
