"""A robot's clock that jumps and then gains: what it shows, and when it truly was."""

from __future__ import annotations

from collections.abc import Sequence

from mrslam.sim_driver.faults.config import FaultConfig

GAIN = 1e-3
"""A clock that has jumped gains as much from then on, seconds a second."""


def shown_ns(faults: Sequence[FaultConfig], now_ns: int) -> int:
    """Return what a robot's clock shows at this mission time, by the "clock" faults among its faults."""
    for fault in _jumps(faults):
        since_ns = now_ns - round(fault.at_s * 1e9)
        if since_ns >= 0:
            now_ns += round(fault.amount * 1e9 + GAIN * since_ns)
    return now_ns


def mission_times_s(faults: Sequence[FaultConfig], shown_s: Sequence[float]) -> list[float]:
    """Return the mission times of what a robot noted one after the other by its clock, seconds.

    A clock that was set back shows some times twice. They are of before the jump until the first that is earlier than
    the one noted before it, or that the clock showed after the jump only.
    """
    times_s = list(shown_s)
    for jump in reversed(_jumps(faults)):
        times_s = _undone(jump, times_s)
    return times_s


def _jumps(faults: Sequence[FaultConfig]) -> list[FaultConfig]:
    return [fault for fault in faults if fault.kind == "clock"]


def _undone(jump: FaultConfig, times_s: Sequence[float]) -> list[float]:
    out, has_jumped, before_s = [], False, float("-inf")
    for time_s in times_s:
        has_jumped = has_jumped or time_s < before_s or time_s > jump.at_s
        before_s = time_s
        out.append((time_s - jump.amount + GAIN * jump.at_s) / (1.0 + GAIN) if has_jumped else time_s)
    return out
