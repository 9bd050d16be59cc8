"""The trajectory that a map was made on, as one file: keyframes, and the scan points of each."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from mrslam.spatial.errors import InputError
from mrslam.spatial.files.archives import read_arrays
from mrslam.spatial.files.atomic import write_bytes
from mrslam.spatial.key_scans import KeyScans
from mrslam.spatial.tiles import Keyframes

NAMES = ("stamps_ns", "T_map_base", "starts", "polar", "origins")
"""Arrays of the file."""


def write_keyframes(path: Path, keyframes: Keyframes, scans: KeyScans) -> None:
    """Write keyframes and the scans of the first of them, with numpy (``.npz``)."""
    write_bytes(path, keyframes_bytes(keyframes, scans))


def keyframes_bytes(keyframes: Keyframes, scans: KeyScans) -> bytes:
    """Return the bytes of the file; the same keyframes give the same ones."""
    raw = io.BytesIO()
    np.savez_compressed(
        raw, stamps_ns=keyframes.stamps_ns, T_map_base=keyframes.T_map_base, starts=scans.starts, polar=scans.polar,
        origins=scans.origins,
    )  # fmt: skip
    return raw.getvalue()


def read_keyframes(path: Path, raw: bytes | None = None) -> tuple[Keyframes, KeyScans]:
    """Return keyframes and scans; raise ``InputError`` in one line where the file is not what was written.

    ``raw`` : the file's bytes where it is within another one; ``path`` is then only named in errors.
    """
    arrays = read_arrays(path, *NAMES, raw=raw)
    stamps_ns, T_map_base = arrays["stamps_ns"], arrays["T_map_base"]
    if stamps_ns.ndim != 1 or stamps_ns.dtype != np.int64 or T_map_base.shape != (stamps_ns.size, 3):
        raise InputError(f"{path}: stamps {stamps_ns.shape} and poses {T_map_base.shape} are no keyframes")
    if T_map_base.dtype != np.float64 or not np.isfinite(T_map_base).all():
        raise InputError(f"{path}: poses are not finite numbers")
    try:
        scans = KeyScans(arrays["starts"], arrays["polar"], arrays["origins"])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if len(scans) > stamps_ns.size:
        raise InputError(f"{path}: {len(scans)} scans of {stamps_ns.size} keyframes")
    return Keyframes(stamps_ns, T_map_base), scans


def read_scanned_keyframes(path: Path, raw: bytes | None = None) -> tuple[Keyframes, KeyScans]:
    """Return those keyframes that have scans, the first ones, and the scans; see :func:`read_keyframes`."""
    keyframes, scans = read_keyframes(path, raw)
    return Keyframes(keyframes.stamps_ns[: len(scans)], keyframes.T_map_base[: len(scans)]), scans
