"""Loops between keyframes: what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.spatial import InputError, Keyframes, LocalMap, LoopEdges, TiledMap


def edges(**change: object) -> LoopEdges:
    fields = {"keys": [[0, 5]], "T_first_second": [[0.1, 0.2, 0.3]], "information": [np.eye(3)]} | change
    return LoopEdges(np.array(fields["keys"], np.int32), *(np.array(fields[name]) for name in list(fields)[1:]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"keys": [[5, 0]]}, "from an older keyframe to a newer"),
        ({"keys": [[5, 5]]}, "from an older keyframe to a newer"),
        ({"keys": [[-1, 5]]}, "from an older keyframe to a newer"),
        ({"keys": [[0, 5], [0, 6]]}, "edges must be"),
        ({"T_first_second": [[np.nan, 0.0, 0.0]]}, "finite"),
        ({"information": [np.diag([1.0, np.inf, 1.0])]}, "finite"),
        ({"information": [np.diag([1.0, -1.0, 1.0])]}, "no negative eigenvalue"),
    ],
)
def test_what_makes_no_sense_is_refused(change: dict[str, object], message: str) -> None:
    assert len(edges()) == len(edges(information=[np.diag([1e6, 0.0, 0.0])])) == 1
    with pytest.raises(InputError, match=message):
        edges(**change)


def test_a_map_has_no_loops_of_keyframes_that_it_lacks() -> None:
    keyframes = Keyframes(np.arange(6), np.zeros((6, 3)))
    assert len(LocalMap(TiledMap(0.05), keyframes, loops=edges()).loops) == 1
    with pytest.raises(InputError, match="a loop leads to keyframe 6 of 6"):
        LocalMap(TiledMap(0.05), keyframes, loops=edges(keys=[[0, 6]]))
