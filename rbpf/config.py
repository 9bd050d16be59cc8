"""Settings of the mapper."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require_bounds

NOISES = ("noise_m_per_m", "noise_rad_per_m", "noise_m_per_rad", "noise_rad_per_rad", "odometry_noise")
"""Settings that are errors for each unit of motion; all have the same bounds."""
BOUNDS = {
    "particles": (1, 1000), "resolution_m": (0.01, 1.0), "linear_update_m": (0.001, 1e3),
    "angular_update_rad": (0.001, 1e3), "temporal_update_s": (0.0, 1e9), "usable_range_m": (0.1, 1e3),
    "clear_range_m": (0.0, 1e3), **dict.fromkeys(NOISES, (0.0, 10.0)),
    "sigma_m": (0.001, 1.0), "beams_match": (10, 100_000),
    "beams_filter": (10, 100_000), "evidence_beams": (0.01, 1e5), "neff_fraction": (0.0, 1.0), "threads": (0, 256),
}  # fmt: skip
"""Least and largest value of every number."""


@dataclass(frozen=True, kw_only=True)
class MapperConfig:
    """Settings of one robot's mapper; the defaults serve indoor robots with lasers of 4 to 80 m."""

    particles: int = 30
    """Most particles, 1..1000: histories of where the robot has been; one where all of its way was seen."""
    resolution_m: float = 0.05
    """Edge of a map cell, metres, 0.01..1."""
    linear_update_m: float = 0.6
    """The filter is updated after this much driving, 0.001..1000 m."""
    angular_update_rad: float = 0.5
    """The filter is updated after this much turning, 0.001..1000 rad."""
    temporal_update_s: float = 0.0
    """The filter is updated after this much time even at rest, 0..1e9 s; 0 = never: at rest nothing new is learnt."""
    usable_range_m: float = 40.0
    """Returns beyond this are not used, 0.1..1000 m."""
    clear_range_m: float = 0.0
    """Beams without a return clear the map up to here, 0..1000 m; 0 = they are ignored."""
    noise_m_per_m: float = 0.03
    """Expert: motion noise after scan matching, metres of error a metre driven, 0..10 (GMapping's srr)."""
    noise_rad_per_m: float = 0.003
    """Expert: motion noise after scan matching, radians of error a metre driven, 0..10 (srt in GMapping's code)."""
    noise_m_per_rad: float = 0.01
    """Expert: motion noise after scan matching, metres of error a radian turned, 0..10 (str in GMapping's code)."""
    noise_rad_per_rad: float = 0.01
    """Expert: motion noise after scan matching, radians of error a radian turned, 0..10 (GMapping's stt)."""
    odometry_noise: float = 0.1
    """Odometry's error at first, as a share of the motion, 0..10; later it is learnt from the scans."""
    sigma_m: float = 0.03
    """Expert: scale of the distance between a beam's end and the map, 0.001..1 m: range noise and the map's own."""
    beams_match: int = 180
    """Expert: most beams that the local matching of every scan uses, 10..100000."""
    beams_filter: int = 120
    """Expert: most beams that the matching of each particle uses, 10..100000."""
    evidence_beams: float = 10.0
    """Expert: a scan weighs as much as this many independent beams, 0.01..100000; fewer let particles live longer."""
    neff_fraction: float = 0.5
    """Expert: particles are resampled when fewer than this share of them are effective, 0..1."""
    use_odometry: bool = True
    """Whether odometry is used where there is some; without, motion is predicted from the motion before."""
    close_loops: bool = True
    """Whether places seen again are searched for, and trajectories relaxed when one is found."""
    use_walls: bool = True
    """Whether the directions in which straight walls run keep the map from turning, where there are any."""
    threads: int = 0
    """Threads for the particles, 0..256; 0 = as many as there are cores. Results do not depend on it."""

    def __post_init__(self) -> None:
        """Check every bound; raise ``InputError`` naming the setting."""
        require_bounds("rbpf", self, BOUNDS)
