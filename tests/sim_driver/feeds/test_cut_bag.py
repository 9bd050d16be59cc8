"""ROS1 bags whose end is missing: what is whole of them is read, with ``salvage``, and never anything else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer

from mrslam.sim_driver.feeds import open_feed
from mrslam.spatial import InputError
from tests.sim_driver.feeds.spoiling import spoilt
from tests.sim_driver.feeds.test_rosbag import NS, Recorder

CUT = "the bag is cut off or damaged; what is whole of it is used"


def recorded(path: Path, compression: str) -> bytes:
    """Return a bag of 20 scans with odometry, in several chunks."""
    out = Recorder(path, "bag")
    out.writer.chunk_threshold = 1500
    if compression != "none":
        out.writer.set_compression(Writer.CompressionFormat[compression.upper()])
    rng = np.random.default_rng(0)
    with out:
        for i in range(20):
            out.odometry(NS + i * NS // 10, 0.1 * i, 0.0, 0.1)
            out.scan(NS + i * NS // 10, rng.uniform(1.0, 4.0, 30))
    return path.read_bytes()


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_what_is_before_the_cut_is_what_was_recorded(tmp_path: Path, compression: str) -> None:
    raw = recorded(tmp_path / "whole.bag", compression)
    whole = open_feed(tmp_path / "whole.bag").readings
    cut, counts = tmp_path / "cut.bag", []
    for share in (0.4, 0.5, 0.6, 0.7, 0.8, 0.999):
        cut.write_bytes(raw[: int(share * len(raw))])
        with pytest.raises(InputError, match=r"cut off .*--salvage uses what is there, and rosbag reindex cut\.bag"):
            open_feed(cut)
        feed = open_feed(cut, salvage=True)
        assert CUT in feed.notes
        counts.append(len(feed.readings))
        for one, two in zip(feed.readings, whole, strict=False):
            assert one.scan.stamp_ns == two.scan.stamp_ns and np.array_equal(one.scan.ranges_m, two.scan.ranges_m)
        assert np.allclose(feed.readings[0].T_odom_base, whole[0].T_odom_base)
    assert counts == sorted(counts) and 0 < counts[0] < counts[2] < 20 and counts[-1] == 20


def test_a_whole_bag_is_read_as_ever(tmp_path: Path) -> None:
    recorded(tmp_path / "whole.bag", "none")
    assert open_feed(tmp_path / "whole.bag", salvage=True).notes == open_feed(tmp_path / "whole.bag").notes


@pytest.mark.parametrize("content", [b"", b"garbage" * 100, b"#ROSBAG V2.0\n", b"#ROSBAG V2.0\n" + b"\xff" * 500])
def test_where_nothing_is_whole_it_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.bag").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.bag: (not a readable ROS recording|holds no)") as told:
        open_feed(tmp_path / "a.bag", salvage=True)
    assert "salvage" not in str(told.value)


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_flipped_and_cut_bytes_never_end_in_a_traceback(tmp_path: Path, compression: str) -> None:
    raw, broken = recorded(tmp_path / "whole.bag", compression), tmp_path / "broken.bag"
    salvaged = 0
    for content in spoilt(raw):
        broken.write_bytes(content)
        try:
            salvaged += CUT in open_feed(broken, salvage=True).notes
        except InputError as error:
            assert "\n" not in str(error)
    assert salvaged >= 5


@pytest.mark.parametrize(
    ("name", "remedy"), [("a.mcap", "mcap recover FILE -o WHOLE.mcap"), ("a.db3", "ros2 bag reindex")]
)
def test_other_recordings_name_what_mends_them(tmp_path: Path, name: str, remedy: str) -> None:
    (tmp_path / name).write_bytes(b"garbage" * 100)
    for salvage in (False, True):
        with pytest.raises(InputError, match=remedy):
            open_feed(tmp_path / name, salvage=salvage)


def test_a_folder_without_metadata_names_what_makes_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"ros2 bag reindex {tmp_path.name}"):
        open_feed(tmp_path)
