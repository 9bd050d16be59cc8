"""Shapes of the JSON files of a run's folder: the keys that readers rely on, with their types and bounds.

Times and lengths are bounded far above any mission, so that sums, images and loops over them stay bounded, too.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NotRequired, TypedDict

from msgspec import Meta

from mrslam.comms.wire.fields import MapName

Name = Annotated[str, Meta(min_length=1, max_length=64)]
Seconds = Annotated[float, Meta(ge=0.0, le=1e11)]
"""Mission time or, of agents, the world's clock, seconds: up to the year 5138."""
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""No robot drives a thousand kilometres."""
Pose = Annotated[list[Metres], Meta(min_length=3, max_length=3)]
Area = Annotated[float, Meta(ge=0.0, le=1e12)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Count = Annotated[int, Meta(ge=0, le=2**62)]
Number = Annotated[float, Meta(ge=-1e300, le=1e300)]


class PlaceFile(TypedDict):
    """One place where a pair's maps may lie."""

    T_a_b: Pose
    llr: Number
    refuted: NotRequired[bool]


Clock = Annotated[float, Meta(ge=-1e11, le=1e11)]
"""What a robot's own clock shows, seconds: one that was set back may show times before the mission's begin."""


class PairFile(TypedDict):
    """What one robot believes of a pair."""

    a: Name
    b: Name
    status: Literal["accepted", "rejected", "revoked", "untried"]
    T_a_b: Pose | None
    accepted_at_s: Clock | None
    confidence: Share | None
    reason: str
    attempts: NotRequired[Count]
    places: NotRequired[list[PlaceFile]]


class LinkFile(TypedDict):
    """What went over one robot's link to a peer."""

    peer: Name
    exchanges: Count
    bytes_sent: Count
    bytes_full_lz4: Count
    bytes_full_raw: Count


class ChosenFrame(TypedDict):
    """The saved map in whose frame a robot told its team map; where it was not localised there, in its own frame."""

    map: str
    T_frame_map: Pose | None


class RobotFile(TypedDict):
    """``robot.json``."""

    id: Name
    mode: Literal["distributed", "mapper", "central"]
    frame: NotRequired[Name | None]
    known_area_m2: Area
    team_area_m2: Area
    placed: dict[Name, Pose]
    pairs: list[PairFile]
    links: list[LinkFile]
    sent_bytes: NotRequired[dict[str, Count]]
    unwritten: NotRequired[dict[str, Count]]
    ties: NotRequired[list[tuple[Name, Name, Count, Count, bool]]]
    chosen_frame: NotRequired[ChosenFrame | None]


class LinkTotals(TypedDict):
    """What went over a pair's link, both ways."""

    a: Name
    b: Name
    exchanges: Count
    bytes_sent: Count
    bytes_full_lz4: Count
    bytes_full_raw: Count


class Replay(TypedDict):
    """Of a run that was played again."""

    drive_holds_until_s: Seconds | None


class MetricsFile(TypedDict):
    """``metrics.json``, as far as it is read again."""

    name: str
    mission_s: Seconds
    links: list[LinkTotals]
    robots_lost: list[Name]
    began_s: NotRequired[dict[Name, Seconds]]
    replay: NotRequired[Replay]


class BeganFile(TypedDict):
    """``metrics.json`` of a run or of a mapped log, as far as a recording needs it."""

    began_s: NotRequired[dict[Name, Seconds]]


class UsageFile(TypedDict):
    """``usage.json``: what a robot's process took of the machine."""

    cpu_s: Area
    peak_rss_mb: Area


class ConfigFile(TypedDict):
    """``config.json``: its sections are checked where the mission is made of them."""

    robots: list[dict[str, Any]]
    mission: NotRequired[dict[str, Any]]
    settings: NotRequired[dict[str, dict[str, Any]]]
    folder: NotRequired[str]
    replay: NotRequired[str | None]


class AnyEvent(TypedDict):
    """What every event has."""

    t: Clock
    robot: Name
    event: str


class OfPeer(AnyEvent):
    """An event about a peer."""

    peer: Name


class OfPair(AnyEvent):
    """An event about a pair of maps."""

    a: MapName
    b: MapName


class WithReason(AnyEvent):
    """An event that says why."""

    reason: str


class PeerGone(OfPeer, WithReason):
    """A peer is out of sight."""


class LinkChanged(OfPeer):
    """A link's quality."""

    quality: Share


class ExchangeStarted(OfPeer):
    """The beginning of an exchange."""

    opened_by_me: bool


class ExchangeEnded(OfPeer, WithReason):
    """The end of an exchange."""

    bytes_sent: Count
    bytes_received: Count
    bytes_full_lz4: Count
    bytes_full_raw: Count


class MapUpdated(AnyEvent):
    """A newer map of a robot, or a saved map."""

    robot_id: MapName


class Evidence(TypedDict):
    """What an attempt rests on, as far as it is read again."""

    overlap: NotRequired[Share | None]


class Tried(OfPair, WithReason):
    """An attempt at an alignment."""

    status: str
    T_a_b: Pose | None
    confidence: Share
    evidence: Evidence


class Merged(OfPair):
    """An accepted alignment."""

    T_a_b: Pose
    confidence: Share


class Unmerged(OfPair, WithReason):
    """An alignment that was withdrawn."""


class Sees(AnyEvent):
    """The laser is of use again."""

    blind_s: Annotated[float, Meta(ge=0.0, le=1e11)]


class Restarted(AnyEvent):
    """The robot's process was started again."""

    checkpoint: bool


EVENTS: dict[str, type[Any]] = {
    "alignment": Tried,
    "blind": WithReason,
    "exchange_done": ExchangeEnded,
    "exchange_failed": ExchangeEnded,
    "exchange_started": ExchangeStarted,
    "link_changed": LinkChanged,
    "map_updated": MapUpdated,
    "merged": Merged,
    "peer_gone": PeerGone,
    "peer_seen": OfPeer,
    "restarted": Restarted,
    "sees": Sees,
    "unmerged": Unmerged,
}
"""Event -> its keys that readers rely on; other events need :class:`AnyEvent` only."""
