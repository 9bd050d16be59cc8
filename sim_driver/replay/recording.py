"""What a simulated robot sensed, as a file: ``scans.npz`` in its folder."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.agent import Agent, Event, Sensed
from mrslam.sim_driver.missions.run_files import SCANS_FILE
from mrslam.sim_driver.missions.sections import LONGEST_S
from mrslam.spatial import InputError, Scan
from mrslam.spatial.files.archives import read_arrays
from mrslam.spatial.files.atomic import is_file, write_bytes
from mrslam.spatial.files.full_disk import unwritten_is_logged
from mrslam.spatial.runtime.spool import Spool


class Recorder:
    """Puts every scan and its odometry away as they came, and writes them when the robot ends."""

    def __init__(self, folder: Path) -> None:
        """Write into this folder."""
        self._folder = folder
        self._first: Scan | None = None
        self._rows: Spool | None = None

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Put the scan away as it was before teammates were masked."""
        if self._first is None or self._rows is None:
            self._first, self._rows = sensed.scan, Spool(row_of(sensed.scan))
        self._rows.add(as_row(sensed))

    def on_event(self, agent: Agent, event: Event) -> None:
        """Events are in ``events.jsonl`` already."""

    def close(self, agent: Agent, now_ns: int) -> None:
        """Write the file; where that cannot be, as on a full disk, it is logged."""
        if self._first is not None and self._rows is not None:
            path = self._folder / SCANS_FILE
            with unwritten_is_logged(agent.robot_id, path):
                _write(path, self._first, self._rows.rows)


def row_of(scan: Scan) -> np.dtype[Any]:
    """Return the type of a row of a recording, of scans with as many beams."""
    return np.dtype(
        [
            ("t_ns", np.int64),
            ("stamps_ns", np.int64),
            ("ranges_m", np.float32, scan.ranges_m.shape),
            ("T_odom_base", np.float64, 3),
        ]
    )


def as_row(sensed: Sensed) -> tuple[int, int, NDArray[np.float32], NDArray[np.float64]]:
    """Return what was sensed as a row; no odometry is NaN."""
    T_odom_base = np.full(3, np.nan) if sensed.T_odom_base is None else sensed.T_odom_base
    return sensed.t_ns, sensed.scan.stamp_ns, sensed.scan.ranges_m, T_odom_base


def write_recording(path: Path, sensed: list[Sensed]) -> None:
    """Write scans of one laser: ``t_ns (N,)``, ``ranges_m (N, B)``, ``T_odom_base (N, 3)`` (NaN: none), geometry."""
    scan = sensed[0].scan
    _write(path, scan, np.array([as_row(one) for one in sensed], row_of(scan)))


def _write(path: Path, scan: Scan, rows: NDArray[Any]) -> None:
    buffer = io.BytesIO()
    np.savez(
        buffer,
        t_ns=rows["t_ns"],
        stamps_ns=rows["stamps_ns"],
        ranges_m=rows["ranges_m"],
        T_odom_base=rows["T_odom_base"],
        geometry=np.array(
            [scan.angle_min_rad, scan.angle_increment_rad, scan.range_max_m, scan.range_min_m, scan.beam_interval_s]
        ),
        T_base_laser=scan.T_base_laser,
    )
    write_bytes(path, buffer.getvalue())


def read_recording(path: Path) -> list[Sensed]:
    """Return the scans in the order they came; raise ``InputError`` where the file is none."""
    if not is_file(path):
        raise InputError(f"{path}: no such file; the run kept no scans (mission.record = false?)")
    table = read_arrays(path)
    try:
        geometry = [*map(float, table["geometry"]), 0.0]  # older recordings do not tell the time between beams
        angle_min, increment, range_max, range_min, interval = geometry[:5]
        t_ns, count = table["t_ns"], len(table["ranges_m"])
        if not (t_ns.dtype == table["stamps_ns"].dtype == np.int64 and table["T_odom_base"].shape == (count, 3)):
            raise ValueError("times are no whole numbers, or odometry is no poses")
        if count and not (t_ns[0] >= 0 and t_ns[-1] <= LONGEST_S * 1e9 and (np.diff(t_ns) >= 0).all()):
            raise ValueError("times run backward, or beyond any mission")
        rows = zip(t_ns.tolist(), table["stamps_ns"].tolist(), table["T_odom_base"], strict=True)
        return [
            Sensed(
                t_ns,
                Scan(
                    stamp_ns=stamp_ns,
                    ranges_m=ranges_m,
                    angle_min_rad=angle_min,
                    angle_increment_rad=increment,
                    range_max_m=range_max,
                    range_min_m=range_min,
                    T_base_laser=table["T_base_laser"],
                    beam_interval_s=interval,
                ),
                None if np.isnan(T_odom_base).any() else T_odom_base,
            )
            for (t_ns, stamp_ns, T_odom_base), ranges_m in zip(rows, table["ranges_m"], strict=True)
        ]
    except (TypeError, ValueError, LookupError, OverflowError) as error:
        raise InputError(f"{path}: not a recording of scans ({error})") from error
