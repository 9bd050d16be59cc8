"""When the next joint solution of the placed maps is computed."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from mrslam.agent.effects import JoinJob
from mrslam.agent.known_map import KnownMap
from mrslam.merge import BentTeam, Pair, Placement
from mrslam.spatial.se2 import Transform

JOIN_NS = 10_000_000_000
"""Least time between two joint solutions while only maps grow, nanoseconds: robots drive some metres in it."""
SETTLE_NS = 4_000_000_000
"""Least time between two solutions where alignments changed, nanoseconds: robots that meet find several of them."""
SETTLE_KEYFRAMES = 500
"""Keyframes with scans of all robots together up to which that time holds; of more it grows with their number, as the
cost of a solution does: where many robots map together an alignment changes every second."""
KEYFRAMES, SHARE = 8, 0.15
"""Least new keyframes with scans of all robots together for another solution (some metres of path), and least share of
all they have, so that the cost of all solutions grows with the path and the robots, and not with their squares."""
AT_LAST_NS = 300_000_000_000
"""Time after which fewer new keyframes are joined, too, nanoseconds: a robot that drives little is not waited for. With
60 s the solutions of a long run cost with the square of its length, for the same errors (docs/experiments.md)."""
STILL_NS = 60_000_000_000
"""Time without a new scan of anybody after which the last few are joined, nanoseconds: robots stand still, see what
they know, or are done. Twice the default time between two exchanges, so that nobody is taken to stand because it is not
heard of."""


class Joining:
    """Chooses the maps to join; it keeps what the last job was made of, and when the last keyframe came."""

    def __init__(self) -> None:
        self._keys: dict[str, tuple[int, int]] = {}
        self._T_a_b: dict[Pair, Transform] = {}
        self._last_ns: int | None = None
        self._seen: dict[str, tuple[int, int]] = {}
        self._seen_ns = 0

    def next_job(
        self,
        placement: Placement,
        bent: BentTeam,
        maps: Mapping[str, KnownMap],
        T_a_b: Mapping[Pair, Transform],
        seen: Collection[Pair],
        now_ns: int,
    ) -> JoinJob | None:
        """Return the maps to join, where more than one is placed and something is new; else None.

        A new alignment, or one that moved, does not wait for maps to grow, unless ``bent``, the last solution, has the
        maps there: until then they are not compared for contradictions. ``seen`` : the pairs of ``T_a_b`` whose robots
        saw each other there.
        """
        frame = placement.anchor
        known = {name: maps[name] for name in placement.T_rigid if name in maps and len(maps[name].trail)}
        if frame is None or frame not in known or len(known) < 2:
            return None
        keys = {name: (one.epoch, len(one.trail.scans.shown)) for name, one in known.items()}
        if keys != self._seen:
            self._seen, self._seen_ns = keys, now_ns
        pairs = self._T_a_b.keys() | T_a_b.keys()
        is_changed = not all(bent.covers(pair, self._T_a_b.get(pair), T_a_b.get(pair)) for pair in pairs)
        if not self._is_due(keys, now_ns, is_changed=is_changed):
            return None
        self._keys, self._T_a_b, self._last_ns = keys, dict(T_a_b), now_ns
        return JoinJob(
            frame=frame, trails={name: one.trail for name, one in known.items()},
            T_team_map={name: placement.T_rigid[name] for name in known}, T_a_b=dict(T_a_b),
            seen={pair: T_a_b[pair] for pair in seen if known.keys() >= set(pair)},
            epochs={name: one.epoch for name, one in known.items()},
        )  # fmt: skip

    def _is_due(self, keys: Mapping[str, tuple[int, int]], now_ns: int, *, is_changed: bool) -> bool:
        waited_ns = AT_LAST_NS if self._last_ns is None else now_ns - self._last_ns
        count = sum(count for _, count in keys.values())
        if is_changed:
            return waited_ns >= SETTLE_NS * max(1.0, count / SETTLE_KEYFRAMES)
        if waited_ns < JOIN_NS or keys == self._keys:
            return False
        if now_ns - self._seen_ns >= STILL_NS:
            return True
        if waited_ns >= AT_LAST_NS or {name: epoch for name, (epoch, _) in keys.items()} != self._epochs:
            return True
        return count - sum(count for _, count in self._keys.values()) >= max(KEYFRAMES, SHARE * count)

    @property
    def _epochs(self) -> dict[str, int]:
        return {name: epoch for name, (epoch, _) in self._keys.items()}
