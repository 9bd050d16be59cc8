from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mrslam.sim_driver.feeds import bag_contents, open_feed
from mrslam.sim_driver.feeds.bag_contents import LaserMessage
from mrslam.sim_driver.feeds.rosbag import RosbagFeed
from mrslam.spatial import InputError, se2
from mrslam.spatial.scan import SLOWEST_SWEEP_S
from tests.sim_driver.feeds.spoiling import spoilt

NS = 1_000_000_000


def store(ros1: bool):
    types = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    if ros1:
        text = "geometry_msgs/TransformStamped[] transforms\n"
        types.register(get_types_from_msg(text, "tf2_msgs/msg/TFMessage"))
    return types


class Recorder:
    """Writes messages of one kind of bag."""

    def __init__(self, path: Path, kind: str):
        self.types, self.ros1 = store(kind == "bag"), kind == "bag"
        if self.ros1:
            self.writer = Writer1(path)
        else:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(path, version=9, storage_plugin=plugin)
        self.connections = {}

    def __enter__(self):
        self.writer.open()
        return self

    def __exit__(self, *error):
        self.writer.close()

    def make(self, name, **values):
        return self.types.types[name](**values)

    def header(self, stamp_ns, frame):
        time = self.make("builtin_interfaces/msg/Time", sec=stamp_ns // NS, nanosec=stamp_ns % NS)
        extra = {"seq": 0} if self.ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=time, frame_id=frame, **extra)

    def quaternion(self, yaw, upside_down=False):
        w, x, y, z = np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)
        if upside_down:  # turned by yaw after a half turn around x
            w, x, y, z = 0.0, np.cos(yaw / 2), np.sin(yaw / 2), 0.0
        return self.make("geometry_msgs/msg/Quaternion", w=w, x=x, y=y, z=z)

    def put(self, topic, name, message, stamp_ns):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, name, typestore=self.types)
        raw = self.types.serialize_ros1(message, name) if self.ros1 else self.types.serialize_cdr(message, name)
        self.writer.write(self.connections[topic], stamp_ns, bytes(raw))

    def scan(self, stamp_ns, ranges, frame="laser", topic="/scan", header_ns=None):
        message = self.make(
            "sensor_msgs/msg/LaserScan",
            header=self.header(stamp_ns if header_ns is None else header_ns, frame),
            angle_min=-1.0, angle_max=1.0, angle_increment=2.0 / (len(ranges) - 1), time_increment=0.0, scan_time=0.1,
            range_min=0.1, range_max=5.0, ranges=np.array(ranges, dtype=np.float32),
            intensities=np.empty(0, np.float32),
        )  # fmt: skip
        self.put(topic, "sensor_msgs/msg/LaserScan", message, stamp_ns)

    def odometry(self, stamp_ns, x, y, yaw, child="base_link"):
        point = self.make("geometry_msgs/msg/Point", x=x, y=y, z=0.0)
        pose = self.make("geometry_msgs/msg/Pose", position=point, orientation=self.quaternion(yaw))
        zero = self.make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        twist = self.make("geometry_msgs/msg/Twist", linear=zero, angular=zero)
        message = self.make(
            "nav_msgs/msg/Odometry",
            header=self.header(stamp_ns, "odom"),
            child_frame_id=child,
            pose=self.make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
            twist=self.make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )
        self.put("/odom", "nav_msgs/msg/Odometry", message, stamp_ns)

    def tf(self, stamp_ns, parent, child, x, y, yaw, upside_down=False):
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=0.3),
            rotation=self.quaternion(yaw, upside_down),
        )
        stamped = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(stamp_ns, parent), child_frame_id=child, transform=transform,
        )  # fmt: skip
        name = "tf2_msgs/msg/TFMessage"
        self.put("/tf", name, self.make(name, transforms=[stamped]), stamp_ns)


KINDS = ("bag", "db3", "mcap")


def target(tmp_path, kind):
    return tmp_path / ("run.bag" if kind == "bag" else f"run_{kind}")


@pytest.mark.parametrize("kind", KINDS)
def test_scans_with_odometry_and_mounting(tmp_path, kind):
    path = target(tmp_path, kind)
    with Recorder(path, kind) as out:
        for i in range(11):
            out.odometry(NS + i * NS // 10, 0.1 * i, 0.0, 0.2 * i)
            out.tf(NS + i * NS // 10, "base_link", "mast", 0.2, 0.0, np.pi / 2)
            out.tf(NS + i * NS // 10, "mast", "laser", 0.1, 0.0, 0.0)
        for i in range(5):
            out.scan(NS + NS // 20 + i * NS // 10, [1.0, 9.0, 0.05, np.nan, 2.0])
    feed = open_feed(path)
    assert not feed.notes
    assert len(feed.readings) == 5
    first = feed.readings[0]
    expected = np.array([1, np.inf, np.nan, np.nan, 2], dtype=np.float32)
    assert np.array_equal(first.scan.ranges_m, expected, equal_nan=True)
    assert np.allclose(first.scan.T_base_laser, (0.2, 0.1, np.pi / 2))
    assert np.allclose(first.T_odom_base, (0.05, 0.0, 0.1))  # halfway between two odometry messages
    assert first.scan.stamp_ns == NS + NS // 20


def test_single_storage_files_and_their_folders_read_alike(tmp_path):
    for kind in ("db3", "mcap"):
        with Recorder(target(tmp_path, kind), kind) as out:
            out.scan(NS, [1.0, 2.0, 3.0])
        [file] = target(tmp_path, kind).glob(f"*.{kind}")
        assert len(open_feed(file).readings) == 1


@pytest.mark.parametrize("kind", KINDS)
def test_odometry_from_tf(tmp_path, kind):
    path = target(tmp_path, kind)
    with Recorder(path, kind) as out:
        for i in range(5):
            out.tf(NS + i * NS // 10, "/odom", "/base_footprint", 0.3 * i, 1.0, 3.0 + 0.1 * i)
            out.tf(NS + i * NS // 10, "/base_footprint", "/laser", 0.15, 0.0, 0.0)
            out.scan(NS + i * NS // 10, [1.0, 2.0, 3.0], frame="laser")
    feed = open_feed(path)
    assert "odometry is taken from TF, odom to base_footprint" in feed.notes
    assert np.allclose(feed.readings[4].T_odom_base, se2.transform(1.2, 1.0, 3.4))
    assert np.allclose(feed.readings[0].scan.T_base_laser, (0.15, 0, 0))


def test_a_base_that_stands_still_in_tf_is_no_odometry(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        for i in range(5):
            out.tf(NS + i * NS, "odom", "base_link", 0.3, 1.0, 0.0)
            out.tf(NS + i * NS, "base_link", "laser", 0.15, 0.0, 0.0)
            out.scan(NS + i * NS, [1.0, 2.0, 3.0])
    feed = open_feed(path)
    assert any(note.startswith("no odometry") for note in feed.notes)
    assert all(reading.T_odom_base is None for reading in feed.readings)
    assert feed.readings[0].scan.T_base_laser == pytest.approx([0.15, 0.0, 0.0])


def test_the_busiest_topic_is_used_and_odometry_that_is_none_is_not(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.scan(NS, [9.0, 9.0], topic="/a_rare_one")
        for i in range(3):
            out.odometry(NS + i * NS, np.nan, 0.0, 0.0)
            out.tf(NS + i * NS, "odom", "base_link", 0.3 * i, 0.0, 0.0)
            out.tf(NS + i * NS, "base_link", "laser", 0.15, 0.0, 0.0)
            out.scan(NS + i * NS, [1.0, 2.0], topic="/scan")
    feed = open_feed(path)
    assert "scan topic /scan is used, /a_rare_one are not" in feed.notes
    assert "odometry is taken from TF, odom to base_link" in feed.notes
    assert [reading.T_odom_base[0] for reading in feed.readings] == pytest.approx([0.0, 0.3, 0.6])


def test_a_laser_that_is_the_base_sits_at_its_centre(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        for i in range(3):
            out.odometry(NS + i * NS, 0.1 * i, 0.0, 0.0)
            out.scan(NS + i * NS, [1.0, 2.0], frame="base_link")
    feed = open_feed(path)
    assert not feed.notes and feed.readings[0].scan.T_base_laser.tolist() == [0.0, 0.0, 0.0]


def test_a_laser_upside_down_is_mirrored(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.odometry(NS, 0.0, 0.0, 0.0)
        out.tf(NS, "base_link", "laser", 0.0, 0.0, 0.5, upside_down=True)
        out.scan(NS, [1.0, 2.0, 3.0])
    feed = open_feed(path)
    scan = feed.readings[0].scan
    # A beam at angle a of the turned laser points to 0.5 - a on the robot.
    assert np.allclose(np.arctan2(*scan.points_base().T[::-1]), 0.5 - np.array([-1.0, 0.0, 1.0]), atol=1e-6)
    assert any("upside down" in note for note in feed.notes)


def test_angles_are_interpolated_the_short_way(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.odometry(NS, 0.0, 0.0, np.pi - 0.1)
        out.odometry(NS + NS // 10, 0.0, 0.0, -np.pi + 0.1)
        out.scan(NS + NS // 20, [1.0, 2.0])
    assert abs(open_feed(path).readings[0].T_odom_base[2]) == pytest.approx(np.pi, abs=1e-6)


def test_what_is_missing_is_told(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.scan(NS, [1.0, 2.0, 3.0])
        out.scan(2 * NS, [1.0, 2.0, 3.0], header_ns=0)
        out.scan(2 * NS, [1.0, 2.0], topic="/scan_rear")
    feed = open_feed(path)
    assert [r.T_odom_base for r in feed.readings] == [None, None]
    assert [r.scan.stamp_ns for r in feed.readings] == [NS, 2 * NS]  # without a stamp: when it was recorded
    notes = "\n".join(feed.notes)
    assert "scan topic /scan is used, /scan_rear are not" in notes
    assert "no odometry" in notes
    assert "the laser is taken to sit on the robot's centre" in notes


def test_topics_can_be_chosen(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.scan(NS, [1.0, 2.0, 3.0])
        out.scan(2 * NS, [1.0, 2.0], topic="/scan_rear")
    assert RosbagFeed(path, scan_topic="/scan_rear").readings[0].scan.ranges_m.size == 2
    with pytest.raises(InputError, match=r"no scan topic '/none'; there are /scan, /scan_rear"):
        RosbagFeed(path, scan_topic="/none")


def test_far_from_any_odometry_there_is_none(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.odometry(NS, 0.0, 0.0, 0.0)
        out.scan(NS, [1.0, 2.0])
        out.scan(60 * NS, [1.0, 2.0])
    feed = open_feed(path)
    assert feed.readings[0].T_odom_base is not None
    assert feed.readings[1].T_odom_base is None
    assert "1 scans have no odometry within 1 s" in feed.notes


def test_a_bag_without_scans_names_its_topics(tmp_path):
    path = tmp_path / "run.bag"
    with Recorder(path, "bag") as out:
        out.odometry(NS, 0.0, 0.0, 0.0)
    with pytest.raises(InputError, match=r"holds no sensor_msgs/LaserScan message; its topics are /odom \(nav_msgs"):
        open_feed(path)


@pytest.mark.parametrize("name", ["a.bag", "a.db3", "a.mcap"])
@pytest.mark.parametrize("content", [b"", b"garbage" * 100])
def test_garbage(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"{name}: (not a readable ROS recording|holds no)"):
        open_feed(path)


@pytest.mark.parametrize("keep", [0.3, 0.9, 0.999])
def test_cut_off_bags(tmp_path, keep, data_dir):
    raw = (data_dir / "multi_session/arena_raw_1.bag").read_bytes()
    path = tmp_path / "cut.bag"
    path.write_bytes(raw[: int(len(raw) * keep)])
    with pytest.raises(InputError, match="not a readable ROS recording, or cut off"):
        open_feed(path)


def test_a_folder_needs_metadata(tmp_path):
    with pytest.raises(InputError, match=r"without metadata\.yaml"):
        open_feed(tmp_path)


@pytest.mark.parametrize(
    ("interval_s", "scan_s", "believed"),
    [
        (1e-4, 0.1, True),
        (1e-4, 0.0, True),
        (1e-4, 0.04, False),
        (0.1 / 499, 0.1, True),  # the last beam of a whole turn comes with the next sweep
        (1.1 * SLOWEST_SWEEP_S / 500, 100.0, False),
        (0.1, 0.1, False),
        (0.1, 0.0, False),
        (-1e-4, 0.1, False),
    ],
)
def test_an_impossible_time_between_beams_is_not_believed(interval_s, scan_s, believed):
    message = LaserMessage("laser", 1, np.ones(500, np.float32), -1.0, 0.004, 30.0, 0.0, interval_s, scan_s)
    assert message.beam_interval_s == (interval_s if believed else 0.0)


def test_a_recording_whose_own_message_definition_lacks_a_field(tmp_path, monkeypatch):
    path = target(tmp_path, "mcap")
    with Recorder(path, "mcap") as out:
        for i in range(3):
            out.scan(i * NS, [1.0] * 9)
            out.odometry(i * NS, 0.1 * i, 0.0, 0.0)
    file = next(path.glob("*.mcap"))
    for old, new, lost in ((b"range_max", b"range_may", "scan"), (b"child_frame_id", b"child_frame_ib", "odometry")):
        broken = tmp_path / f"{lost}.mcap"
        broken.write_bytes(file.read_bytes().replace(old, new))
        if lost == "scan":
            with pytest.raises(InputError, match="3 messages could not be decoded"):
                open_feed(broken)
        else:
            feed = open_feed(broken)
            assert len(feed.readings) == 3 and feed.readings[0].T_odom_base is None
            assert "3 messages could not be decoded" in feed.notes
    monkeypatch.setattr(bag_contents, "BROKEN_AFTER", 2)
    with pytest.raises(InputError, match="more than 2 messages cannot be decoded"):
        open_feed(broken)


def test_the_real_bag_equals_its_carmen_copy(data_dir):
    bag = open_feed(data_dir / "multi_session/arena_raw_1.bag")
    log = open_feed(data_dir / "multi_session/arena_raw_1.clf.gz")
    assert len(bag.readings) == len(log.readings) == 1330
    for one, two in zip(bag.readings, log.readings, strict=True):
        assert abs(one.scan.stamp_ns - two.scan.stamp_ns) < 2000
        both = np.isfinite(one.scan.ranges_m) & np.isfinite(two.scan.ranges_m)
        assert both.sum() > 300
        assert np.array_equal(one.scan.ranges_m[both], two.scan.ranges_m[both])
        assert np.allclose(one.T_odom_base, two.T_odom_base, atol=1e-5)
        assert one.scan.beam_interval_s == pytest.approx(two.scan.beam_interval_s) == pytest.approx(0.1 / 1024)
    assert np.allclose(bag.readings[0].scan.T_base_laser, (0.225, 0, 0))


@pytest.mark.parametrize("kind", KINDS)
def test_flipped_and_cut_bytes_never_end_in_a_traceback(tmp_path, kind):
    path = target(tmp_path, kind)
    with Recorder(path, kind) as out:
        for i in range(5):
            out.odometry(NS + i * NS // 10, 0.1 * i, 0.0, 0.1)
            out.tf(NS + i * NS // 10, "base_link", "laser", 0.1, 0.0, 0.0)
            out.scan(NS + i * NS // 10, [1.0] * 20)
    raw = (path if kind == "bag" else next(path.glob(f"*.{kind}"))).read_bytes()
    refused = 0
    broken = tmp_path / f"broken.{kind}"
    for content in spoilt(raw):
        broken.write_bytes(content)
        try:
            open_feed(broken)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused >= 10
