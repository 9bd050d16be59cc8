import gzip
from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.feeds.carmen import CarmenFeed
from mrslam.sim_driver.feeds.carmen_lines import flaser_angles
from mrslam.spatial import InputError, se2


def flaser(ranges, laser=(0.0, 0.0, 0.0), odom=(0.0, 0.0, 0.0), stamp=1.0):
    numbers = [len(ranges), *ranges, *laser, *odom]
    return "FLASER " + " ".join(f"{v:g}" for v in numbers) + f" {stamp:.6f} host {stamp:.6f}\n"


def robotlaser(
    ranges, start=-2.0, increment=0.5, limit=5.6, laser=(0.2, 0, 0), robot=(0, 0, 0), stamp=1.0, remissions=()
):
    head = ["ROBOTLASER1", 0, start, increment * len(ranges), increment, limit, 0.01, 0, len(ranges), *ranges]
    tail = [len(remissions), *remissions, *laser, *robot, 0, 0, 0, 0, 0, f"{stamp:.6f}", "host", f"{stamp:.6f}"]
    return " ".join(str(v) for v in [*head, *tail]) + "\n"


def test_only_the_slow_laser_is_known_by_its_angles(tmp_path):
    for increment, interval_s in ((2 * np.pi / 1024, 0.1 / 1024), (np.radians(0.5), 0.0), (np.radians(1.0), 0.0)):
        path = write(tmp_path, robotlaser([2.0] * 100, increment=increment))
        assert CarmenFeed(path).readings[0].scan.beam_interval_s == pytest.approx(interval_s)


def write(tmp_path: Path, *lines: str, name="a.clf") -> Path:
    path = tmp_path / name
    path.write_text("".join(lines))
    return path


@pytest.mark.parametrize(
    ("beams", "first", "step", "last"),
    [(180, -90, 1.0, 89), (181, -90, 1.0, 90), (360, -90, 0.5, 89.5), (361, -90, 0.5, 90)],
)
def test_angles_by_number_of_beams(tmp_path, beams, first, step, last):
    assert np.allclose(np.degrees(flaser_angles(beams)), (first, step))
    scan = CarmenFeed(write(tmp_path, flaser([2.0] * beams))).readings[0].scan
    assert np.degrees(scan.angles_rad[-1]) == pytest.approx(last)


def test_poses_are_odometry_and_mounting(tmp_path):
    odom = se2.transform(3.0, -7.0, 2.0)
    laser = se2.compose(odom, (0.25, 0.0, 0.1))
    reading = CarmenFeed(write(tmp_path, *[flaser([1.0, 2.0, 3.0], laser, odom)] * 3)).readings[0]
    assert np.allclose(reading.T_odom_base, odom, atol=1e-4)
    assert np.allclose(reading.scan.T_base_laser, (0.25, 0.0, 0.1), atol=1e-3)


def test_the_mounting_is_that_of_most_lines_for_each_is_rounded(tmp_path):
    offsets = (0.21, 0.25, 0.26, 0.25, 0.2)
    path = write(tmp_path, *(flaser([1.0, 2.0], laser=(x, 0, 0.1), stamp=k + 1.0) for k, x in enumerate(offsets)))
    assert [r.scan.T_base_laser.tolist() for r in CarmenFeed(path).readings] == [[0.25, 0.0, 0.1]] * 5


def test_robotlaser_bears_its_own_geometry(tmp_path):
    path = write(tmp_path, robotlaser([1.0, 0.0, 6.0, 2.0], remissions=(7, 8), stamp=1403706654.585976))
    scan = CarmenFeed(path).readings[0].scan
    assert (scan.angle_min_rad, scan.angle_increment_rad) == (-2.0, 0.5)
    assert np.array_equal(scan.ranges_m, np.array([1.0, np.nan, np.inf, 2.0], dtype=np.float32), equal_nan=True)
    assert scan.T_base_laser[0] == pytest.approx(0.2)
    assert scan.stamp_ns == pytest.approx(1403706654_585976000, abs=1000)


def test_a_start_angle_may_change_from_scan_to_scan(tmp_path):
    feed = CarmenFeed(write(tmp_path, robotlaser([1.0] * 4, start=-1.0), robotlaser([1.0] * 5, start=-1.5)))
    assert [r.scan.angle_min_rad for r in feed.readings] == [-1.0, -1.5]
    assert [r.scan.ranges_m.size for r in feed.readings] == [4, 5]


def test_no_return_value_is_found_by_its_frequency(tmp_path):
    rng = np.random.default_rng(0)
    ranges = [[*rng.uniform(0.5, 20.0, 20), 81.83] for _ in range(30)]
    feed = CarmenFeed(write(tmp_path, *[flaser(r) for r in ranges]))
    assert all(np.isposinf(r.scan.ranges_m[-1]) for r in feed.readings)
    assert all(np.isfinite(r.scan.ranges_m[:-1]).all() for r in feed.readings)
    assert any("no-returns" in note for note in feed.notes)


def test_far_walls_are_not_taken_for_no_returns(tmp_path):
    rng = np.random.default_rng(0)
    feed = CarmenFeed(write(tmp_path, *[flaser(rng.uniform(0.5, 20.0, 20)) for _ in range(100)]))
    assert all(np.isfinite(r.scan.ranges_m).all() for r in feed.readings)


def test_order_of_the_file_is_kept_and_odd_stamps_are_told(tmp_path):
    feed = CarmenFeed(write(tmp_path, *[flaser([1.0], odom=(i, 0, 0), stamp=s) for i, s in enumerate((5, 6, 6, 3, 7))]))
    assert [r.T_odom_base[0] for r in feed.readings] == [0, 1, 2, 3, 4]
    assert "1 stamps run backward; the file's order is kept" in feed.notes
    assert "1 stamps repeat the one before" in feed.notes


def test_comments_and_other_messages_are_passed_over(tmp_path):
    lines = ("# a comment\n", "PARAM x 1\n", "ODOM 0 0 0 0 0 0 1 h 1\n", "\n", flaser([1.0]), "SYNC x\n", "FLASERX 1\n")
    feed = CarmenFeed(write(tmp_path, *lines))
    assert len(feed.readings) == 1
    assert not feed.notes


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        ("FLASER 3 1.0 2.0 0 0 0 0 0 0 1 h 1\n", "3 beams announced, but 2 ranges found"),
        ("FLASER x 1.0 0 0 0 0 0 0 1 h 1\n", "not a number"),
        ("FLASER 1 1.0 0 0 0 0 nan 0 1 h 1\n", "a pose is not finite"),
        ("FLASER 1 1.0 0 0 0 0 0 0 1e300 h 1\n", "out of range"),
        ("FLASER 1 1.0 0 0 0 1e300 0 0 1 h 1\n", "nowhere on earth"),
        (robotlaser([1.0] * 20, increment=0.5), "increment 0.5 rad, max range 5.6 m make no sense"),
        (robotlaser([1.0] * 20, increment=-0.5), "increment -0.5 rad, max range 5.6 m make no sense"),
        ("FLASER -5 1.0 0 0 0 0 0 0 1 h 1\n", "not a whole number in 1..100000"),
        ("FLASER 1e12 1.0 0 0 0 0 0 0 1 h 1\n", "not a whole number in 1..100000"),
        ("FLASER\n", ""),
        ("ROBOTLASER1 0 1\n", ""),
    ],
)
def test_a_bad_line_is_dropped_with_its_number(tmp_path, bad, why):
    feed = CarmenFeed(write(tmp_path, flaser([1.0]), bad, flaser([2.0])))
    assert [float(r.scan.ranges_m[0]) for r in feed.readings] == [1.0, 2.0]
    assert any("1 unreadable scan lines dropped, the first line 2" in note and why in note for note in feed.notes)


def test_bad_single_beams_are_kept_as_such(tmp_path):
    text = flaser([1.0, 22.0, 33.0, 44.0]).replace(" 22 ", " nan ").replace(" 33 ", " -1 ").replace(" 44 ", " inf ")
    ranges = CarmenFeed(write(tmp_path, text)).readings[0].scan.ranges_m
    assert np.array_equal(ranges, np.array([1, np.nan, np.nan, np.inf], dtype=np.float32), equal_nan=True)


def test_gzip_is_known_by_its_content(tmp_path):
    path = tmp_path / "log.clf"
    path.write_bytes(gzip.compress(flaser([1.0]).encode()))
    assert len(open_feed(path).readings) == 1


def test_cut_off_in_a_line(tmp_path):
    with pytest.raises(InputError, match=r"cut off in its last line, line 2: .*--salvage uses the scans before"):
        CarmenFeed(write(tmp_path, flaser([1.0, 2.0]), flaser([1.0, 2.0])[:14]))


def test_what_is_whole_of_a_cut_log_can_be_used(tmp_path):
    feed = open_feed(write(tmp_path, flaser([1.0, 2.0]), flaser([1.0, 2.0])[:14]), salvage=True)
    assert len(feed.readings) == 1 and any("cut off in its last line: 1 scans" in note for note in feed.notes)
    path = tmp_path / "a.clf.gz"
    lines = "".join(flaser(np.random.default_rng(i).uniform(1, 9, 50)) for i in range(200))
    path.write_bytes(gzip.compress(lines.encode())[:-400])
    feed = open_feed(path, salvage=True)
    assert 100 < len(feed.readings) < 200 and any("cut off or broken after line" in note for note in feed.notes)
    assert np.array_equal(feed.readings[0].scan.ranges_m, CarmenFeed(write(tmp_path, lines)).readings[0].scan.ranges_m)


def test_cut_off_gzip_stream(tmp_path):
    path = tmp_path / "a.clf.gz"
    lines = "".join(flaser(np.random.default_rng(i).uniform(1, 9, 50)) for i in range(200))
    path.write_bytes(gzip.compress(lines.encode())[:-400])
    with pytest.raises(InputError, match=r"a\.clf\.gz: the gzip stream is cut off or broken after line \d+"):
        CarmenFeed(path)


def test_broken_gzip_stream(tmp_path):
    path = tmp_path / "a.clf.gz"
    raw = bytearray(gzip.compress("".join(flaser([i * 0.1 + 1]) for i in range(500)).encode()))
    raw[len(raw) // 2] ^= 0xFF
    path.write_bytes(raw)
    with pytest.raises(InputError, match="broken"):
        CarmenFeed(path)


@pytest.mark.parametrize("content", [b"", b"hello\n" * 9, bytes(range(256)) * 40, b"FLASER 2 1.0\n"])
def test_what_is_no_log_says_so(tmp_path, content):
    path = tmp_path / "x.clf"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"x\.clf: no FLASER or ROBOTLASER1 line could be read"):
        CarmenFeed(path)


def test_unknown_suffix_and_missing_file(tmp_path):
    (tmp_path / "a.xyz").write_text("")
    with pytest.raises(InputError, match=r"unknown log format '\.xyz'; known are \.clf"):
        open_feed(tmp_path / "a.xyz")
    with pytest.raises(InputError, match="no such log"):
        open_feed(tmp_path / "none.clf")
    with pytest.raises(InputError, match="unknown log format 'json'"):
        open_feed(tmp_path / "a.xyz", format="json")


@pytest.mark.parametrize(
    ("name", "scans", "beams", "seconds", "metres"),
    [
        ("slam/mit-csail", 1988, 361, 424, 374),
        ("multi_session/arena_raw_2", 0, 512, 0, 0),
        ("multi_session/isr_small_raw_1", 1527, 512, 153.6, 26.7),
        ("small/loop5", 551, 181, 0, 0),
        ("small/mines_exp1", 756, 682, 0, 0),
        ("small/malaga_telecom_one_loop", 225, 361, 0, 0),
        ("slam_sparse/freiburg-101", 292, 0, 0, 0),
        ("slam_sparse/fhw", 488, 180, 0, 398),
        ("slam_sparse/acapulco", 861, 0, 0, 0),
        ("wean/wean1", 713, 180, 134.8, 41.2),
    ],
)
def test_real_logs(data_dir, name, scans, beams, seconds, metres):
    readings = open_feed(data_dir / f"{name}.clf.gz").readings
    assert len(readings) == (scans or len(readings))
    assert not beams or {r.scan.ranges_m.size for r in readings} == {beams}
    stamps = np.array([r.scan.stamp_ns for r in readings]) / 1e9
    assert not seconds or np.ptp(stamps) == pytest.approx(seconds, abs=1)
    steps = np.diff(np.array([r.T_odom_base[:2] for r in readings]), axis=0)
    assert not metres or np.hypot(*steps.T).sum() == pytest.approx(metres, abs=1)


def test_intel_runs_backward_631_times(data_dir):
    feed = open_feed(data_dir / "slam/intel.clf.gz")
    assert len(feed.readings) == 13631
    assert "631 stamps run backward; the file's order is kept" in feed.notes
    assert feed.readings[0].scan.range_max_m == pytest.approx(81.0, abs=0.5)


def test_hokuyo_zeros_are_dropped_beams(data_dir):
    readings = open_feed(data_dir / "multi_session/isr_small_raw_1.clf.gz").readings
    ranges = np.concatenate([r.scan.ranges_m for r in readings])
    assert np.isnan(ranges).mean() == pytest.approx(0.101, abs=0.01)
    assert np.allclose(readings[0].scan.T_base_laser, (0.225, 0, 0))
    assert np.degrees(readings[0].scan.angles_rad[-1]) == pytest.approx(89.65, abs=0.05)
