"""What a log holds, and what it lacks, before anyone spends an hour mapping it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.feeds import guess_format, open_feed
from mrslam.sim_driver.feeds.base import Feed
from mrslam.spatial import se2

FAST_M_S, LONG_GAP_S, SPARSE_M = 3.0, 2.0, 0.5


def inspect(path: Path | str, format: str | None = None, salvage: bool = False) -> dict[str, Any]:
    """Return the facts about a log as JSON values; raise ``InputError`` where it cannot be read."""
    path = Path(path)
    feed = open_feed(path, format, salvage)
    facts: dict[str, Any] = {"file": str(path), "format": format or guess_format(path), "scans": len(feed.readings)}
    facts |= _time(feed) | _laser(feed) | _odometry(feed)
    facts["notes"] = list(feed.notes)
    facts["missing"], facts["odd"] = _missing(facts), _odd(facts)
    return facts


def _time(feed: Feed) -> dict[str, Any]:
    stamps = np.array([reading.scan.stamp_ns for reading in feed.readings], dtype=np.int64)
    steps_s = np.diff(stamps) / 1e9
    forward = steps_s[steps_s > 0]
    typical = float(np.median(forward)) if forward.size else 0.0
    return {
        "start_s": round(int(stamps[0]) / 1e9, 3),
        "duration_s": round(int(stamps.max() - stamps.min()) / 1e9, 3),
        "rate_hz": round(1.0 / typical, 2) if typical > 0 else None,
        "longest_gap_s": round(float(steps_s.max()), 3) if steps_s.size else 0.0,
        "gaps": int((steps_s > max(LONG_GAP_S, 5 * typical)).sum()),
        "stamps_even": bool(steps_s.size > 10 and np.ptp(steps_s) < 1e-6 and typical > 0),
        "stamps_backward": int((steps_s < 0).sum()),
        "stamps_repeated": int((steps_s == 0).sum()),
    }


def _laser(feed: Feed) -> dict[str, Any]:
    scans = [reading.scan for reading in feed.readings]
    beams = np.array([scan.ranges_m.size for scan in scans])
    increments = np.degrees([scan.angle_increment_rad for scan in scans])
    starts = np.degrees([scan.angle_min_rad for scan in scans])
    ranges: NDArray[np.float32] = np.concatenate([scan.ranges_m for scan in scans[:: max(1, len(scans) // 500)]])
    returns = ranges[np.isfinite(ranges)]
    mounting = scans[0].T_base_laser
    return {
        "beams": int(np.median(beams)),
        "beams_vary": bool((beams != beams[0]).any()),
        "first_beam_deg": round(float(np.median(starts)), 3),
        "first_beam_varies": bool(np.ptp(starts) > 1e-3),
        "increment_deg": round(float(np.median(increments)), 4),
        "field_of_view_deg": round(float(abs(np.median(increments)) * (np.median(beams) - 1)), 1),
        "range_min_m": round(scans[0].range_min_m, 3),
        "range_max_m": round(scans[0].range_max_m, 2),
        "range_max_known": scans[0].range_max_m < 1e3,
        "median_range_m": round(float(np.median(returns)), 2) if returns.size else None,
        "farthest_return_m": round(float(returns.max()), 2) if returns.size else None,
        "returns_share": round(float(np.isfinite(ranges).mean()), 3),
        "no_return_share": round(float(np.isposinf(ranges).mean()), 3),
        "dropped_share": round(float(np.isnan(ranges).mean()), 3),
        "laser_on_robot": [round(float(v), 3) for v in mounting],
    }


def _odometry(feed: Feed) -> dict[str, Any]:
    with_odometry = [reading for reading in feed.readings if reading.T_odom_base is not None]
    facts: dict[str, Any] = {"odometry_share": round(len(with_odometry) / len(feed.readings), 3)}
    if len(with_odometry) < 2:
        return facts | {"path_m": None, "turned_deg": None, "fastest_m_s": None, "step_m": None}
    poses = np.array([reading.T_odom_base for reading in with_odometry])
    stamps_s = np.array([reading.scan.stamp_ns for reading in with_odometry]) / 1e9
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    seconds = np.diff(stamps_s)
    speeds = steps[seconds > 1e-3] / seconds[seconds > 1e-3]
    moving = steps[steps > 1e-4]
    return facts | {
        "path_m": round(float(steps.sum()), 2),
        "turned_deg": round(float(np.degrees(np.abs(se2.wrap(np.diff(poses[:, 2]))).sum())), 0),
        "fastest_m_s": round(float(np.percentile(speeds, 99)), 2) if speeds.size else None,
        "step_m": round(float(np.median(moving)), 3) if moving.size else 0.0,
    }


def _missing(facts: dict[str, Any]) -> list[str]:
    """Return what is not there, one plain sentence each."""
    found = [
        (facts["odometry_share"] == 0.0, "no odometry: the mapper has scan matching alone, keep the motion slow"),
        (0.0 < facts["odometry_share"] < 1.0, f"only {facts['odometry_share']:.1%} of the scans have odometry"),
        (facts["duration_s"] == 0.0 and facts["scans"] > 1, "no time stamps: scans are taken in the file's order"),
        (not facts["range_max_known"], "no maximum range: beams without return cannot be told from far walls"),
        (
            not any(facts["laser_on_robot"]),
            "the laser's place on the robot is not told (or is the centre): turns may smear the map",
        ),
    ]
    return [sentence for applies, sentence in found if applies]


def _odd(facts: dict[str, Any]) -> list[str]:
    """Return what is there but looks wrong, one plain sentence each."""
    found = [
        (facts["path_m"] == 0.0 and facts["turned_deg"] == 0.0, "the odometry never moves"),
        (facts["stamps_even"], "stamps are evenly spaced to the microsecond: numbers, not measured times"),
        (facts["gaps"] > 0, f"{facts['gaps']} long gaps between scans, the longest {facts['longest_gap_s']:g} s"),
        ((facts["step_m"] or 0.0) > SPARSE_M, f"scans are {facts['step_m']} m apart: matching has little overlap"),
        (
            (facts["fastest_m_s"] or 0.0) > FAST_M_S,
            f"odometry at {facts['fastest_m_s']} m/s: jumps, or stamps that lie",
        ),
        (facts["beams_vary"], "the number of beams varies from scan to scan"),
        (facts["first_beam_varies"], "the direction of the first beam varies from scan to scan"),
        (facts["returns_share"] < 0.3, f"only {facts['returns_share']:.0%} of the beams hit anything"),
    ]
    return [sentence for applies, sentence in found if applies]


def describe(facts: dict[str, Any]) -> str:
    """Return the facts as text for people."""
    rate = "unknown rate" if facts["rate_hz"] is None else f"{facts['rate_hz']:g} Hz"
    reach = f"{facts['range_min_m']:g}..{facts['range_max_m']:g} m" if facts["range_max_known"] else "no limit told"
    if facts["path_m"] is None:
        odometry = "none"
    else:
        odometry = f"{facts['path_m']:g} m driven, {facts['turned_deg']:g} deg turned"
    x, y, theta = facts["laser_on_robot"]
    field = f"{facts['field_of_view_deg']:g} deg from {facts['first_beam_deg']:g} deg"
    lines = [
        f"{facts['file']}: {facts['format']} log",
        f"  scans      {facts['scans']} in {facts['duration_s']:g} s, {rate}",
        f"  laser      {facts['beams']} beams over {field}, range {reach}",
        f"  mounted    at ({x:g}, {y:g}) m, {np.degrees(theta):.1f} deg",
        f"  beams      {facts['returns_share']:.1%} returns (median {facts['median_range_m']} m),"
        f" {facts['no_return_share']:.1%} no return, {facts['dropped_share']:.1%} dropped",
        f"  odometry   {odometry}",
    ]
    lines += [f"  note       {note}" for note in facts["notes"]]
    lines += [f"  odd        {sentence}" for sentence in facts["odd"]]
    lines += [f"  missing    {sentence}" for sentence in facts["missing"]]
    return "\n".join(lines if facts["missing"] else [*lines, "  nothing is missing"])
