import json

import numpy as np
import pytest

from mrslam.sim_driver.feeds.inspect import describe, inspect
from tests.sim_driver.feeds.test_carmen import flaser, write
from tests.sim_driver.feeds.test_rosbag import NS, Recorder


def test_a_good_log(data_dir):
    facts = inspect(data_dir / "multi_session/isr_small_raw_1.clf.gz")
    assert (facts["scans"], facts["beams"], facts["format"]) == (1527, 512, "carmen")
    assert facts["rate_hz"] == pytest.approx(9.9, abs=0.1)
    assert facts["path_m"] == pytest.approx(26.7, abs=0.1)
    assert facts["dropped_share"] == pytest.approx(0.10, abs=0.01)
    assert facts["missing"] == facts["odd"] == []
    assert "nothing is missing" in describe(facts)
    json.dumps(facts)


def test_what_is_wrong_is_said(tmp_path):
    rng = np.random.default_rng(0)
    lines = []
    for i, stamp in enumerate([1, 2, 3, 3, 2.5, 40, 41]):
        pose = (0.8 * i, 0, 0)
        lines.append(flaser(rng.uniform(1, 9, 50), odom=pose, laser=pose, stamp=stamp))
    log = write(tmp_path, *lines)
    facts = inspect(log)
    assert facts["stamps_backward"] == 1
    assert facts["stamps_repeated"] == 1
    text = describe(facts)
    assert "1 long gaps between scans, the longest 37.5 s" in text
    assert "scans are 0.8 m apart" in text
    assert "stamps run backward" in text
    assert "the laser's place on the robot is not told" in text
    assert "no maximum range" in text


def test_a_robot_that_never_moves_and_counted_stamps(tmp_path):
    facts = inspect(write(tmp_path, *[flaser([1.0] * 10, stamp=i) for i in range(20)]))
    assert "the odometry never moves" in facts["odd"]
    assert any("evenly spaced" in sentence for sentence in facts["odd"])
    assert "odd        the odometry never moves" in describe(facts)


def test_turns_are_counted_the_short_way_and_a_slow_laser_has_no_gaps(tmp_path):
    odom = [(0.1 * i, 0.0, (-1) ** i * (np.pi - 0.01)) for i in range(9)]  # about half a turn, to and fro
    facts = inspect(write(tmp_path, *[flaser([1.0] * 10, odom=at, stamp=3.0 * i) for i, at in enumerate(odom)]))
    assert facts["turned_deg"] == pytest.approx(np.degrees(8 * 0.02), abs=1.0)
    assert facts["gaps"] == 0 and facts["longest_gap_s"] == 3.0


def test_a_log_without_odometry(tmp_path):
    with Recorder(tmp_path / "run.bag", "bag") as out:
        out.scan(NS, [1.0, 2.0, 3.0])
        out.scan(2 * NS, [1.0, 2.0])
    facts = inspect(tmp_path / "run.bag")
    assert facts["path_m"] is None
    assert any("no odometry" in sentence for sentence in facts["missing"])
    assert any("number of beams varies" in sentence for sentence in facts["odd"])
    assert "odometry   none" in describe(facts)
