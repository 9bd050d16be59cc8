"""Loop edges as rows: whatever a mapper may publish, others take."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.comms.wire.edge_codec import are_edges, from_rows, to_rows
from mrslam.comms.wire.keyframe_codec import EDGES_MOST, pack_block, to_blocks, to_loops, unpack_block
from mrslam.spatial import Keyframes, KeyScans, LoopEdges


def edge(information: np.ndarray, pose: tuple[float, float, float] = (1.0, 2.0, 0.5)) -> LoopEdges:
    return LoopEdges(np.array([[0, 1]], np.int32), np.array([pose]), information[None])


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e7, 1e12])
def test_an_edge_sure_of_one_direction_only_travels(scale: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        way = rng.normal(size=3)
        rows = to_rows(edge(scale * np.outer(way, way)))
        assert are_edges(rows, 0, 2)
        assert len(from_rows(rows)) == 1


def test_an_edge_that_knows_nothing_travels_and_says_next_to_nothing() -> None:
    rows = to_rows(edge(np.zeros((3, 3))))
    assert are_edges(rows, 0, 2)
    assert np.abs(from_rows(rows).information).max() <= 1e-3


def test_an_edge_beyond_the_bounds_is_cut_to_them_and_not_refused() -> None:
    for pose in ((5e6, -5e6, 1e6), (-5e6, 5e6, -1e6)):
        rows = to_rows(edge(1e15 * np.eye(3), pose))
        assert are_edges(rows, 0, 2)
        assert np.sign(rows[0, 2:5]).tolist() == np.sign(pose).tolist()


def test_of_many_loops_that_lead_to_one_block_a_loop_a_keyframe_travels() -> None:
    newer = np.arange(1, 64).repeat(2)
    loops = LoopEdges(
        np.stack([newer - 1, newer], axis=-1).astype(np.int32),
        np.zeros((newer.size, 3)),
        np.tile(np.eye(3), (newer.size, 1, 1)),
    )
    (block,) = to_blocks(Keyframes(np.arange(64), np.zeros((64, 3))), KeyScans.empty(), loops, (), 1)
    read, _ = unpack_block(pack_block(block, None), None, 1)
    assert len(to_loops((read,))) == EDGES_MOST
