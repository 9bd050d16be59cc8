"""The mapper on disk."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.rbpf import Mapper, MapperConfig, load_checkpoint, save_checkpoint
from mrslam.rbpf.checkpoint import KIND, VERSION
from mrslam.sim_driver.feeds import open_feed
from mrslam.spatial import InputError
from mrslam.spatial.files.state_file import pack, write_state
from tests.rbpf.rooms import SMALL, drive, feed


def test_resuming_is_the_same_to_the_byte(tmp_path: Path, data_dir: Path) -> None:
    readings = open_feed(data_dir / "small" / "loop5.clf.gz").readings[:120]
    whole, half = (Mapper(MapperConfig(particles=5, threads=1), seed=3) for _ in range(2))
    for k, reading in enumerate(readings):
        whole.update(reading.scan, reading.T_odom_base)
        if k < 60:
            half.update(reading.scan, reading.T_odom_base)
    save_checkpoint(half, tmp_path / "half.ckpt")
    half = load_checkpoint(tmp_path / "half.ckpt")
    for reading in readings[60:]:
        half.update(reading.scan, reading.T_odom_base)
    save_checkpoint(whole, tmp_path / "a.ckpt")
    save_checkpoint(half, tmp_path / "b.ckpt")
    assert (tmp_path / "a.ckpt").read_bytes() == (tmp_path / "b.ckpt").read_bytes()


def test_what_is_read_is_all_that_was_written(tmp_path: Path) -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(60))
    for name in ("a", "b"):
        save_checkpoint(mapper, tmp_path / name)
        mapper = load_checkpoint(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_damaged_checkpoints_are_refused(tmp_path: Path) -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(20))
    path = tmp_path / "m.ckpt"
    save_checkpoint(mapper, path)
    raw = path.read_bytes()
    flipped = bytearray(raw)
    flipped[len(raw) // 2] ^= 1
    for content, message in (
        (raw[:-7], "cut off or damaged"),
        (bytes(flipped), "cut off or damaged"),
        (b"hello", "not a mrslam-mapper file"),
        (b"", "not a mrslam-mapper file"),
        (raw.replace(b"mapper %d " % VERSION, b"mapper 99 ", 1), "version 99"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message):
            load_checkpoint(path)
    with pytest.raises(InputError, match="cannot be read"):
        load_checkpoint(tmp_path / "none.ckpt")


def test_a_state_of_another_layout_is_refused(tmp_path: Path) -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(20))
    state = mapper.state()
    del state["layout"]  # as written by the first version
    with pytest.raises(InputError, match=r"layout 1, this program reads \d"):
        Mapper(SMALL, seed=1).restore(state)


@settings(deadline=None)
@given(data=st.data())
def test_a_whole_file_with_something_else_in_it_is_refused_or_read(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(3))
    state: Any = {"config": asdict(SMALL), "seed": 1, "mapper": mapper.state()}
    part = state
    while True:
        key = data.draw(st.sampled_from(sorted(part) if isinstance(part, dict) else range(len(part))))
        if not isinstance(part[key], dict | list) or not part[key] or data.draw(st.booleans()):
            break
        part = part[key]
    part[key] = data.draw(st.sampled_from([2, -1, 1e30, "x", None, [], {}, [[]], {"a": 1}]))
    path = tmp_path_factory.getbasetemp() / "other.ckpt"
    write_state(path, KIND, VERSION, pack(state))
    try:
        load_checkpoint(path)
    except InputError as error:
        assert "\n" not in str(error)
