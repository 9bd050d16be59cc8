"""Sets of items as bits."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mrslam.comms.wire.bitmask import from_mask, to_mask


@given(st.sets(st.integers(0, 300)))
def test_items_come_back(items: set[int]) -> None:
    assert from_mask(to_mask(sorted(items)), 301) == sorted(items)


def test_bits_are_as_documented() -> None:
    assert to_mask([]) == b"" and to_mask([0, 3, 8]) == b"\x09\x01"


def test_bits_beyond_what_there_is_ask_for_nothing() -> None:
    assert from_mask(b"\xff\xff", 11) == list(range(11))
    assert from_mask(b"\xff", 0) == []
