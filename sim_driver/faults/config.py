"""Faults as a mission lists them: what goes wrong, with whom, when, and for how long."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require, require_bounds

KINDS = {
    "crash": "the robot's computer dies, and starts again after `for_s` from its checkpoint",
    "amnesia": "the robot's computer dies, and starts again after `for_s` knowing nothing",
    "partition": "nobody hears the robot, and it hears nobody",
    "flapping": "the robot's links go up and down every 3 s",
    "corrupt": "one in three of the robot's messages arrives with changed bytes",
    "clock": "the robot's clock jumps by `amount` seconds, and gains a thousandth from then on",
    "slow": "the robot takes one scan in `amount`",
    "disk_full": "nothing can be written to the robot's disk",
    "laser_stuck": "the laser repeats its last scan with new stamps",
    "laser_garbage": "the laser gives random ranges, zeros, NaN and infinities",
    "laser_off": "the laser gives nothing",
    "odometry_jump": "the wheels report a leap of `amount` metres, once",
    "kidnapped": "somebody carries the robot `amount` metres and turns it round",
    "twin": "a second process with the robot's id appears",
    "liar": "the robot gives out a map that is not what it sees, from start to end: rotated, mirrored or random",
}
"""What can go wrong, in a sentence each."""

BOUNDS = {"at_s": (0.0, 1e7), "for_s": (0.001, 1e7), "amount": (-1e6, 1e6)}
"""Least and largest value of every number."""
ONCE = ("odometry_jump", "kidnapped")
"""Faults that happen at one moment; the others last."""


@dataclass(frozen=True, kw_only=True)
class FaultConfig:
    """One thing that goes wrong; only in virtual time."""

    kind: str
    """What: one of the kinds in docs/missions.md ("crash", "partition", "kidnapped", "liar", ...)."""
    robot: str
    """With whom: a robot's id."""
    at_s: float = 0.0
    """When, mission seconds, >= 0."""
    for_s: float = 10.0
    """For how long, seconds, > 0; a crashed robot is down for as long."""
    amount: float = 1.0
    """How much, where the kind has a measure (clock: s, slow: scans, 2 and more, odometry_jump and kidnapped: m)."""

    def __post_init__(self) -> None:
        require(self.kind in KINDS, "faults.kind", f"one of {', '.join(KINDS)}", self.kind)
        require_bounds("faults", self, BOUNDS)
        require(
            self.kind != "liar" or self.at_s == 0, "faults.at_s of liar", "0 s: it lies from start to end", self.at_s
        )
        require(
            self.kind != "slow" or self.amount >= 2,
            "faults.amount of slow",
            ">= 2: it takes one scan in so many",
            self.amount,
        )

    @property
    def end_s(self) -> float:
        """When it is over, mission seconds."""
        return self.at_s if self.kind in ONCE else self.at_s + self.for_s

    def active(self, now_ns: int) -> bool:
        """Return whether it goes on at this mission time."""
        return self.at_s <= now_ns / 1e9 < self.end_s
