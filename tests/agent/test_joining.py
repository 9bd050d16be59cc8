"""Maps that met are bent until what their robots saw agrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent.config import Settings
from mrslam.agent.effects import AlignJob, Event, JoinJob
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.hypotheses import SUPPORTED_LLR
from mrslam.agent.team import Team
from mrslam.alignment import Alignment, Evidence, WallEvidence
from mrslam.merge import join
from mrslam.merge.grids.agreement import Walls, compare
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bent_map import BentMap
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, se2
from tests.merge.joint.blocks import drive, errors_m, local_map

S = 1_000_000_000
A, B = drive(0.0, 70.0, 0.002, seed=1), drive(30.0, 80.0, -0.002, seed=2)
"""Bent by 8 degrees within 70 m: laid over each other rigidly their walls cross."""
T_A_B = se2.between(A.truth[0], B.truth[0])
MAPS = {"a": local_map(A), "b": local_map(B)}


def team_of(own: str = "a", maps: dict[str, LocalMap] | None = None) -> Team:
    team = Team(own, Settings())
    for name, local in (maps or MAPS).items():
        team.take_map(name, KnownMap((1, 1), local))
    return team


def align(team: Team, T_a_b: np.ndarray = T_A_B, t_s: int = 10) -> list[Event]:
    """Let the pair be found twice at one place."""
    found = Alignment(
        T_a_b=T_a_b, confidence=0.9, evidence=Evidence(WallEvidence(60.0), WallEvidence(60.0)),
        covariance=1e-4 * np.eye(3), method="orb",
    )  # fmt: skip
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    areas = (team.maps["a"].area_m2, team.maps["b"].area_m2)
    events = []
    for attempt in range(2):
        job = AlignJob("a", "b", nothing, nothing, None, ((1, 1), (1, 1)), areas, attempt)
        events += team.on_aligned(job, found, (t_s + attempt) * S)
    return events


def joined(team: Team, t_s: int = 12) -> list[Event]:
    """Do the join that is due."""
    job = team.next_job(t_s * S)
    assert isinstance(job, JoinJob)
    return team.on_joined(job, join(job.trails, job.T_team_map), t_s * S)


def test_joint_solutions_are_told_where_robots_saw_each_other():
    team = team_of()
    align(team)
    assert not team.next_job(12 * S).seen
    team = team_of()
    align(team)
    place = team.beliefs["a", "b"].places.at(T_A_B)
    place.told["b"] = SUPPORTED_LLR
    job = team.next_job(12 * S)
    assert list(job.seen) == [("a", "b")] and np.array_equal(job.seen["a", "b"], job.T_a_b["a", "b"])


def kinds(events: list[Event]) -> list[str]:
    return [event.kind for event in events]


def test_bent_maps_are_merged_joined_and_stay_merged() -> None:
    team = team_of()
    assert kinds(align(team)) == ["alignment", "alignment", "merged"]
    events = joined(team)
    assert kinds(events) == ["joined"]
    assert events[0].fields["ties"]["a-b"] >= 12
    kept = sum(events[0].fields["ties"].values())
    assert kept == sum(tie.believed for tie in team.layout.ties)
    assert events[0].fields["dropped"] == len(team.layout.ties) - kept != kept
    team.keep_placed(20 * S)
    assert team.revoke(20 * S) == [] and sorted(team.layout.T_team_map) == ["a", "b"]
    ways = team.layout.keyframes()
    assert errors_m(A, B, ways["a"].T_map_base, ways["b"].T_map_base).mean() < 0.1


def test_without_their_scans_the_same_maps_contradict_each_other() -> None:
    blind = {name: LocalMap(local.map, local.keyframes) for name, local in MAPS.items()}
    team = team_of(maps=blind)
    assert "unmerged" in kinds(align(team))


def test_the_team_map_is_one_building() -> None:
    team = team_of()
    align(team)
    joined(team)
    rigid = compare(*(Walls(TiledGrid.of(team.maps[x].grid)) for x in "ab"), T_A_B, 0.1)
    bent = [Walls(TiledGrid.of(bend.bent(team.maps[x].grid))) for x, bend in sorted(team.layout.bends.items())]
    placed = compare(*bent, se2.between(*(bend.T_team_map for _, bend in sorted(team.layout.bends.items()))), 0.1)
    assert rigid.share_against > 0.3 and placed.share_against < 0.06
    walls = team.map().grid.is_occupied.sum()
    assert walls > 0.9 * max(team.maps[x].grid.is_occupied.sum() for x in "ab")  # no map's walls are rubbed out


def test_a_merge_at_a_wrong_place_is_taken_back_once_joined() -> None:
    team = team_of()
    align(team, se2.compose(se2.transform(1.5, 9.0, 1.2), T_A_B))
    assert kinds(joined(team)) == ["joined", "unmerged"]
    assert list(team.layout.T_team_map) == ["a"] and not team.layout.bends


def test_unmerged_the_team_map_is_that_of_before() -> None:
    alone = team_of().map().grid
    team = team_of()
    align(team)
    joined(team)
    assert not np.array_equal(team.map().grid.cells, alone.cells)
    team.beliefs["a", "b"].revoke("for a test")
    team._place(30 * S)
    team._map = None
    assert np.array_equal(team.map().grid.cells, alone.cells)


def test_own_maps_are_untouched() -> None:
    before = MAPS["a"].map.to_grid().cells.tobytes(), MAPS["a"].keyframes.T_map_base.tobytes()
    team = team_of()
    align(team)
    joined(team)
    team.map()
    assert (team.maps["a"].grid.cells.tobytes(), team.maps["a"].local.keyframes.T_map_base.tobytes()) == before


@pytest.mark.parametrize("own", ["a", "b"])
def test_the_same_knowledge_gives_the_same_bytes(own: str) -> None:
    one, two = team_of(own), team_of(own, dict(reversed(MAPS.items())))
    for team in (one, two):
        align(team)
        joined(team)
    assert one.map().grid.cells.tobytes() == two.map().grid.cells.tobytes()
    assert one.layout.T_team_map["b"].tobytes() == two.layout.T_team_map["b"].tobytes()
    assert np.array_equal(one.layout.T_team_map[own], se2.IDENTITY)


def test_it_is_joined_again_only_when_there_is_news() -> None:
    half = {"a": MAPS["a"], "b": local_map(B, keyframes=105)}
    team = team_of(maps=half)
    align(team)
    joined(team)
    assert not isinstance(team.next_job(40 * S), JoinJob)
    team.take_map("b", KnownMap((1, 2), local_map(B, 2)))
    team.keep_placed(60 * S)
    assert isinstance(team.next_job(60 * S), JoinJob)


def test_alignments_that_change_in_quick_succession_are_joined_together() -> None:
    team = team_of()
    align(team)
    joined(team)
    align(team, se2.compose(T_A_B, se2.transform(0.2, 0.0, 0.0)), t_s=13)
    assert not isinstance(team.next_job(14 * S), JoinJob)
    assert isinstance(team.next_job(16 * S), JoinJob)


def test_a_map_begun_anew_meanwhile_makes_the_solution_void() -> None:
    team = team_of()
    align(team)
    job = team.next_job(12 * S)
    assert isinstance(job, JoinJob)
    joint = join(job.trails, job.T_team_map)
    team.take_map("b", KnownMap((2, 1), local_map(B, keyframes=40)))
    assert team.on_joined(job, joint, 13 * S) == []
    assert not team.layout.bends and list(team.layout.T_team_map) == ["a"]


def test_where_the_own_map_is_bent_the_own_place_in_the_team_map_is_another() -> None:
    team = team_of()
    assert np.array_equal(team.layout.T_team_own, se2.IDENTITY)
    align(team)
    joined(team)
    last = A.trail.T_map_key[-1]
    assert se2.compose(team.layout.T_team_own, last) == pytest.approx(team.layout.keyframes()["a"].T_map_base[-1])
    T_own_b = team.layout.T_own_map("b")
    assert se2.compose(team.layout.T_team_own, T_own_b) == pytest.approx(team.layout.T_team_map["b"])


def test_a_solution_bends_each_map_once_for_judging_and_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    bent: list[object] = []
    draw = BentMap.draw
    monkeypatch.setattr(BentMap, "draw", lambda self, *args: bent.append(self) or draw(self, *args))
    team = team_of()
    align(team)
    joined(team)
    team.map()
    assert len(bent) == 2


def test_a_map_whose_keyframes_stayed_keeps_its_bend() -> None:
    team = team_of()
    align(team)
    joined(team)
    before = dict(team.layout.bends)
    moved = LocalMap(MAPS["b"].map, Keyframes(MAPS["b"].keyframes.stamps_ns, B.trail.T_map_key + 0.01), B.trail.scans)
    team.take_map("a", KnownMap((1, 2), local_map(A, 2)))
    team.take_map("b", KnownMap((1, 2), moved))
    team.keep_placed(60 * S)
    assert team.layout.bends["a"] is before["a"]
    assert np.array_equal(team.layout.bends["b"].T_map_key, B.trail.T_map_key + 0.01)
    assert team.layout.bends["b"].T_team_key is before["b"].T_team_key


def test_a_pair_whose_alignment_its_scans_confirm_is_not_aligned_again_while_its_maps_hardly_grow() -> None:
    team = team_of()
    align(team, se2.compose(T_A_B, se2.transform(0.7, 0.0, 0.0)))  # so far apart do bent maps lie where both have been
    joined(team)
    team.take_map("a", KnownMap((1, 2), local_map(A, 2)))
    assert not isinstance(team.next_job(60 * S), AlignJob)


def test_a_pair_whose_scans_say_otherwise_is_aligned_again() -> None:
    team = team_of()
    align(team)
    assert joined(team)[0].fields["ties"]["a-b"] >= 12
    team.take_map("a", KnownMap((1, 2), local_map(A, 2)))
    assert isinstance(team.next_job(60 * S), AlignJob)


def test_a_map_corrected_while_it_was_joined_is_bent_from_where_it_is_now() -> None:
    team = team_of()
    align(team)
    job = team.next_job(12 * S)
    assert isinstance(job, JoinJob)
    joint = join(job.trails, job.T_team_map)
    moved = LocalMap(MAPS["b"].map, Keyframes(MAPS["b"].keyframes.stamps_ns, B.trail.T_map_key + 0.01), B.trail.scans)
    team.take_map("b", KnownMap((1, 2), moved))
    team.keep_placed(40 * S)
    team.on_joined(job, joint, 41 * S)
    assert np.array_equal(team.layout.bends["b"].T_map_key, B.trail.T_map_key + 0.01)


def test_maps_that_did_not_change_are_not_placed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    team = team_of()
    align(team)
    team.keep_placed(30 * S)
    placed = []
    monkeypatch.setattr(team, "_place", placed.append)
    team.keep_placed(60 * S)
    assert placed == []
    team.take_map("a", KnownMap((1, 2), local_map(A, 2)))
    team.keep_placed(90 * S)
    assert placed == [90 * S]


def test_of_a_robot_that_came_back_with_fewer_keyframes_those_that_stayed_are_shown_tied() -> None:
    team = team_of()
    align(team)
    joined(team)
    before = len(team.layout.ties_m({"a": se2.IDENTITY, "b": T_A_B}))
    stayed = max(tie.match.j for tie in team.layout.ties if tie.believed) - 1
    team.take_map("b", KnownMap((1, 2), local_map(B, 2, keyframes=stayed)))
    team.keep_placed(60 * S)
    left = sum(tie.believed and tie.match.j < stayed for tie in team.layout.ties)
    assert len(team.layout.ties_m({"a": se2.IDENTITY, "b": T_A_B})) == left < before


def test_of_a_robot_that_came_back_with_fewer_keyframes_and_drove_on_new_ones_are_not_shown_tied() -> None:
    team = team_of()
    align(team)
    joined(team)
    stayed = max(tie.match.j for tie in team.layout.ties if tie.believed) - 1
    team.take_map("b", KnownMap((1, 2), local_map(B, 2, keyframes=stayed)))
    few = len(team.layout.ties_m({"a": se2.IDENTITY, "b": T_A_B}))
    team.take_map("b", KnownMap((1, 3), local_map(B, 3)))
    assert len(team.layout.ties_m({"a": se2.IDENTITY, "b": T_A_B})) == few


def test_the_own_map_keeps_its_walls_where_it_is_bent() -> None:
    team = team_of()
    align(team)
    joined(team)
    own = team.maps["a"].local
    grid = own.map.to_grid()
    T_team_own = team.layout.T_team_own
    assert np.abs(T_team_own).max() > 0.05  # its frame is not the team's
    cleared = team.without_ghosts(grid, of_own_map=True)
    assert np.array_equal(cleared.cells, grid.cells)
    haunted, k = grid.cells.copy(), len(own.keyframes.T_map_base) // 2
    col, row = np.floor((own.keyframes.T_map_base[k, :2] - np.array(grid.origin_m)) / grid.resolution_m).astype(int)
    haunted[row, col] = 100
    assert team.without_ghosts(replace(grid, cells=haunted), of_own_map=True).cells[row, col] < 50  # it drove there


def test_nothing_of_a_map_that_was_given_up_goes_into_the_next_joint_solution() -> None:
    team = team_of()
    align(team)
    joined(team)
    team.layout.place(team._alignments(), 16 * S)
    there = team.layout.bent.places["a", "b"][0]
    assert team.layout.bent.confirms(("a", "b"), there)
    team.take_map("b", KnownMap((2, 1), MAPS["b"]))
    layout = team.layout
    assert "b" not in layout.T_team_map | layout.placement.T_rigid | layout.bends
    assert not layout.bent.confirms(("a", "b"), there)
    assert not any("b" in edge.pair for edge in layout.placement.edges)
    assert team.next_job(17 * S) is None or not isinstance(team.next_job(17 * S), JoinJob)


def test_a_robot_that_gave_its_own_map_up_is_where_its_new_one_begins() -> None:
    team = team_of()
    align(team)
    joined(team)
    assert np.abs(team.layout.T_team_own).max() > 0.05
    team.displace("a")
    assert np.array_equal(team.layout.T_team_own, se2.IDENTITY)
    assert team.layout.T_team_map.keys() == {"a"} and not team.layout.bends
    assert team.layout.ties_m(team.layout.T_team_map) == []
