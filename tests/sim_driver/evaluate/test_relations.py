from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.relations import NEAR_US, cross_errors, own_errors, read_relations
from mrslam.spatial import InputError, se2


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


def test_errors_of_headings_are_no_more_than_half_a_turn() -> None:
    relations = np.array([0]), np.array([1_000_000]), np.array([[2.0, 0.0, 1.5 * np.pi]])
    poses = np.array([[0.0, 0.0, 0.0], [2.0, 1.0, -np.pi / 2 + 0.1]])
    ((off_m, off_deg),) = own_errors(relations, np.array([0, 1_000_000_000]), poses)
    assert (off_m, off_deg) == pytest.approx((1.0, np.degrees(0.1)))


@pytest.mark.parametrize("decimals", [2, 3, 5, 6])
def test_rounded_stamps_mean_the_nearest_scan(tmp_path: Path, decimals: int) -> None:
    rng = np.random.default_rng(1)
    stamps_s = 1134864650.0 + np.arange(40) * 0.0271828
    T_map_base = rng.normal(size=(40, 3))
    text = ""
    for i, j in rng.integers(0, 40, size=(30, 2)):
        x, y, yaw = se2.between(T_map_base[i], T_map_base[j])
        text += f"{stamps_s[i]:.{decimals}f} {stamps_s[j]:.{decimals}f} {x:.9f} {y:.9f} 0 0 0 {yaw:.9f}\n"
    path = tmp_path / "log.relations"
    path.write_text(text)
    relations, stamps_ns = read_relations(path), np.rint(stamps_s * 1e9).astype(np.int64)
    order = rng.permutation(40)
    errors = own_errors(relations, stamps_ns[order], T_map_base[order])
    assert errors.shape == (30, 2)
    np.testing.assert_allclose(errors, 0.0, atol=1e-6)
    halves = (stamps_ns[:20], T_map_base[:20]), (stamps_ns[20:], T_map_base[20:])
    crossed = cross_errors(relations, *halves, np.zeros(3))
    own = sum(len(own_errors(relations, *half)) for half in halves)
    assert 0 < len(crossed) == 30 - own
    np.testing.assert_allclose(crossed, 0.0, atol=1e-6)


def test_stamps_far_from_every_scan_are_left_out() -> None:
    stamps_ns, T_map_base = np.array([0, 1_000_000_000]), np.zeros((2, 3))
    near, far = 1_000_000 + NEAR_US, 1_000_000 + NEAR_US + 1
    relations = np.zeros(2, dtype=np.int64), np.array([near, far]), np.zeros((2, 3))
    assert len(own_errors(relations, stamps_ns, T_map_base)) == 1
    assert own_errors(relations, stamps_ns[:0], T_map_base[:0]).shape == (0, 2)


def test_of_scans_with_one_stamp_the_first_counts() -> None:
    stamps_ns, T_map_base = np.array([0, 1_000_000_000, 1_000_000_000]), np.array([[0.0, 0, 0], [1, 0, 0], [9, 0, 0]])
    relations = np.array([0]), np.array([1_000_000]), np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(own_errors(relations, stamps_ns, T_map_base), 0.0, atol=1e-12)


def test_a_scan_beside_the_others_is_only_its_own_robots() -> None:
    relations = np.array([0]), np.array([1_000_500]), np.zeros((1, 3))
    a = np.array([0, 1_000_000_000]), np.zeros((2, 3))  # 0.5 ms beside b's scan, which the relation means
    b = np.array([1_000_500_000]), np.zeros((1, 3))
    assert len(cross_errors(relations, a, b, np.zeros(3))) == 1


def test_broken_relations_are_named(tmp_path: Path) -> None:
    path = tmp_path / "x.relations"
    path.write_text("1 2 3\n")
    with pytest.raises(InputError, match="8 numbers"):
        read_relations(path)
