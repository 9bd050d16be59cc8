"""Team maps that joint solutions bend: what is drawn, judged and kept of them."""

from dataclasses import replace

import numpy as np
import pytest

from mrslam.merge import Bend, Trail
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.ways import HELD_M, Ways
from mrslam.spatial import KeyScans, OccupancyGrid, se2
from tests.merge.plans import alignment, truth
from tests.merge.trio import EDGES, MAPS, POSES, Mapper, fingerprint, mapper_of

KEYS = np.array([[float(x), 1.0, 0.0] for x in range(4)])


SCANNED = Trail(KEYS, KeyScans.of_points([np.ones((5, 2))] * 4, np.zeros((4, 2))), 1_000_000_000 * np.arange(4))


def scanned(edges=EDGES, anchor="r1") -> Mapper:
    mapper = mapper_of({}, edges, anchor)
    for robot_id, grid in MAPS.items():
        mapper.set_map(robot_id, grid, SCANNED)
    return mapper


def test_maps_with_scans_are_held_against_each_other_once_they_were_joined_and_not_before():
    """Rigidly laid over each other, bent maps contradict each other though their alignment is right."""
    turned = np.add(truth(POSES, "r1", "r2"), [0.0, 0.0, np.pi / 2])
    mapper = scanned({("r1", "r2"): alignment(turned)})
    assert list(mapper.team_map().T_team_map) == ["r1", "r2"]
    mapper.bent = BentTeam(joined=frozenset(MAPS), T_a_b={("r1", "r2"): turned})
    team_map = mapper.team_map()
    assert list(team_map.T_team_map) == ["r1"] and "contradicted" in team_map.dropped["r1", "r2"]


def test_nobody_is_bent_by_a_solution_with_one_who_was_unmerged():
    mapper = scanned()
    T_team_map = mapper.team_map().T_team_map
    shift = {"r1": se2.IDENTITY, "r2": se2.transform(0.1, 0.0, 0.0), "r3": se2.transform(0.0, 0.2, 0.0)}
    bends = {x: Bend(KEYS, se2.compose(shift[x], se2.compose(T, KEYS))) for x, T in T_team_map.items()}
    stamps = dict.fromkeys(MAPS, SCANNED.stamps_ns)
    T_a_b = {pair: found.T_a_b for pair, found in EDGES.items()}
    mapper.bent = BentTeam(bends=bends, joined=frozenset(MAPS), T_a_b=T_a_b, stamps_ns=stamps)
    placement = mapper.placement(mapper.found)
    assert placement.bends.keys() == set(MAPS)
    assert placement.T_team_map["r2"] == pytest.approx(se2.compose(shift["r2"], T_team_map["r2"]))
    without = mapper.placement({("r1", "r2"): EDGES["r1", "r2"]})
    assert not without.bends and list(without.T_team_map) == ["r1", "r2"]
    assert without.T_team_map["r2"] == pytest.approx(T_team_map["r2"], abs=0.02)


@pytest.mark.parametrize(
    ("tied", "bent"), [((("r1", "r2"), ("r2", "r3")), False), ((("r1", "r3"), ("r2", "r3")), True), ((), True)]
)
def test_a_solution_whose_ties_came_of_an_alignment_that_was_withdrawn_since_bends_nobody(tied, bent):
    edges = {**EDGES, ("r1", "r3"): alignment(truth(POSES, "r1", "r3"))}
    mapper, ties = scanned(edges), tuple(Tie(*pair, KeyMatch(0, 0, np.zeros(3), np.eye(3)), True) for pair in tied)
    mapper.bent = replace(solution(0.1), ties=ties, T_a_b={pair: found.T_a_b for pair, found in edges.items()})
    assert mapper.placement(edges).bends.keys() == set(MAPS)
    left = mapper.placement({pair: found for pair, found in edges.items() if pair != ("r1", "r2")})
    assert list(left.T_team_map) == ["r1", "r2", "r3"] and bool(left.bends) is bent


def test_a_map_that_moved_in_its_frame_is_drawn_where_it_is_now():
    mapper = mapper_of()
    mapper.team_map()
    x_m, y_m = MAPS["r2"].origin_m
    moved = OccupancyGrid(MAPS["r2"].cells, 0.05, (x_m + 0.5, y_m))
    mapper.set_map("r2", moved)
    assert fingerprint(mapper.team_map()) == fingerprint(mapper_of({**MAPS, "r2": moved}).team_map())


def solution(shift_m: float, keys: np.ndarray = KEYS) -> BentTeam:
    """Return a joint solution that moves r2 sideways from where alignments place it; it was at its ``keys (K, 3)``."""
    bends = {}
    for x, T in mapper_of(anchor="r1").team_map().T_team_map.items():
        own = keys if x == "r2" else KEYS
        bends[x] = Bend(own, se2.compose(se2.transform(0.0, shift_m if x == "r2" else 0.0, 0.0), se2.compose(T, own)))
    T_a_b = {pair: found.T_a_b for pair, found in EDGES.items()}
    stamps = dict.fromkeys(MAPS, SCANNED.stamps_ns)
    return BentTeam(bends=bends, joined=frozenset(MAPS), T_a_b=T_a_b, stamps_ns=stamps)


def test_another_joint_solution_and_a_map_that_has_grown_are_drawn_as_from_nothing():
    mapper, grown = scanned(), MAPS["r2"].cells.copy()
    grown[60:70, 60:70] = 100
    first, second = solution(0.0), solution(0.1)
    for bent, cells in ((first, MAPS["r2"].cells), (second, MAPS["r2"].cells), (second, grown)):
        new = scanned()
        for one in (mapper, new):
            one.set_map("r2", OccupancyGrid(cells, 0.05, MAPS["r2"].origin_m), SCANNED)
            one.bent = bent
        assert fingerprint(mapper.team_map()) == fingerprint(new.team_map())


def test_another_joint_solution_is_judged_anew():
    mapper = scanned()
    mapper.bent = solution(0.0)
    assert list(mapper.team_map().T_team_map) == ["r1", "r2", "r3"]
    mapper.bent = solution(0.8)
    assert "contradicted" in mapper.team_map().dropped["r1", "r2"]
    mapper.bent = solution(0.8, KEYS + np.array([100.0, 0.0, 0.0]))  # it saw from afar what others saw
    assert list(mapper.team_map().T_team_map) == ["r1", "r2", "r3"]


@pytest.mark.parametrize(("through", "goes"), [(("r1", "r3"), ("r1", "r3")), (("r1", "r2"), ("r1", "r2"))])
def test_maps_laid_wrongly_by_way_of_ties_end_the_weakest_of_these_and_not_their_own_alignment(through, goes):
    edges = {**EDGES, ("r1", "r3"): replace(alignment(truth(POSES, "r1", "r3")), confidence=0.6)}
    mapper, bent, afar = scanned(edges), solution(0.8), KEYS + np.array([100.0, 0.0, 0.0])
    r3 = Bend(afar, se2.compose(bent.bends["r3"].T_team_map, afar))  # what r3 saw speaks against nobody
    ties = tuple(Tie(*pair, KeyMatch(0, 0, np.zeros(3), np.eye(3)), True) for pair in (through, ("r2", "r3")))
    mapper.bent = replace(
        bent, bends={**bent.bends, "r3": r3}, ties=ties, T_a_b={pair: found.T_a_b for pair, found in edges.items()}
    )
    assert "contradicted" in mapper.team_map().dropped[goes]
    assert (("r1", "r2") in mapper.team_map().dropped) is (goes == ("r1", "r2"))


@pytest.mark.parametrize(("key", "is_over"), [(0, True), (4, False)])
def test_bent_maps_are_held_against_each_other_only_where_ties_hold_them(key, is_over):
    """Far along its way from what ties it a bent map has drifted, and its walls say nothing against the tie."""
    mapper = scanned()
    mapper.bent = solution(0.8)
    on = np.vstack([KEYS, [[3.0 + HELD_M, 1.0, 0.0]]])  # it went on before it met anybody
    longer = Trail(on, SCANNED.scans.append(SCANNED.scans.part(0, 1)))
    ties = [Tie(*pair, KeyMatch(key, 0, np.zeros(3), np.eye(3)), True) for pair in (("r2", "r1"), ("r2", "r3"))]
    mapper.bent = replace(mapper.bent, ways=Ways({"r1": SCANNED, "r2": longer, "r3": SCANNED}, ties))
    assert (("r1", "r2") in mapper.team_map().dropped) is is_over
