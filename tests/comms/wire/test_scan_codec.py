"""Keyframes' scans as bytes: what is written is read, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.scan_codec import pack_scans, scan_content, unpack_scans
from mrslam.comms.wire.scan_coder import SINE, code_scans
from mrslam.spatial import KeyScans
from tests.comms.scans import noise_scans, room_scans
from tests.comms.wire.test_cell_coder import PlainCoder

seeds = st.integers(0, 2**32 - 1)


class PlainScans(PlainCoder):
    """The same code, written to be read."""

    def number(self, name: str, context: object, value: int) -> None:
        digits = f"{value:b}" if value else ""
        self.tree((name, context), len(digits), 5)
        for k in range(1, len(digits)):
            about = (len(digits), digits[1:k]) if k <= 6 else len(digits) - 1 - k
            self.write((name[:4], "digits", about), 32768, int(digits[k]))

    def tree(self, about: object, value: int, bits: int) -> None:
        digits = f"{value:0{bits}b}"
        for k, digit in enumerate(digits):
            self.write((about, digits[:k]), 32768, int(digit))

    def scan(self, points: list[list[int]]) -> None:
        flat = straight = 16
        for i, (b, r) in enumerate(points):
            step = 0
            if i == 0:
                self.number("step", step, b)
                self.number("miss", 10, r)
                continue
            pb, pr = points[i - 1]
            line = pr
            if i == 1:
                step = 1
            else:
                bb, br = points[i - 2]
                expected = (pb - bb) * br // pr
                octave = expected.bit_length()
                step = 1 + min(2 * octave + (expected >> max(octave - 2, 0)) % 2, 30)
                sine = [int(SINE[d]) for d in (pb - bb, b - bb, b - pb)]
                above, below = br * pr * sine[0], br * sine[1] - pr * sine[2]
                if above > 0 and below > 0 and above < 4 * max(br, pr) * below:
                    line = min(max(above // below, 1), 65535)
            self.number("step", step, b - pb)
            guess, recent = (line, straight) if straight < flat else (pr, flat)
            octave = min(recent.bit_length(), 9)
            self.write(("hit", octave), 32768, int(r == guess))
            if r != guess:
                self.write(("nearer", octave), 32768, int(r < guess))
                self.number("miss", octave, abs(r - guess) - 1)
            flat += (4 * min(abs(r - pr), 255) - flat) >> 1
            straight += (4 * min(abs(r - line), 255) - straight) >> 1


def plain(scans: KeyScans, known: int) -> bytes:
    """Scans that are known teach a coder whose bytes are thrown away."""
    coder, laser = PlainScans(), (0, 0)
    for k in range(len(scans)):
        if k == known:
            coder.low, coder.high, coder.out = 0, 0xFFFFFFFF, []
        points = scans.polar[scans.starts[k] : scans.starts[k + 1]].astype(int).tolist()
        here = tuple(int(v) for v in np.round(scans.origins[k].astype(float) * 1000))
        coder.tree("count", len(points), 6)
        coder.write("laser stays", 32768, int(here == laser))
        if here != laser:
            for j, byte in enumerate(np.array(here, ">i2").tobytes()):
                coder.tree(("laser", j), byte, 8)
        coder.scan(points)
        laser = here
    return coder.finish()


@pytest.mark.parametrize("known", [0, 1, 5])
@pytest.mark.parametrize("seed", range(4))
def test_kernel_writes_what_the_plain_coder_writes(known: int, seed: int) -> None:
    for scans in (room_scans(6, seed), noise_scans(6, seed)):
        assert pack_scans(scans, known) == plain(scans, known)


@given(seed=seeds, keyframes=st.integers(1, 64), known=st.integers(0, 63), like_a_room=st.booleans())
@settings(max_examples=100)
def test_what_was_written_is_read(seed: int, keyframes: int, known: int, like_a_room: bool) -> None:
    known = min(known, keyframes)
    scans = (room_scans if like_a_room else noise_scans)(keyframes, seed)
    back = unpack_scans(pack_scans(scans, known), scans.part(0, known), keyframes - known)
    assert back.equals(scans.part(known, keyframes))
    assert back.points.tobytes() == scans.part(known, keyframes).points.tobytes()


def test_a_keyframe_costs_at_most_75_bytes() -> None:
    scans = room_scans(64)
    assert len(pack_scans(scans, 0)) < 75 * 64
    assert sum(len(pack_scans(scans.part(0, k + 8), k)) for k in range(0, 64, 8)) < 75 * 64  # as a robot drives on


@given(body=st.binary(max_size=400), count=st.integers(1, 64), seed=seeds)
@settings(max_examples=200)
def test_any_bytes_are_scans_or_refused(body: bytes, count: int, seed: int) -> None:
    known = noise_scans(3, seed)
    try:
        back = unpack_scans(body, known, count)
    except WireError as error:
        assert error.kind == "bad keyframes"
        return
    assert len(back) == count
    assert unpack_scans(pack_scans(known.append(back), 3), known, count).equals(back)


@given(seed=seeds, data=st.data())
@settings(max_examples=100)
def test_broken_scans_are_other_scans_or_refused(seed: int, data: st.DataObject) -> None:
    raw = bytearray(pack_scans(room_scans(4, seed), 0))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    try:
        assert len(unpack_scans(bytes(raw), KeyScans.empty(), 4)) == 4
    except WireError as error:
        assert error.kind == "bad keyframes"


def test_scans_cut_off_or_too_long_are_refused() -> None:
    scans = room_scans(4)
    raw = pack_scans(scans, 0)
    for broken in (b"", raw[:1], raw[: len(raw) // 2], raw + b"\0", raw + raw):
        with pytest.raises(WireError, match="bad keyframes"):
            unpack_scans(broken, KeyScans.empty(), 4)
    for count in (3, 5):
        with pytest.raises(WireError, match="bad keyframes"):
            unpack_scans(raw, KeyScans.empty(), count)


def test_a_laser_too_far_from_its_base_is_refused() -> None:
    room = np.empty(200, np.uint8)
    used = code_scans(np.zeros(1, np.int64), np.array([0x7FFF0000]), np.empty((0, 2), np.uint16), 0, room, True, SINE)
    with pytest.raises(WireError, match="within 30 m"):
        unpack_scans(room[:used].tobytes(), KeyScans.empty(), 1)


def test_too_little_room_is_reported_and_nothing_is_written_behind_it() -> None:
    scans, guard = room_scans(3), np.full(150, 7, np.uint8)
    counts, lasers = np.diff(scans.starts).astype(np.int64), np.zeros(3, np.int64)
    assert code_scans(counts, lasers, scans.polar.copy(), 0, guard[:100], True, SINE) > 100
    assert (guard[100:] == 7).all()


def test_every_number_counts_in_the_hash() -> None:
    scans = room_scans(2)
    contents = {scan_content(scans)}
    for name in ("starts", "polar", "origins"):
        arrays = {"starts": scans.starts.copy(), "polar": scans.polar.copy(), "origins": scans.origins.copy()}
        arrays[name].flat[-1 if name == "origins" else 1] += 1 if name != "starts" else -1
        if name == "starts":  # the first point of the second scan, which is a new bearing's beginning, moves over
            arrays["polar"][arrays["starts"][1], 0] = 0
        if name == "origins":
            arrays["origins"].flat[-1] = 0.001
        contents.add(scan_content(KeyScans(**arrays)))
    assert len(contents) == 4
