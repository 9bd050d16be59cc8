"""The own beacons: when they are sent, and their content."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.comms.config import MODES
from mrslam.comms.effects import EPOCHS
from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.neighbours.beacon_clock import BeaconClock
from mrslam.comms.wire.fields import is_saved
from mrslam.comms.wire.keyframe_codec import quantise_pose
from mrslam.comms.wire.messages import Beacon, encode
from mrslam.comms.wire.presence_messages import Body, Hint, SavedHint
from mrslam.spatial.se2 import Transform

CM = 100.0
"""Places of bodies are sent in centimetres: a laser's noise is one or more."""
LLR_SCALE = 10.0
"""Log-likelihood ratios are sent in tenths of a nat."""
MOST_SENT = 8
"""Most bodies, claims, hints of robots and hints of saved maps in a beacon (the format)."""
LEVELS = 100
"""A share of beacons received is sent as a whole number of percent."""


class OwnBeacons:
    """Sends this robot's beacons."""

    def __init__(self, context: ExchangeContext) -> None:
        """Nothing is sent before the first tick."""
        self._context = context
        self._clock = BeaconClock(context.config)
        self._started_ns: int | None = None
        self._pose: tuple[int, int, int, int] | None = None  # x (mm), y (mm), theta (0.1 mrad), stamp (ns)
        self._bodies: list[Body] = []
        self._claims: dict[tuple[str, int, int, int], tuple[int, int]] = {}
        """By robot and place, the newest: log-likelihood ratio (0.1 nats), and which of the robot's maps it is of."""
        self._hints: list[Hint] = []
        self._saved_hints: list[SavedHint] = []
        self.sightings_bytes = 0
        """What sightings and hints in beacons have cost so far, bytes."""

    def set_pose(self, T_map_base: Transform, stamp_ns: int, bodies_m: NDArray[np.float64] | None = None) -> None:
        """Set the pose ``(3,)`` (m, m, rad) that beacons carry, its time, nanoseconds, and what was seen from it.

        ``bodies_m`` : ``(N, 2)`` in the base frame, metres; the nearest ``MOST_SENT`` go with the next beacon.
        """
        x, y, theta = quantise_pose(np.asarray(T_map_base, dtype=np.float64))
        self._pose = (x, y, theta, int(stamp_ns))
        self._bodies = []
        if bodies_m is not None and len(bodies_m):
            nearest = bodies_m[np.argsort(np.hypot(*bodies_m.T), kind="stable")[:MOST_SENT]]
            self._bodies = [(round(CM * x_m), round(CM * y_m)) for x_m, y_m in nearest.tolist()]

    def forget(self) -> None:
        """Forget where the robot is, what it saw and what it found: all that is of a map that it gave up."""
        self._pose, self._bodies, self._claims, self._hints = None, [], {}, []
        self._saved_hints = []

    def add_claims(self, claims: Sequence[tuple[str, Transform, float, int]]) -> None:
        """Add what goes with the next beacons.

        Each is robot, ``T_own_robot (3,)``, log-likelihood ratio in nats, epoch of the robot's map.
        """
        for robot, T_own_robot, llr, epoch in claims:
            x, y, theta = quantise_pose(np.asarray(T_own_robot, dtype=np.float64))
            self._claims[robot, x, y, theta] = (round(LLR_SCALE * llr), epoch % EPOCHS)

    def add_hints(self, hints: Sequence[tuple[str, Transform]]) -> None:
        """Add what goes with the next beacons: robot or saved map, ``T_own_robot (3,)``."""
        for robot, T_own_robot in hints:
            x, y, theta = quantise_pose(np.asarray(T_own_robot, dtype=np.float64))
            (self._saved_hints if is_saved(robot) else self._hints).append((robot, x, y, theta))

    def uptime_ms(self, now_ns: int) -> int:
        """Return the time since the first tick, milliseconds."""
        return 0 if self._started_ns is None else max(now_ns - self._started_ns, 0) // 1_000_000

    def start(self, now_ns: int) -> None:
        """Count the uptime from the first call."""
        if self._started_ns is None:
            self._started_ns = now_ns

    def is_due(self, now_ns: int, *, calm: bool) -> bool:
        """Return whether to send a beacon now."""
        return self._clock.is_due(now_ns, calm=calm)

    def send(self, heard: list[tuple[str, float]], now_ns: int, *, calm: bool) -> None:
        """Send a beacon; ``heard``: share of their beacons received from the neighbours it reports, 0..1."""
        context = self._context
        period_ns = self._clock.next(now_ns, calm=calm)
        pose, claims = self._pose, list(self._claims.items())[:MOST_SENT]
        beacon = Beacon(
            context.own_id,
            context.boot,
            self._clock.seq,
            self.uptime_ms(now_ns),
            max(round(period_ns / 1e6), 1),
            MODES.index(context.mode),
            [(peer, round(LEVELS * share)) for peer, share in heard],
            context.store.own_epoch - context.boot,
            None if pose is None else (*pose[:3], max(now_ns - pose[3], 0) // 1_000_000),
            tuple(self._bodies),
            tuple((*place, llr) for place, (llr, _) in claims),
            tuple(self._hints[:MOST_SENT]),
            tuple(epoch for _, (_, epoch) in claims),
            tuple(self._saved_hints[:MOST_SENT]),
        )
        size = context.out.post(beacon, None, "beacon")
        if beacon.shortest() is beacon:
            self.sightings_bytes += size - len(encode(beacon.alone(), context.out.team_tag))
        for place, _ in claims:
            del self._claims[place]
        self._bodies, self._hints = [], self._hints[MOST_SENT:]
        self._saved_hints = self._saved_hints[MOST_SENT:]
