from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import (
    BLOCK,
    KeyframeBlock,
    pack_block,
    quantise,
    quantise_pose,
    read_varints,
    to_blocks,
    to_key_scans,
    to_keyframes,
    unpack_block,
    varints,
)
from mrslam.comms.wire.step_coder import code_steps
from mrslam.spatial import Keyframes, KeyScans
from tests.comms.scans import noise_scans, room_scans

blocks = st.integers(1, BLOCK).flatmap(
    lambda n: st.builds(
        lambda s, p, seed: KeyframeBlock(
            1,
            np.array(s, dtype=np.int64),
            np.array(p, dtype=np.int32).reshape(-1, 3),
            KeyScans.empty() if seed is None else noise_scans(n, seed),
        ),
        st.lists(st.integers(-(2**62), 2**62), min_size=n, max_size=n),
        st.lists(st.integers(-(2**30), 2**30), min_size=3 * n, max_size=3 * n),
        st.none() | st.integers(0, 3),
    )
)


@given(block=blocks, base=st.none() | blocks)
@settings(max_examples=100, deadline=None)
def test_blocks_come_back_whatever_they_are_coded_against(block, base):
    raw = pack_block(block, base)
    back, used = unpack_block(raw + b"more", base, 7)
    assert used == len(raw)
    assert back.equals(block)
    assert back.revision == 7


@given(st.lists(st.integers(-(2**63), 2**63 - 1)))
def test_varints_come_back(values):
    raw = varints(np.array(values, dtype=np.int64))
    back, used = read_varints(raw, 0, len(values))
    assert back.tolist() == values
    assert used == len(raw)


def coded(steps: NDArray[np.int64], unit: int = 0) -> bytes:
    """Stamps and poses as :func:`pack_block` writes them, of steps ``(n, 4)``."""
    room = np.empty(384 * (len(steps) + 1), dtype=np.uint8)
    used = code_steps(np.empty((0, 4), dtype=np.int64), steps.copy(), 0, room, True)
    return bytes([unit]) + varints(np.array([used], dtype=np.int64)) + room[:used].tobytes()


NOTHING = np.zeros((1, 4), dtype=np.int64)
ONE = b"\x01" + coded(NOTHING)  # one keyframe at stamp 0 and the origin; then the three numbers of scans


@pytest.mark.parametrize(
    "raw",
    [b"", b"\0", b"\x41", b"\x01\x80", b"\x01" + b"\xff" * 40, b"\x01\x02\x02", ONE]
    + [
        ONE + tail
        for tail in (b"\0\x02", b"\x02\0\0", b"\0\x04\0", b"\0\x01\0", b"\0\0\x02", b"\0\0\x01", b"\0\x02\x02\0")
    ],
)
def test_broken_blocks_are_refused(raw):
    with pytest.raises(WireError):
        unpack_block(raw, None, 1)


def test_a_pose_out_of_range_is_refused():
    far = KeyframeBlock(1, np.zeros(1, dtype=np.int64), np.array([[2**31 - 1, 0, 0]], dtype=np.int32))
    with pytest.raises(WireError, match="range"):
        unpack_block(pack_block(far, None), None, 1)


def test_only_blocks_that_changed_get_a_new_revision():
    stamps = np.arange(200, dtype=np.int64)
    poses = np.zeros((200, 3))
    first = to_blocks(Keyframes(stamps, poses), KeyScans.empty(), (), 1)
    moved = poses.copy()
    moved[70, 0] = 0.01
    second = to_blocks(Keyframes(np.arange(210), np.concatenate([moved, np.ones((10, 3))])), KeyScans.empty(), first, 2)
    assert [block.revision for block in second] == [1, 2, 1, 2]
    assert second[0] is first[0]
    below = to_blocks(Keyframes(stamps, poses + 1e-5), KeyScans.empty(), first, 3)
    assert [block.revision for block in below] == [1, 1, 1, 1]


def test_poses_are_kept_to_half_a_millimetre_and_a_twentieth_of_a_milliradian():
    rng = np.random.default_rng(0)
    poses = rng.normal(size=(100, 3)) * 30
    back = to_keyframes(to_blocks(Keyframes(np.arange(100), poses), KeyScans.empty(), (), 1)).T_map_base
    assert np.abs(back[:, :2] - poses[:, :2]).max() <= 0.00051
    assert np.abs(back[:, 2] - poses[:, 2]).max() <= 0.000051


def test_what_is_not_finite_does_not_travel():
    assert quantise(np.array([[np.nan, np.inf, 1.0]])).tolist() == [[0, 0, 10000]]
    poses = [(np.nan, np.inf, 1.0), (1e9, -1e9, 1e9), (0.0005, -0.0015, 0.00025), (1.2344, -7.7777, -3.14159)]
    for pose in np.array(poses):
        assert list(quantise_pose(pose)) == quantise(pose[None])[0].tolist()


def test_a_steady_drive_costs_few_bytes():
    n = 64
    poses = np.stack([np.arange(n) * 500, np.zeros(n), np.zeros(n)], axis=1).astype(np.int32)
    block = KeyframeBlock(1, np.arange(n, dtype=np.int64) * 10**9, poses)
    assert len(pack_block(block, None)) < 64 * 10
    assert len(pack_block(block, block)) < 64 * 5


def block_of(scans, stamp=0):
    count = len(scans)
    return KeyframeBlock(1, np.arange(count) * 10**9 + stamp, np.zeros((count, 3), dtype=np.int32), scans)


def test_only_scans_that_the_asker_lacks_are_sent():
    scans = room_scans(20)
    whole, base = block_of(scans), block_of(scans.part(0, 15))
    assert len(pack_block(whole, base)) < len(pack_block(whole, None)) - 15 * 30
    moved = KeyframeBlock(2, whole.stamps_ns, whole.poses + 1, scans)
    raw = pack_block(moved, whole)
    assert len(raw) < 20 * 5
    back, _ = unpack_block(raw, whole, 2)
    assert back.equals(moved)
    assert back.scans is whole.scans  # memory of many versions of a map grows by what is new in each


def test_scans_of_a_map_begun_again_replace_those_before():
    base, other = block_of(room_scans(20, seed=1)), block_of(room_scans(25, seed=2))
    back, _ = unpack_block(pack_block(other, base), base, 1)
    assert back.equals(other)


def test_maps_with_and_without_scans_are_told_apart():
    poses = Keyframes(np.arange(100), np.zeros((100, 3)))
    without = to_blocks(poses, KeyScans.empty(), (), 1)
    scans = room_scans(100)
    seen = to_blocks(poses, scans, without, 2)
    assert [block.revision for block in seen] == [2, 2]
    assert len(to_key_scans(without)) == len(to_key_scans(())) == 0
    assert to_key_scans(seen).equals(scans)
    half = to_key_scans((without[0], seen[1]))
    assert half.equals(KeyScans.blank(BLOCK).append(scans.part(BLOCK, 100)))
    assert [block.scans for block in to_blocks(poses, scans.copy(), seen, 3)] == [block.scans for block in seen]


def test_blocks_do_not_keep_the_arrays_they_were_made_of():
    scans = room_scans(3)
    polar = scans.polar.copy()
    scans = KeyScans(scans.starts, polar, scans.origins)
    block = to_blocks(Keyframes(np.arange(3), np.zeros((3, 3))), scans, (), 1)[0]
    before = block.content
    polar[0, 1] += 1
    assert block.content == before


@pytest.mark.parametrize("change", ["stamps_ns", "poses", "scans"])
def test_everything_in_a_block_counts_in_its_hash(change):
    block = block_of(room_scans(3))
    others = {"stamps_ns": block.stamps_ns + 1, "poses": block.poses + 1, "scans": room_scans(3, seed=1)}
    changed = replace(block, **{change: others[change]})
    assert changed.content != block.content
    assert not changed.equals(block)


@pytest.mark.parametrize("column", range(4))
@pytest.mark.parametrize("least", [-(2**63), -(2**63) + 1])
def test_the_least_integers_are_no_stamp_and_no_pose(column: int, least: int) -> None:
    steps = np.zeros(4, dtype=np.int64)
    steps[column] = least
    raw = b"\x01" + coded(steps[None]) + b"\0\0\0"
    with pytest.raises(WireError, match="out of range"):
        unpack_block(raw, None, 1)


def test_steps_that_are_cut_off_longer_or_of_no_unit_are_refused() -> None:
    assert unpack_block(ONE + b"\0\0\0", None, 1)[0].stamps_ns.tolist() == [0]
    three = coded(np.array([[0, 1, 2, 3], [5, 5, 5, 5], [7, -800, 9, 2000]]), 9)
    block, _ = unpack_block(b"\x03" + three + b"\0\0\0", None, 1)
    assert block.stamps_ns.tolist() == [0, 5 * 10**9, 12 * 10**9] and block.poses[2].tolist() == [-794, 16, 2008]
    body = three[2:]
    for bad in (
        b"\x0a" + three[1:],  # ten to the tenth
        b"\x09" + bytes([len(body) - 1]) + body[:-1],
        b"\x09" + bytes([len(body) + 1]) + body + b"\0",
        b"\x09\0",
        b"\x09" + bytes([len(body) + 9]) + body,
        b"",
    ):
        with pytest.raises(WireError, match=r"steps|unit"):
            unpack_block(b"\x03" + bad, None, 1)


numbers = st.integers(-(2**63), 2**63 - 1) | st.integers(-3000, 3000)


@given(st.lists(st.tuples(numbers, numbers, numbers, numbers), min_size=1, max_size=64), st.integers(0, 64), st.data())
def test_any_steps_come_back_whatever_was_known(rows, kept, data):
    steps = np.array(rows, dtype=np.int64)
    trained = steps[: data.draw(st.integers(0, len(steps)))][::-1].copy()
    room = np.empty(384 * (len(steps) + 1), dtype=np.uint8)
    used = code_steps(trained, steps.copy(), kept, room, True)
    assert 0 < used <= room.size
    back = np.zeros_like(steps)
    code_steps(trained, back, kept, room[:used].copy(), False)
    np.testing.assert_array_equal(back, steps)


def drive(count: int, seed: int) -> KeyframeBlock:
    """A robot that turns here and there, with a keyframe each 0.3 to 1.4 s."""
    rng = np.random.default_rng(seed)
    stamps = 10**8 * np.cumsum(rng.integers(3, 15, count)).astype(np.int64)
    steps = rng.normal(size=(count, 3)) * [300.0, 300.0, 2500.0]
    return KeyframeBlock(1, stamps, np.cumsum(steps, axis=0).astype(np.int32))


def test_a_keyframe_costs_five_bytes_and_what_the_asker_holds_trains_the_code() -> None:
    whole = drive(64, 1)
    base = replace(whole, stamps_ns=whole.stamps_ns[:40], poses=whole.poses[:40])
    alone = KeyframeBlock(1, whole.stamps_ns[40:], whole.poses[40:])
    assert len(pack_block(whole, None)) < 5.6 * 64
    assert len(pack_block(whole, base)) < 5.6 * 24 + 10 < len(pack_block(alone, None))
    corrected = replace(whole, poses=whole.poses + np.array([3, -2, 1], dtype=np.int32))
    assert len(pack_block(corrected, whole)) < 64
    for one in (whole, corrected):
        assert unpack_block(pack_block(one, base), base, 1)[0].equals(one)


def test_stamps_of_any_unit_come_back() -> None:
    for unit in range(12):
        stamps = 10**unit * np.array([3, 4, 14, 15, 92], dtype=np.int64) + 2 * 10**unit
        block = KeyframeBlock(1, stamps, np.zeros((5, 3), dtype=np.int32))
        base = KeyframeBlock(1, stamps[:2] // 7, np.zeros((2, 3), dtype=np.int32))
        raw = pack_block(block, None)
        assert raw[1] == min(unit, 9)
        assert unpack_block(raw, None, 1)[0].equals(block)
        assert unpack_block(pack_block(block, base), base, 1)[0].equals(block)


def test_a_block_of_more_keyframes_than_a_block_has_is_refused() -> None:
    for count in (BLOCK + 1, 200):
        stamps, poses = np.arange(count, dtype=np.int64), np.zeros((count, 3), dtype=np.int32)
        with pytest.raises(WireError, match="count"):
            unpack_block(pack_block(KeyframeBlock(1, stamps, poses), None), None, 1)


@pytest.mark.parametrize("scans", [2, 4])
def test_scans_of_other_than_all_keyframes_are_refused(scans: int) -> None:
    block = replace(block_of(room_scans(3)), scans=room_scans(scans))
    with pytest.raises(WireError, match="number of scans"):
        unpack_block(pack_block(block, None), None, 1)


@pytest.mark.parametrize("raw", [b"\xff" * 9 + b"\x03", b"\xff" * 9 + b"\x7f", b"\xfe" * 9 + b"\x02", b"\x80" * 20])
def test_numbers_beyond_64_bits_are_refused(raw: bytes) -> None:
    with pytest.raises(WireError, match="varint"):
        read_varints(raw, 0, 1)
    with pytest.raises(WireError, match="varint"):
        unpack_block(b"\x01\0" + raw, None, 1)


def test_keyframes_and_scans_do_not_pass_for_each_other_in_the_hash() -> None:
    zeros = KeyframeBlock(1, np.zeros(3, dtype=np.int64), np.zeros((3, 3), dtype=np.int32))
    seen = KeyframeBlock(1, np.zeros(1, dtype=np.int64), np.zeros((1, 3), dtype=np.int32))
    blank = [replace(seen, scans=KeyScans.blank(count)) for count in range(12)]
    assert zeros.content not in [one.content for one in blank]
    assert len({one.content for one in blank}) == len(blank)
