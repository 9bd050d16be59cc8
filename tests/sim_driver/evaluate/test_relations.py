from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sim_driver.evaluate.relations import cross_errors, read_relations
from spatial import InputError, se2


def test_cross_errors_see_only_what_links_the_robots() -> None:
    rng = np.random.default_rng(0)
    T_world_x = rng.normal(size=(6, 3))
    stamps = np.arange(6) * 1_000_000_000
    T_world_a, T_world_b = rng.normal(size=(2, 3))
    poses_a = stamps[:4], se2.between(T_world_a, T_world_x[:4])  # stamps 0..3; 2 and 3 are seen by both
    poses_b = stamps[2:], se2.between(T_world_b, T_world_x[2:])
    pairs = np.array([(0, 1), (0, 4), (5, 1), (2, 3), (0, 3), (9, 1)])
    relations = (
        pairs[:, 0] * 1_000_000,
        pairs[:, 1] * 1_000_000,
        np.array([se2.between(T_world_x[i % 6], T_world_x[j]) for i, j in pairs]),
    )
    T_a_b = se2.between(T_world_a, T_world_b)
    exact = cross_errors(relations, poses_a, poses_b, T_a_b)
    assert exact.shape == (2, 2)  # (0, 4) and (5, 1)
    np.testing.assert_allclose(exact, 0.0, atol=1e-9)
    turned = cross_errors(relations, poses_a, poses_b, se2.compose(T_a_b, [0.0, 0.0, 0.1]))
    np.testing.assert_allclose(turned[:, 1], np.degrees(0.1), atol=1e-9)
    assert (turned[:, 0] > 0.01).all()


def test_broken_relations_are_named(tmp_path: Path) -> None:
    path = tmp_path / "x.relations"
    path.write_text("1 2 3\n")
    with pytest.raises(InputError, match="8 numbers"):
        read_relations(path)
