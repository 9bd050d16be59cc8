"""A real transport that is made as bad as the radio."""

from __future__ import annotations

from typing import Any

import pytest

from mrslam.comms import Incoming, PeerJoined
from mrslam.sim_driver.run.shaping import CUT_BELOW, ShapedTransport

BEACON, BULK = (Incoming(b"", "r2", lane) for lane in ("beacon", "bulk"))


class Radio:
    """Brings the same again and again, over a link of one quality."""

    def __init__(self, quality: float, items: list[Incoming | PeerJoined]) -> None:
        self.quality, self.items = quality, items

    def poll(self, timeout_s: float) -> list[Incoming | PeerJoined]:
        return list(self.items)

    def qualities(self, now_ns: int) -> dict[str, float]:
        return {"r2": self.quality}

    def now_ns(self) -> int:
        return 0


def heard(quality: float, items: list[Incoming | PeerJoined]) -> list[Any]:
    """Return what a link of this quality lets through."""
    radio: Any = Radio(quality, items)
    return ShapedTransport(radio, radio, radio, seed=3).poll(0.0)


@pytest.mark.parametrize("quality", [0.09, 0.25, 0.64])
def test_beacons_arrive_as_often_as_one_way_of_the_link_brings_them_and_all_else_arrives(quality: float) -> None:
    arrived = heard(quality, [BEACON, BULK] * 2000)
    assert arrived.count(BULK) == 2000
    assert arrived.count(BEACON) / 2000 == pytest.approx(quality**0.5, abs=0.04)  # there and back: the quality


def test_a_dead_link_brings_nothing_but_who_is_there() -> None:
    joined = PeerJoined("r2")
    assert heard(0.9 * CUT_BELOW, [BEACON, joined, BULK] * 50) == [joined] * 50
    stranger = Incoming(b"", None, "bulk")
    assert heard(0.0, [stranger, BULK]) == [stranger]  # nobody knows by which link it came
