"""Settings of mutual detection."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require_bounds

BOUNDS = {
    "robot_radius_m": (0.001, 10.0), "margin_m": (0.0, 10.0), "sigmas": (0.0, 100.0), "max_radius_m": (0.001, 100.0),
    "acceleration_m_s2": (1e-4, 1e3), "position_sigma_m": (1e-4, 100.0), "gate_sigmas": (0.01, 1e3),
    "forget_after_s": (0.01, 1e6),
}  # fmt: skip
"""Least and largest value of every number."""


@dataclass(frozen=True, kw_only=True)
class MutualDetectionConfig:
    """Where teammates are taken to be, how large, and whether seeing them is evidence."""

    enabled: bool = True
    """Whether beams that end at teammates are discarded. Off: teammates become ghost walls in the map."""
    encounters: bool = True
    """Whether seeing a teammate, or free floor where it should stand, is evidence on how two maps lie. Off where robots
    cannot see each other's bodies: all lasers above them."""
    teammates_visible: bool = False
    """Whether every laser of the team surely meets teammates' bodies. If so, free floor where a teammate should stand
    refutes a place though the robots never saw each other; if not, they must have seen each other there before. On in
    simulated missions."""
    robot_radius_m: float = 0.18
    """Radius of a teammate's body, metres, > 0."""
    margin_m: float = 0.08
    """Room around the body for range noise and cells that the edge of the body falls into, metres, >= 0."""
    sigmas: float = 2.0
    """Expert: circles are wider than the body by so many standard deviations of the predicted place, >= 0."""
    max_radius_m: float = 0.8
    """Expert: no circle is wider, metres, > 0: better a few ghost cells than a wall that is never mapped."""
    acceleration_m_s2: float = 0.6
    """Expert: how hard teammates brake and turn, one sigma, m/s^2, > 0. More: circles grow faster with age."""
    position_sigma_m: float = 0.05
    """Expert: error of a reported place beside that of the transform between the maps, one sigma, metres, > 0."""
    gate_sigmas: float = 6.0
    """Expert: a report farther off starts the track afresh (the transform between the maps was corrected), > 0."""
    forget_after_s: float = 2.5
    """Teammates not heard of for so long are no longer filtered out, seconds, > 0."""

    def __post_init__(self) -> None:
        require_bounds("mutual_detection", self, BOUNDS)
