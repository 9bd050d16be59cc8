"""Settings of the network: whom to trust as a link, when to exchange, and how much."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require

MODES = ("distributed", "mapper", "central")
"""What a robot does: maps and merges; maps only; merges only (a base station). Messages carry the index."""
LINK_SOURCES = ("measured", "model", "trace")
"""Values of ``comms.link_source``."""


@dataclass(frozen=True, kw_only=True)
class CommsConfig:
    """Every setting of :class:`mrslam.comms.CommsNode`."""

    link_threshold: float = 0.80
    """Link quality (LQ x NLQ) from which a link is strong enough to exchange maps, 0..1."""
    link_hysteresis: float = 0.05
    """Expert: a strong link turns weak only below ``link_threshold - link_hysteresis``, 0..1."""
    exchange_timeout_s: float = 30.0
    """Least time from a completed exchange to the next with the same peer, seconds."""
    exchanges_per_timeout: int = 5
    """Expert: exchanges of a robot within ``exchange_timeout_s`` with peers that it has met before, 1..64; others of a
    larger team get its news from these. Whoever is met for the first time is never made to wait."""
    link_source: str = "measured"
    """Where link quality comes from: "measured" (beacons), "model" (a simulated radio) or "trace" (a file)."""
    link_smoothing: float = 0.5
    """Expert: weight of a new measurement in the smoothed link quality, above 0 up to 1 (1: no smoothing)."""
    link_step: float = 0.02
    """Expert: least change of a link's quality that is recorded, 0..1."""
    beacon_period_s: float = 0.5
    """Time between two beacons, seconds; each costs about 50 bytes with one neighbour, 6 to 10 for each further one."""
    beacon_calm_factor: float = 2.0
    """Expert: time between beacons over ``beacon_period_s`` while nobody is heard or no link loses any, 1..4."""
    beacon_window: int = 64
    """Expert: beacons over which the received share is taken, 8..1024: more is steadier and slower."""
    beacon_deadline_s: float = 0.5
    """Expert: a beacon this much later than the quickest recent one counts as lost, seconds."""
    beacon_neighbours: int = 4
    """Expert: neighbours whose LQ one beacon reports, taken in turn; bounds the beacon's size, 1..64."""
    peer_timeout_s: float = 3.0
    """A peer without beacons (and without a liveliness token) for this long is gone, seconds."""
    max_parallel_exchanges: int = 2
    """Exchanges a robot opens at the same time, with different peers, 1..64."""
    exchange_budget_bytes: int = 0
    """Most bytes of map that one robot serves in one exchange; the rest follows at the next. 0: no limit."""
    share_saved_maps: bool = True
    """Whether robots that map and merge give the saved maps they have to teammates, and take theirs."""
    retry_s: float = 1.0
    """Expert: silence in an exchange after which an open question is repeated, seconds; then 2 and 4 times this."""
    stall_timeout_s: float = 8.0
    """Expert: silence inside an exchange after which it has failed (and is resumed later), seconds."""
    backoff_s: float = 2.0
    """Expert: pause after a failed exchange, seconds; doubles with each further failure."""
    backoff_max_s: float = 60.0
    """Expert: longest pause after failed exchanges, seconds."""
    chunk_bytes: int = 24_000
    """Expert: most bytes of one map chunk on the wire, 1000..200000."""
    window_tiles: int = 128
    """Expert: tiles and keyframe blocks asked for at once, 1..4096: bounds what is in flight on a slow link."""
    history: int = 24
    """Expert: snapshots kept per robot for sending differences, 1..1000; tiles are shared between snapshots."""
    max_message_bytes: int = 262_144
    """Expert: larger messages are dropped unread, bytes, 1024 or more."""
    max_tiles: int = 32_768
    """Expert: maps with more tiles than this (4 kB of memory each) are refused, 1..65536."""
    max_keyframes: int = 200_000
    """Expert: maps with more keyframes than this are refused, 1..4194304."""
    max_robots: int = 256
    """Robots known at the same time, 2..4096; further ones are dropped."""

    def __post_init__(self) -> None:
        def check(name: str, rule: str, ok: bool) -> None:
            require(ok, f"comms.{name}", rule, getattr(self, name))

        for name in ("link_threshold", "link_hysteresis", "link_step"):
            check(name, "in 0..1", 0.0 <= getattr(self, name) <= 1.0)
        check("link_smoothing", "in 0.001..1", 0.001 <= self.link_smoothing <= 1.0)
        check("link_source", f"one of {', '.join(LINK_SOURCES)}", self.link_source in LINK_SOURCES)
        check("exchange_timeout_s", ">= 0 s", 0.0 <= self.exchange_timeout_s < 1e9)
        for name in ("beacon_period_s", "beacon_deadline_s", "peer_timeout_s", "retry_s", "stall_timeout_s"):
            check(name, "in 0.001..1e6 s", 0.001 <= getattr(self, name) <= 1e6)
        check("beacon_calm_factor", "in 1..4", 1.0 <= self.beacon_calm_factor <= 4.0)
        check("backoff_s", ">= 0 s and < 1e6 s", 0.0 <= self.backoff_s < 1e6)
        check("backoff_max_s", ">= comms.backoff_s", self.backoff_s <= self.backoff_max_s < 1e9)
        check("exchange_budget_bytes", "in 0..2^40 bytes", 0 <= self.exchange_budget_bytes <= 1 << 40)
        bounds = {
            "beacon_window": (8, 1024),
            "beacon_neighbours": (1, 64),
            "max_parallel_exchanges": (1, 64),
            "exchanges_per_timeout": (1, 64),
            "chunk_bytes": (1000, 200_000),
            "window_tiles": (1, 4096),
            "history": (1, 1000),
            "max_message_bytes": (1024, 1 << 24),
            "max_tiles": (1, 65_536),
            "max_keyframes": (1, 1 << 22),
            "max_robots": (2, 4096),
        }
        for name, (low, high) in bounds.items():
            check(name, f"in {low}..{high}", low <= getattr(self, name) <= high)
        check("chunk_bytes", "below comms.max_message_bytes - 1000", self.chunk_bytes < self.max_message_bytes - 1000)
