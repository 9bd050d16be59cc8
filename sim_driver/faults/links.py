"""Links that fail as told: cut, going up and down, or changing bytes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from mrslam.comms import Conditions, LinkConditions, Send, Transport, TransportEvent
from mrslam.sim_driver.faults.config import FaultConfig

FLAP_S = 3.0
"""A flapping link is down for as long, then up for as long."""
CORRUPT_SHARE = 1 / 3
CUT = LinkConditions(loss=1.0)


def faulty_conditions(beneath: Conditions, faults: Sequence[FaultConfig]) -> Conditions:
    """Return link conditions with partitions and flapping laid over."""
    cuts = [fault for fault in faults if fault.kind in ("partition", "flapping")]

    def conditions(sender: str, receiver: str, now_ns: int) -> LinkConditions:
        if any(fault.robot in (sender, receiver) and _is_down(fault, now_ns) for fault in cuts):
            return CUT
        return beneath(sender, receiver, now_ns)

    return conditions


def _is_down(fault: FaultConfig, now_ns: int) -> bool:
    flaps_up = fault.kind == "flapping" and (now_ns / 1e9 - fault.at_s) % (2 * FLAP_S) >= FLAP_S
    return fault.active(now_ns) and not flaps_up


class Timed(Protocol):
    """Something that knows mission time."""

    now_ns: int


class CorruptingTransport:
    """Changes bytes of what a robot sends while a fault says so."""

    def __init__(
        self, beneath: Transport, faults: Sequence[FaultConfig], rng: np.random.Generator, clock: Timed
    ) -> None:
        """Take the robot's end of the network, its faults, and who knows mission time."""
        self._beneath, self._rng, self._clock = beneath, rng, clock
        self._faults = [fault for fault in faults if fault.kind == "corrupt"]

    def send(self, effect: Send) -> None:
        """Send, perhaps with other bytes."""
        if any(fault.active(self._clock.now_ns) for fault in self._faults) and self._rng.random() < CORRUPT_SHARE:
            effect = replace(effect, payload=self._mutated(effect.payload))
        self._beneath.send(effect)

    def _mutated(self, payload: bytes) -> bytes:
        raw = bytearray(payload)
        for _ in range(int(self._rng.integers(1, 9))):
            raw[int(self._rng.integers(len(raw)))] ^= int(self._rng.integers(1, 256))
        if self._rng.random() < 0.2:
            del raw[int(self._rng.integers(len(raw) + 1)) :]
        return bytes(raw)

    def poll(self, timeout_s: float = 0.0) -> list[TransportEvent]:
        """Return what has arrived."""
        return self._beneath.poll(timeout_s)

    def close(self) -> None:
        """Leave the network."""
        self._beneath.close()
