"""Trajectories on disk as TUM files: ``t x y z qx qy qz qw`` a line, seconds and metres, as common tools read them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import InputError
from mrslam.spatial.files.atomic import write_text

LARGEST = 9e9
"""Largest number in a file: nanoseconds of later times do not fit into 64 bits."""


def write_tum(path: Path | str, stamps_ns: NDArray[np.int64], poses: NDArray[np.float64]) -> None:
    """Write ``(N,)`` stamps (ns, rounded to microseconds) and ``(N, 3)`` poses in the order given."""
    half = poses[:, 2] / 2.0
    lines = [
        f"{stamp / 1e9:.6f} {x:.6f} {y:.6f} 0 0 0 {qz:.9f} {qw:.9f}\n"
        for stamp, (x, y, _), qz, qw in zip(stamps_ns.tolist(), poses.tolist(), np.sin(half), np.cos(half), strict=True)
    ]
    write_text(Path(path), "".join(lines))


def read_tum(path: Path | str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return ``(N,)`` stamps (ns) and ``(N, 3)`` poses in file order; raise ``InputError`` naming the bad line."""
    path = Path(path)
    rows: list[list[float]] = []
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(word) for word in line.replace(",", " ").split()]
        except ValueError as error:
            raise InputError(f"{path}, line {number}: not a number ({error})") from error
        if len(row) < 8 or not all(map(math.isfinite, row[:8])):
            raise InputError(f"{path}, line {number}: needs 8 finite numbers t x y z qx qy qz qw, got {len(row)}")
        if max(map(abs, row[:8])) > LARGEST:
            raise InputError(f"{path}, line {number}: times (s) and poses (m) must be within {LARGEST:g}")
        rows.append(row[:8])
    values = np.array(rows, dtype=np.float64).reshape(-1, 8)
    qx, qy, qz, qw = values[:, 4:].T
    theta = np.arctan2(2 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)  # of any length
    stamps_ns = np.rint(values[:, 0] * 1e9).astype(np.int64)
    return stamps_ns, np.stack([values[:, 1], values[:, 2], theta], axis=-1)
