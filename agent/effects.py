"""What an agent asks its shell to do. Messages to send are :class:`mrslam.comms.Send`; the rest is here."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from mrslam import comms
from mrslam.agent.known_map import KnownMap
from mrslam.alignment import Alignment, Prior, Rejection
from mrslam.comms import Send
from mrslam.merge import BentTeam, JointMap, Pair, Trail
from mrslam.rbpf import UpdateInfo
from mrslam.spatial import LocalMap, OccupancyGrid
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True)
class Event:
    """Something worth a line in ``events.jsonl``."""

    t_ns: int
    """Mission time, nanoseconds."""
    kind: str
    fields: dict[str, Any] = field(default_factory=dict)
    """Plain JSON values."""


@dataclass(frozen=True, eq=False)
class AlignJob:
    """Two maps whose transform ``T_a_b`` is to be found; slow, so the shell runs it on another thread."""

    a: str
    b: str
    grid_a: OccupancyGrid
    grid_b: OccupancyGrid
    prior: Prior | None
    """Where to look; None searches all transforms."""
    versions: tuple[tuple[int, int], tuple[int, int]]
    """(epoch, revision) of the two maps."""
    area_m2: tuple[float, float]
    """Known areas of the two maps, square metres."""
    attempt: int
    """Number of tries before; seeds the search, so that a second try is independent evidence."""
    trails: tuple[Trail, Trail] | None = None
    """The trails of the two maps: where these fit only when bent, they are bent by the trails' scans."""
    sighted: Transform | None = None
    """``(3,)``, where two robots that saw each other have the maps; None where nobody did."""
    place: Transform | None = None
    """``(3,)``, where the maps were found before: examined before anything is searched for (:func:`align`)."""
    hinted_by: str | None = None
    """The robot that found them there; None where this one did."""
    by_parts: bool = False
    """Whether large maps that do not fit as a whole are looked at in parts (:func:`align`)."""
    searched: KnownMap | None = None
    """The saved map of the two, where all of it is searched for a place that nobody has told."""
    is_believed: bool = False
    """Whether the two are merged."""

    @property
    def saved_m2(self) -> float | None:
        """Known area of the saved map in which a robot's is looked for, square metres; None where there is not one."""
        saved = [m2 for map_id, m2 in zip((self.a, self.b), self.area_m2, strict=True) if comms.is_saved(map_id)]
        return saved[0] if len(saved) == 1 else None

    @property
    def is_of_robots(self) -> bool:
        """Whether both maps are robots', which grow."""
        return not any(comms.is_saved(map_id) for map_id in (self.a, self.b))

    @property
    def is_vouched(self) -> bool:
        """Whether a robot is looked for in a saved map where it says that it is."""
        return self.hinted_by in (self.a, self.b) and self.saved_m2 is not None

    @property
    def is_told(self) -> bool:
        """Whether the maps are searched for near where they were told to lie, by starts or by a hint of the user's."""
        return self.place is None and self.prior is not None and self.sighted is None

    @property
    def follows(self) -> bool:
        """Whether the maps are known to lie near the place, and are searched for there if they do not fit at it."""
        return self.place is not None and self.prior is not None and self.hinted_by is None


@dataclass(frozen=True, eq=False)
class JoinJob:
    """Placed maps whose keyframes are to be solved jointly (:func:`mrslam.merge.join`); slow, too."""

    frame: str
    """The robot whose map frame is the team's."""
    trails: Mapping[str, Trail]
    T_team_map: Mapping[str, Transform]
    """By robot: ``(3,)``, the rigid placement (``Placement.T_rigid``)."""
    T_a_b: Mapping[Pair, Transform]
    """The alignments believed now."""
    seen: Mapping[Pair, Transform]
    """Those of them whose robots saw each other there."""
    epochs: Mapping[str, int]
    """Epoch of each robot's map: the outcome is void where one has changed."""


Job = AlignJob | JoinJob
Outcome = Alignment | Rejection | JointMap


Effect = Send | Event


def as_event(effect: comms.Effect, t_ns: int) -> Event:
    """Return what the network core reports as an event: its class in snake case, plain fields, counts for lists."""
    kind = re.sub(r"(?<!^)(?=[A-Z])", "_", type(effect).__name__).lower()
    return Event(t_ns, kind, dict(_plain_fields(effect)))


def _plain_fields(record: Any) -> Iterator[tuple[str, Any]]:
    """Yield a record's fields by name, maps left out; those of a record inside it are its own."""
    for item in fields(record):
        value = getattr(record, item.name)
        if isinstance(value, LocalMap):
            continue
        if is_dataclass(value):
            yield from _plain_fields(value)
        else:
            yield item.name, _plain(value)


def mapped_fields(info: UpdateInfo) -> dict[str, Any]:
    """Return the fields of the event "mapped" of one scan: the pose it was mapped at, and the filter's state."""
    x, y, theta = (round(float(value), 4) for value in info.T_map_base)
    return {
        "x_m": x,
        "y_m": y,
        "theta_rad": theta,
        "neff": round(info.neff, 2),
        "resampled": info.resampled,
        "health": round(info.health, 3),
    }


def known_fields(own_m2: float, team_m2: float, placed: Collection[str]) -> dict[str, Any]:
    """Return the fields of the event "known": how large the maps are, and whose are placed."""
    return {"own_m2": round(own_m2, 2), "team_m2": round(team_m2, 2), "placed": sorted(placed)}


def joined_fields(bent: BentTeam) -> dict[str, Any]:
    """Return the fields of the event "joined": believed ties by pair, and how far each robot's keyframes were bent."""
    tied = Counter(f"{tie.a}-{tie.b}" for tie in bent.ties if tie.believed)
    return {
        "ties": dict(sorted(tied.items())),
        "dropped": sum(not tie.believed for tie in bent.ties),
        "bent_m": {name: round(bend.most_m, 3) for name, bend in sorted(bent.bends.items())},
        "ambiguous": {f"{a}-{b}": why for (a, b), why in sorted(bent.ambiguous.items())},
    }


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 4)
    return len(value) if isinstance(value, tuple) else value
