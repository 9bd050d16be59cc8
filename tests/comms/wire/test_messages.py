from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrslam.comms.wire import messages as m
from mrslam.comms.wire.frames import HEADER, WireError, check_name, frame, team_tag
from mrslam.spatial import InputError

TAG = team_tag("team")
names = st.from_regex(r"\A[A-Za-z0-9_.-]{1,64}\Z")
counts = st.integers(0, 2**62)
u32 = st.integers(0, 2**32 - 1)
digests = st.lists(st.tuples(names, counts, counts), max_size=5)
ints = st.integers(-(2**31), 2**31 - 1)
coordinates = st.lists(st.integers(-(2**20), 2**20), max_size=5)
poses = st.none() | st.tuples(ints, ints, ints, st.integers(0, 2**53))

manifest_fields = (
    names,
    u32,
    names,
    counts,
    counts,
    counts,
    st.floats(1e-3, 100),
    counts,
    st.lists(u32, max_size=3),
    st.lists(counts, max_size=3),
    coordinates,
    coordinates,
    st.lists(counts, max_size=5),
)
percents = st.integers(0, 100)
milliseconds = st.integers(0, 2**53)
signed = st.integers(-(2**62), 2**62)
words = st.text(max_size=30)
link_rows = st.builds(
    m.LinkRow,
    names,
    percents,
    percents,
    st.booleans(),
    words,
    st.none() | milliseconds,
    signed,
    signed,
    signed,
)
statuses = st.builds(
    m.Status,
    names,
    counts,
    milliseconds,
    st.integers(0, 2),
    counts,
    counts,
    st.lists(link_rows, max_size=3),
    digests,
    st.lists(st.tuples(names, names, words), max_size=3),
)

anything = st.one_of(
    st.builds(
        m.Beacon,
        names,
        counts,
        counts,
        st.integers(0, 2**53),
        st.integers(1, 10**9),
        st.integers(0, 2),
        st.lists(st.tuples(names, st.integers(0, 100)), max_size=4),
        counts,
        poses,
    ),
    st.builds(m.Open, names, counts, u32, digests, digests),
    st.builds(m.Accept, names, counts, u32, digests, digests),
    st.builds(m.Refuse, names, u32, st.text(max_size=64)),
    st.builds(m.Ask, names, u32, names, counts, counts),
    st.builds(m.Manifest, *manifest_fields),
    st.builds(
        m.SignedManifest,
        *manifest_fields,
        st.binary(min_size=16, max_size=16),
        st.binary(max_size=80),
        st.binary(max_size=99),
    ),
    st.builds(m.Get, names, u32, names, counts, counts, counts, st.binary(max_size=9)),
    st.builds(
        m.Chunk,
        names,
        u32,
        names,
        counts,
        counts,
        counts,
        st.binary(max_size=9),
        st.booleans(),
        st.integers(0, 1 << 20),
        st.binary(max_size=99),
        st.binary(min_size=8, max_size=8),
    ),
    st.builds(m.Done, names, u32, st.integers(0, 2)),
    st.builds(m.Bye, names, counts),
    statuses,
)


@given(anything)
def test_messages_come_back(message):
    assert m.decode(m.encode(message, TAG), TAG, 1 << 20) == message


@given(anything, st.data())
def test_a_flipped_bit_is_never_accepted(message, data):
    payload = bytearray(m.encode(message, TAG))
    at = data.draw(st.integers(0, 8 * len(payload) - 1))
    payload[at // 8] ^= 1 << at % 8
    with pytest.raises(WireError):
        m.decode(bytes(payload), TAG, 1 << 20)


@given(anything, st.data())
def test_a_cut_off_message_is_never_accepted(message, data):
    payload = m.encode(message, TAG)
    with pytest.raises(WireError):
        m.decode(payload[: data.draw(st.integers(0, len(payload) - 1))], TAG, 1 << 20)


@given(st.binary(max_size=200))
def test_any_body_decodes_or_is_refused(body):
    try:
        m.decode(frame(body, TAG), TAG, 1 << 20)
    except WireError as error:
        assert error.kind == "malformed"


def test_each_reason_has_its_name():
    payload = m.encode(m.Bye("a", 1), TAG)
    cases = {
        "oversized": payload + b"\0" * 2000,
        "truncated": payload[:5],
        "foreign protocol": b"XX" + payload[2:],
        "protocol version 3, not 4": payload[:2] + b"\x03" + payload[3:],
        "foreign team": m.encode(m.Bye("a", 1), team_tag("other")),
        "corrupt": payload[:-1] + bytes([payload[-1] ^ 1]),
        "malformed": frame(b"\x91\x63", TAG),
    }
    for kind, broken in cases.items():
        with pytest.raises(WireError) as caught:
            m.decode(broken, TAG, 1000)
        assert caught.value.kind == kind


@pytest.mark.parametrize(
    "fields",
    [
        [10, "a/b", 1],  # a name that would break key expressions
        [10, "", 1],
        [10, "a" * 65, 1],
        [10, "a\n", 1],
        [5, "a", 1, "b\n", 1, 0],
        [5, "a", 1, "office@b\n", 1, 0],
        [2, "a", 1, 5, [], [], [["office@b\n", 1, 1]]],
        [10, "a", -1],
        [10, "a", 2**63],
        [9, "a", 1, 7],
        [1, "a", 1, 2, 3, 0, 0, [], 0, None],  # a beacon without a period
        [1, "a", 1, 2, 3, 500, 3, [], 0, None],  # and one of a mode that is none
        [6, "a", 1, "b", 1, 0, 1, float("nan"), 0, [], [], [], [], []],
        [6, "a", 1, "b", 1, 0, 1, float("inf"), 0, [], [], [], [], []],
        [6, "a", 1, "b", 1, 0, 1, 0.0, 0, [], [], [], [], []],
        [6, "a", 1, "b", 1, 0, 1, 0.05, 0, [], [], [2**40], [0], [0]],
        [8, "a", 1, "b", 1, 0, 1, b"", True, 2**30, b"", b"12345678"],
        [8, "a", 1, "b", 1, 0, 1, b"", True, 0, b"", b"1234567"],
        [99, "a"],
        [],
        {"k": 1},
        None,
    ],
)
def test_values_out_of_range_are_malformed(fields):
    with pytest.raises(WireError, match="malformed"):
        m.decode(frame(msgspec.msgpack.encode(fields), TAG), TAG, 1 << 20)


def test_a_length_that_is_not_there_allocates_nothing():
    for header in (b"\xdd", b"\xdf", b"\xc6", b"\xdb"):
        with pytest.raises(WireError, match="malformed"):
            m.decode(frame(b"\x93\x0a" + header + b"\xff\xff\xff\xff", TAG), TAG, 1 << 20)
    with pytest.raises(WireError, match="malformed"):
        m.decode(frame(b"\x91" * 100_000, TAG), TAG, 1 << 20)  # nested a hundred thousand deep


def test_the_frame_is_as_documented():
    payload = m.encode(m.Bye("a", 1), TAG)
    assert payload[:3] == b"MR\x04"
    assert payload[3:7] == TAG.to_bytes(4, "little")
    assert payload[HEADER.size :] == b"\x93\x0a\xa1a\x01"


@pytest.mark.parametrize("name", ["", "a b", "a/b", "*", "x" * 65, "ü", "a\n", ".", "..", ".hidden"])
def test_names_that_break_keys_are_refused(name):
    with pytest.raises(InputError, match="robot id must be"):
        check_name(name, "robot id")


def test_beacons_without_sightings_are_as_before_and_older_programs_pass_over_sightings():
    class OldBeacon(msgspec.Struct, array_like=True, frozen=True, tag_field="k", tag=1):
        sender: str
        boot: int
        seq: int
        uptime_ms: int
        period_ms: int
        mode: int
        heard: list[tuple[str, int]]
        epoch_offset: int
        pose: tuple[int, int, int, int] | None

    fields = ("a", 1, 2, 3, 500, 0, [("b", 100)], 0, (1, 2, 3, 4))
    alone, seen = m.Beacon(*fields), m.Beacon(*fields, ((120, -30),), (("b", 1, 2, 3, -30),))
    hinted = m.Beacon(*fields, (), (), (("c", 1, 2, 3),))
    bodies = [m.encode(one, TAG)[HEADER.size :] for one in (alone, seen, hinted)]
    assert bodies[0] == msgspec.msgpack.encode(OldBeacon(*fields))
    for body in bodies[1:]:
        assert msgspec.msgpack.decode(body, type=OldBeacon) == OldBeacon(*fields)
    assert m.decode(frame(bodies[2], TAG), TAG, 1000) == hinted
    assert m.decode(frame(msgspec.msgpack.encode(OldBeacon(*fields)), TAG), TAG, 1000) == alone


@pytest.mark.parametrize(
    "extra", [[[[1, 2, 3]]], [[[40_000, 0]]], [[], [["b", 0, 0, 0]]], [[[0, 0]] * 9], [None], [[], [], [["b", 0, 0]]]]
)
def test_sightings_that_are_none_are_refused(extra):
    fields = [1, "a", 1, 2, 3, 500, 0, [], 0, None]
    assert m.decode(frame(msgspec.msgpack.encode(fields), TAG), TAG, 1000).seq == 2
    with pytest.raises(WireError, match="malformed"):
        m.decode(frame(msgspec.msgpack.encode(fields + extra), TAG), TAG, 1000)
