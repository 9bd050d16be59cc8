"""Keyframes whose scans show nothing that earlier ones do not show."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf import Mapper
from mrslam.rbpf.filter.known_places import is_known
from mrslam.rbpf.front_end.health import DOUBTFUL
from mrslam.spatial import KeyScans
from mrslam.spatial.key_scans import SAME_M, VISIT_WAY_M
from tests.rbpf.rooms import SMALL, drive, feed


def scan(field_rad: float = 2.0 * np.pi) -> KeyScans:
    """A scan with points all over a field of view."""
    angles = np.linspace(-0.49 * field_rad, 0.49 * field_rad, 40)
    return KeyScans.of_points([3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)], np.zeros((1, 2)))


def lap(there_m: float = VISIT_WAY_M) -> np.ndarray:
    """Go along x, and come back far beside: keyframes each half metre, their heading 0."""
    x = np.arange(0.0, there_m, 0.5)
    return np.stack([np.r_[x, x[::-1]], np.r_[0.0 * x, 9.0 + 0.0 * x], np.zeros(2 * x.size)], axis=1)


def known_at_the_start(poses: np.ndarray, y_m: float, heading_rad: float = 0.0, field_rad: float = 2.0 * np.pi) -> bool:
    scans = KeyScans.concatenate([scan(field_rad)] * len(poses))
    return is_known(poses, scans, np.array([0.0, y_m, heading_rad]), scan(field_rad))


def test_a_place_is_known_when_the_robot_comes_back_to_it() -> None:
    assert known_at_the_start(lap(), 0.0)
    for there_m in (1.0, 4.0, 7.0, 12.0):  # and straight back from there
        x = np.arange(0.0, there_m, 0.5)
        way = np.stack([np.r_[x, x[::-1]], np.zeros(2 * x.size), np.zeros(2 * x.size)], axis=1)
        assert known_at_the_start(way[:-1], 0.0) is bool(2.0 * x[-1] >= VISIT_WAY_M)


def test_far_off_or_in_other_directions_it_is_not() -> None:
    there_and_back = lap()
    assert known_at_the_start(there_and_back, SAME_M - 0.1) and not known_at_the_start(there_and_back, SAME_M + 0.1)
    half = np.pi
    assert known_at_the_start(there_and_back, 0.0, 0.4, half) and not known_at_the_start(
        there_and_back, 0.0, np.pi, half
    )
    assert known_at_the_start(there_and_back, 0.0, np.pi)


def test_what_one_visit_saw_is_not_known_while_it_lasts() -> None:
    turns = np.arange(0.0, 60.0, 0.1)
    assert not known_at_the_start(np.stack([0.0 * turns, 0.0 * turns, turns], axis=1), 0.0)


def test_keyframes_without_scans_show_nothing() -> None:
    there_and_back = lap()
    assert not is_known(there_and_back, KeyScans.blank(len(there_and_back)), np.zeros(3), scan())


def test_who_is_not_sure_of_its_place_keeps_its_scans(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Mapper, "health", property(lambda _: DOUBTFUL))
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, np.concatenate([drive(100)] * 3))
    assert mapper.stats.seen_before == 0 and len(mapper.snapshot().key_scans.shown) == mapper.stats.processed > 40


def test_a_mapper_keeps_the_scans_of_the_first_lap_only() -> None:
    mapper, way = Mapper(SMALL, seed=1), drive(200)
    feed(mapper, np.concatenate([way] * 6))
    scans, stats = mapper.snapshot().key_scans, mapper.stats
    assert len(scans) == stats.processed
    assert stats.seen_before == len(scans) - scans.shown.size > 0
    lap_keys = len(scans) / 6.0
    assert list(scans.shown) == list(range(scans.shown.size)) and 0.8 * lap_keys < scans.shown.size < 1.2 * lap_keys
