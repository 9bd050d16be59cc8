import gzip

import pytest

from mrslam.sim_driver.feeds import FORMATS, Format, guess_format, open_feed, shared_readings
from mrslam.spatial import InputError


class Toy:
    readings = ()

    def __init__(self, path, salvage):
        self.notes = [f"{path.name} {salvage}"]


@pytest.fixture
def toy(monkeypatch):
    monkeypatch.setitem(FORMATS, "toy", Format("toy", (".toy",), Toy, folder_file="toy.txt"))


def test_a_format_is_known_by_one_record(toy, tmp_path):
    (tmp_path / "a.toy").touch()
    (tmp_path / "toy.txt").touch()
    assert guess_format(tmp_path / "a.toy") == guess_format(tmp_path) == "toy"
    assert open_feed(tmp_path / "a.toy").notes == ["a.toy False"]
    assert open_feed(tmp_path / "b", "toy", salvage=True).notes == ["b True"]


def test_compressed_files_are_known_by_the_suffix_before(tmp_path):
    for name, format in (("a.clf.gz", "carmen"), ("a.log", "carmen"), ("a.bag", "rosbag"), ("a.mcap", "rosbag")):
        (tmp_path / name).touch()
        assert guess_format(tmp_path / name) == format


def test_unknown_formats_are_refused_with_those_known(toy, tmp_path):
    (tmp_path / "a.xyz").touch()
    with pytest.raises(InputError, match=r"a\.xyz: unknown log format '\.xyz'; known are \.clf, .*\.toy \(or \.gz\)"):
        open_feed(tmp_path / "a.xyz")
    with pytest.raises(InputError, match="unknown log format 'csv'; known are carmen, rosbag, toy"):
        open_feed(tmp_path / "a.xyz", "csv")


def test_a_log_is_read_once_for_all_who_share_it_and_again_once_it_has_changed(data_dir, tmp_path):
    lines = gzip.decompress((data_dir / "small" / "loop5.clf.gz").read_bytes()).splitlines(keepends=True)
    log, other = tmp_path / "a.clf", tmp_path / "b.clf"
    log.write_bytes(b"".join(lines[:200]))
    first = shared_readings(log)
    assert shared_readings(log) is first
    log.write_bytes(b"".join(lines[:300]))
    assert len(shared_readings(log)) > len(first)
    other.write_bytes(b"".join(lines[:200]))
    assert len(shared_readings(other)) == len(first)
