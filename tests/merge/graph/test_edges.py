import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrslam.merge import TeamGraph
from mrslam.merge.graph.edges import inverse_covariance, make_edge, pair_of
from mrslam.spatial import InputError, OccupancyGrid, se2
from tests.merge.plans import alignment

transforms = st.builds(se2.transform, st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1))


@given(transforms)
def test_an_alignment_the_other_way_round_is_the_same_edge(T_a_b):
    forth = make_edge("a", "b", alignment(T_a_b))
    back = make_edge("b", "a", alignment(se2.inverse(T_a_b)))
    assert forth.pair == back.pair == ("a", "b")
    np.testing.assert_allclose(forth.T_a_b, back.T_a_b, atol=1e-9)
    np.testing.assert_allclose(se2.compose(forth.from_to("a"), forth.from_to("b")), 0.0, atol=1e-9)
    assert forth.other("a") == "b"


@given(transforms)
def test_the_inverses_covariance_is_the_spread_of_the_inverses(T_a_b):
    spread = (
        np.diag([0.02, 0.03, 0.004])
        @ np.array([[1, 0.3, 0.1], [0.3, 1, -0.2], [0.1, -0.2, 1]])
        @ np.diag([0.02, 0.03, 0.004])
    )
    step = 1e-6
    J = np.stack(
        [(se2.inverse(T_a_b + d) - se2.inverse(T_a_b - d)) / (2 * step) for d in np.eye(3) * step], axis=1
    )  # columns: derivative by each parameter
    np.testing.assert_allclose(inverse_covariance(T_a_b, spread), J @ spread @ J.T, atol=1e-6)


@given(transforms)
def test_the_covariance_survives_there_and_back(T_a_b):
    forth = make_edge("b", "a", alignment(T_a_b, sigma_m=0.03, sigma_rad=0.01))
    back = inverse_covariance(forth.T_a_b, forth.covariance)
    np.testing.assert_allclose(back, np.diag([0.03, 0.03, 0.01]) ** 2, atol=1e-9)


def test_both_directions_place_the_maps_alike():
    grid = OccupancyGrid(np.zeros((20, 20), dtype=np.int8), 0.05)
    T = se2.transform(3.0, -1.0, 2.0)
    poses = []
    for a, b, T_a_b in (("r1", "r2", T), ("r2", "r1", se2.inverse(T))):
        graph = TeamGraph()
        graph.set_map("r1", grid)
        graph.set_map("r2", grid)
        poses.append(graph.place({(a, b): alignment(T_a_b)}).T_team_map)
    np.testing.assert_allclose(poses[0]["r2"], poses[1]["r2"], atol=1e-12)
    np.testing.assert_allclose(poses[0]["r2"], T, atol=1e-12)


def test_nonsense_is_refused_in_words():
    with pytest.raises(InputError, match="two robots, got 'a' twice"):
        pair_of("a", "a")
    with pytest.raises(InputError, match="alignment of a and b: T_a_b must be three finite numbers"):
        make_edge("a", "b", alignment([0.0, np.nan, 0.0]))
    with pytest.raises(InputError, match="finite 3 x 3"):
        make_edge("a", "b", alignment(se2.IDENTITY, sigma_m=np.inf))
