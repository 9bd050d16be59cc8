"""Local motion from keyframe to keyframe, and how uncertain it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.front_end.front_end import Step
from mrslam.rbpf.front_end.motion import BLIND_M, CARRIED, MOTION, WAY, WAY_MOST, LocalMotion, motion_cov

CONFIG = MapperConfig()


def step(x_m: float, y_m: float = 0.0, turn_rad: float = 0.0, blind_m: tuple[float, float] = (0.0, 0.0)) -> Step:
    return Step(np.array([x_m, y_m, turn_rad]), 0.0, 1.0, np.array(blind_m))


def test_a_keyframe_is_due_after_a_way_that_led_nowhere_too() -> None:
    motion, stride_m = LocalMotion(), 0.4 * CONFIG.linear_update_m
    due = []
    for k in range(20):
        motion.add(step(stride_m if k % 2 else -stride_m))
        due.append(motion.is_due(CONFIG, 0))
    assert due.index(True) + 1 == int(np.ceil(WAY_MOST * CONFIG.linear_update_m / stride_m - 1e-9))


@pytest.mark.parametrize("turn_rad", [1.01 * CONFIG.angular_update_rad, -1.01 * CONFIG.angular_update_rad])
def test_a_keyframe_is_due_after_a_turn_either_way(turn_rad: float) -> None:
    motion = LocalMotion()
    motion.add(step(0.0, turn_rad=turn_rad))
    assert motion.is_due(CONFIG, 0)


def test_a_keyframe_is_due_where_a_robot_was_carried_however_near() -> None:
    motion = LocalMotion()
    motion.add(step(0.01))
    assert not motion.is_due(CONFIG, 0)
    motion.add(replace(step(0.0), is_carried=True))
    motion.add(step(0.01))
    assert motion.is_due(CONFIG, 0) and motion.restart(0)[CARRIED] == 1.0
    motion.add(step(0.01))
    assert not motion.is_due(CONFIG, 0) and motion.restart(0)[CARRIED] == 0.0


def test_what_was_not_seen_adds_up_in_the_frame_of_the_keyframe_and_begins_again_with_the_next() -> None:
    motion = LocalMotion()
    motion.add(step(1.0, turn_rad=np.pi / 2))
    motion.add(step(0.5, blind_m=(0.2, 0.0)))
    motion.is_carried = True
    arrival = motion.restart(7)
    assert arrival[MOTION] == pytest.approx([1.0, 0.5, np.pi / 2]) and arrival[WAY] == pytest.approx(1.5 + 0.15 * np.pi)
    assert arrival[BLIND_M] == pytest.approx([0.0, 0.2]) and arrival[CARRIED] == 1.0
    assert not motion.restart(8).any() and motion.stamp_ns == 8


def test_each_setting_of_noise_makes_motion_less_certain() -> None:
    motion, blind_m = np.array([0.5, 0.0, 0.4]), np.array([0.0, 0.3])
    usual = motion_cov(CONFIG, motion, np.zeros(2))
    for name in ("noise_m_per_m", "noise_m_per_rad", "noise_rad_per_m", "noise_rad_per_rad"):
        more = motion_cov(MapperConfig(**{name: 2.0 * getattr(CONFIG, name)}), motion, np.zeros(2))
        grown = np.diag(more) > np.diag(usual)
        assert grown.tolist() == ([True, True, False] if name.startswith("noise_m") else [False, False, True]), name
    assert motion_cov(CONFIG, motion, blind_m) - usual == pytest.approx(np.diag([0.0, 0.09, 0.0]))
