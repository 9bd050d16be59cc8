import numpy as np
import pytest

from mrslam.merge import merge_maps
from mrslam.spatial import se2
from tests.merge.joint.blocks import drawn, drive, errors_m

A, B = drive(0.0, 70.0, 0.0007, seed=1), drive(30.0, 80.0, -0.0007, seed=2)
"""Bent by 3 degrees within 70 m, one to the left and one to the right."""
GRIDS = {"a": drawn(A.trail, len(A.trail)), "b": drawn(B.trail, len(B.trail))}
TRAILS = {"a": A.trail, "b": B.trail}


@pytest.fixture(scope="module")
def merged():
    return merge_maps(GRIDS, trails=TRAILS)


def test_maps_that_bring_their_ways_are_bent_until_they_agree(merged):
    team = merged.team_map
    assert list(team.T_team_map) == ["a", "b"] and list(team.bends) == ["a", "b"]
    assert errors_m(A, B, team.bends["a"].T_team_key, team.bends["b"].T_team_key).mean() < 0.1
    assert sum(tie.believed for tie in merged.ties) >= 12


def test_without_their_ways_they_are_merged_by_a_bend_of_their_walls_and_laid_as_they_are(merged):
    for trails in ({}, {"a": A.trail}):
        rigid = merge_maps(GRIDS, trails=trails)
        assert list(rigid.team_map.T_team_map) == ["a", "b"] and not rigid.team_map.bends and not rigid.ties
        found = rigid.edges["a", "b"]
        assert found.evidence.bent_m > 0.1
        away_m, turned_rad = se2.difference(found.T_a_b, merged.edges["a", "b"].T_a_b)
        assert away_m < 2.0 and turned_rad < 0.1


def test_beside_an_anchor_without_a_way_maps_are_laid_as_they_are():
    result = merge_maps({**GRIDS, "0": GRIDS["a"]}, trails=TRAILS)
    team = result.team_map
    assert team.anchor == "0" and list(team.T_team_map) == ["0", "a", "b"]
    assert not team.bends and not result.ties
    assert np.allclose(team.T_team_map["a"], 0.0, atol=0.02)


def test_neither_order_nor_workers_change_a_byte(merged):
    other = merge_maps(dict(reversed(GRIDS.items())), trails=dict(reversed(TRAILS.items())), workers=1)
    assert other.team_map.grid.cells.tobytes() == merged.team_map.grid.cells.tobytes()


def test_where_known_poses_define_the_frame_maps_are_laid_as_they_are():
    poses = {"a": A.truth[0], "b": B.truth[0]}
    team = merge_maps(GRIDS, poses, trails=TRAILS).team_map
    assert not team.bends
    for name in team.T_team_map:
        assert se2.difference(team.T_team_map[name], poses[name])[0] < 1.0
    assert np.isfinite(list(team.T_team_map.values())).all()
