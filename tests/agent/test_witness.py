"""What robots see of each other decides how their maps lie, and what they tell each other of it."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.effects import AlignJob, Event
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.hypotheses import Hypotheses
from mrslam.agent.pairs.weighing import weighed
from mrslam.agent.witness import Witness
from mrslam.alignment import Alignment, Rejection
from mrslam.comms import TeammateClaim
from mrslam.merge.graph.edges import pair_of
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.mutual_detection.encounters import MOST_HIDDEN_LLR, NOT_THERE_LLR
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform
from tests.agent.duo import S, merge
from tests.agent.sightings import BEGIN, NEARER, claim, merge_pair, met, through_r3, walls, watch
from tests.mutual_detection.test_encounters import RIGHT


def too_little(T: Transform, contradicted_m: float = 0.0) -> Rejection:
    return Rejection("too little wall", 0.3, walls(3.0, contradicted_m), "auto", T)


def test_a_place_where_nobody_is_is_given_up_once_a_robot_has_looked() -> None:
    one = met()
    merge(one, NEARER.tolist())
    _, effects = watch(one)
    (unmerged,) = effects
    assert isinstance(unmerged, Event) and unmerged.kind == "unmerged"
    assert f"nobody was there ({NOT_THERE_LLR} nats)" in str(unmerged.fields)
    assert "r2" not in one.T_team_map
    for t_ns in (200 * S, 300 * S):  # maps propose it again
        job = one.next_job(t_ns)
        if isinstance(job, AlignJob):
            one.on_done(job, Alignment(NEARER, 0.9, walls(60.0, 0.0), np.eye(3) * 1e-4, "auto"), t_ns)
    assert "r2" not in one.T_team_map and "nobody was there" in one.team.beliefs["r1", "r2"].reason


def test_robots_that_may_be_too_low_for_each_others_lasers_stay_where_neither_sees_the_other() -> None:
    one = met()
    merge(one, NEARER.tolist())
    witness, effects = watch(one, visible=False)
    witness.on_claim(claim(one, NEARER, MOST_HIDDEN_LLR), one.team, BEGIN + 20 * S)
    assert effects == [] == witness.look(one.team, BEGIN + 20 * S) and "r2" in one.T_team_map


def test_a_place_where_each_of_two_robots_looked_once_is_given_up() -> None:
    one = met()
    merge(one, NEARER.tolist())
    witness, _ = watch(one, visible=False)
    witness.on_claim(claim(one, NEARER, -1.2), one.team, BEGIN + 20 * S)
    assert len(witness.look(one.team, BEGIN + 20 * S)) == 1 and "r2" not in one.T_team_map


@pytest.mark.parametrize(("seen_llr", "stays"), [(1.5, False), (6.0, True)])
def test_a_place_through_others_where_nobody_is_ends_no_alignment_that_robots_saw_more_surely(
    seen_llr: float, stays: bool
) -> None:
    one = met()
    through_r3(one, NEARER)
    for pair, belief in one.team.beliefs.items():
        if "r3" in pair:
            assert belief.alignment is not None
            seen = belief.places.add(belief.alignment.T_a_b, "r3", BEGIN)
            assert seen is not None
            seen.told["r3"] = seen_llr
    _, effects = watch(one)
    assert (effects == []) == stays == ("r2" in one.T_team_map)


def test_a_place_through_others_where_nobody_is_ends_the_weakest_alignment_between() -> None:
    one = met()
    through_r3(one, NEARER)
    witness, effects = watch(one)
    (unmerged,) = effects
    assert isinstance(unmerged, Event) and (unmerged.fields["a"], unmerged.fields["b"]) == ("r2", "r3")
    ((peer, T, llr, _),) = witness.claims(one.team, BEGIN + 6 * S)
    assert peer == "r2" and se2.difference(T, NEARER)[0] < 0.1 and llr < 0.0  # r2 is asked to look there, too
    assert one.T_team_map.keys() == {"r1", "r3"} and witness.look(one.team, BEGIN + 21 * S) == []
    T_r2_r3 = se2.between(NEARER, se2.transform(0.3, 0.1, 0.2))
    merge_pair(one, ("r2", "r3"), T_r2_r3, 0.7)  # not merged and unmerged by turns
    assert "r2" not in one.T_team_map and "placed through it, r1 and r2" in one.team.beliefs["r2", "r3"].reason
    elsewhere = se2.compose(T_r2_r3, se2.transform(3.0, 0.0, 0.0))
    merge_pair(one, ("r2", "r3"), elsewhere, 0.7)  # no more wall agrees there
    assert "r2" not in one.T_team_map and "alike at several places" in one.team.beliefs["r2", "r3"].reason
    merge_pair(one, ("r2", "r3"), elsewhere, 0.7, wall_m=120.0)
    assert "r2" in one.T_team_map


def test_of_two_alignments_that_lead_where_nobody_is_the_better_one_is_believed() -> None:
    one = met()
    through_r3(one, NEARER)
    witness, _ = watch(one)
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
        witness.on_claim(TeammateClaim(peer, one.team.maps[peer].epoch, robot_id, T, -1.0), one.team, BEGIN)
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
    [(0, 0, None), (6, 0, "here"), (0, 6, "rival"), (-6, 6, "rival"), (-6, 0, None), (0, -6, None), (-6, -6, None)],
)
def test_of_places_that_fit_alike_that_is_right_where_robots_saw_each_other_and_no_other_for_being_left(
    llr_here: float, llr_rival: float, decided: str | None
) -> None:
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
