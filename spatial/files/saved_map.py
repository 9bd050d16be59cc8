"""A saved map as one file (``.mrslam``).

It is a zip archive, so that any other program can take the map out of it: the map as map servers read it, its keyframes
with their scans, and a manifest that says how it came about and holds the hash of every part. It is written whole or
not at all, and every part is verified before anything is made of it.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.spatial.errors import InputError, first_line
from mrslam.spatial.files.atomic import write_bytes
from mrslam.spatial.files.images import decoded_image, encoded_image
from mrslam.spatial.files.keyframes import keyframes_bytes, read_scanned_keyframes
from mrslam.spatial.files.pixels import Pixels
from mrslam.spatial.files.trinary import not_empty, pixels, yaml_text
from mrslam.spatial.grid import OccupancyGrid
from mrslam.spatial.key_scans import KeyScans
from mrslam.spatial.tiles import MOST_CELLS, Keyframes

SUFFIX = ".mrslam"
"""How the names of saved maps end."""
KIND = "mrslam saved map"
FORMAT = 1
"""Of the file's layout; a file of a higher one is refused, lower ones are read."""
MANIFEST, YAML, IMAGE, KEYFRAMES = "manifest.json", "map.yaml", "map.pgm", "keyframes.npz"
PARTS = (YAML, IMAGE, KEYFRAMES)
PART_MOST_BYTES = 2 * MOST_CELLS
"""No part is larger than the image of the largest map, and a header; more is refused before it is unpacked."""
DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, ValueError, RuntimeError, KeyError)
"""What ``zipfile`` raises on archives that are cut off or damaged."""


@dataclass(frozen=True)
class Session:
    """One drive of one robot that a saved map was made of."""

    name: str
    """What it was called when it was added, such as ``r1@monday``."""
    keyframes: int
    """Those of its keyframes that the map still holds."""
    way_m: float
    """Path of the robot, metres; 0 where it is not known."""


@dataclass(frozen=True, eq=False)
class SavedMap:
    """A map to come back to; the keyframes of its sessions stand one session after the other, the oldest first.

    Raises ``InputError`` where the numbers of keyframes contradict each other.
    """

    grid: OccupancyGrid
    """In the frame of the first session's map."""
    keyframes: Keyframes
    """In the same frame."""
    scans: KeyScans
    """Of each keyframe."""
    sessions: tuple[Session, ...]
    """One at least, the oldest first; the number of them is the map's version."""

    def __post_init__(self) -> None:
        held = sum(session.keyframes for session in self.sessions)
        counts = {held, self.keyframes.stamps_ns.size, len(self.scans)}
        if not self.sessions or len(counts) > 1:
            raise InputError(f"{len(self.sessions)} sessions of {held} keyframes contradict {sorted(counts)}")

    @property
    def version(self) -> int:
        """Number of sessions that have gone into it."""
        return len(self.sessions)


def write_saved_map(path: Path, saved: SavedMap) -> None:
    """Write a saved map in one step; the same map gives the same bytes."""
    grid = not_empty(saved.grid)
    parts = {
        YAML: yaml_text(grid, IMAGE).encode(),
        IMAGE: encoded_image(Path(IMAGE), pixels(grid)),
        KEYFRAMES: keyframes_bytes(saved.keyframes, saved.scans),
    }
    manifest = {
        "kind": KIND,
        "format": FORMAT,
        "sha256": {name: hashlib.sha256(part).hexdigest() for name, part in parts.items()},
        "resolution_m": grid.resolution_m,
        "origin_m": list(grid.origin_m),
        "sessions": [asdict(session) for session in saved.sessions],
    }
    raw = io.BytesIO()
    with zipfile.ZipFile(raw, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, part in {MANIFEST: json.dumps(manifest, indent=1).encode(), **parts}.items():
            info = zipfile.ZipInfo(name)  # of the year 1980: the time of writing is no part of the map
            info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(info, part)
    write_bytes(path, raw.getvalue())


def read_saved_map(path: Path) -> SavedMap:
    """Return a saved map; raise ``InputError`` in one line where the file is none, damaged, or of a newer program."""
    parts = _parts(path)
    manifest = _manifest(path, parts.pop(MANIFEST))
    for name in PARTS:
        part = parts.get(name, b"")
        if hashlib.sha256(part).hexdigest() != manifest["sha256"].get(name):
            raise InputError(f"{path}: damaged: {name} in it is not what was written")
    cells = Pixels().cells(*decoded_image(path / IMAGE, parts[IMAGE]))
    keyframes, scans = read_scanned_keyframes(path / KEYFRAMES, parts[KEYFRAMES])
    try:
        x, y = (float(value) for value in manifest["origin_m"])
        grid = OccupancyGrid(cells, float(manifest["resolution_m"]), (x, y))
        sessions = tuple(
            Session(str(one["name"]), int(one["keyframes"]), float(one["way_m"])) for one in manifest["sessions"]
        )
        return SavedMap(grid, keyframes, scans, sessions)
    except (TypeError, ValueError, LookupError, OverflowError) as error:
        raise InputError(f"{path}: damaged: its manifest makes no sense ({first_line(error)})") from error


def _parts(path: Path) -> dict[str, bytes]:
    """Return the manifest and the other parts, as they are in the archive."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            names = archive.namelist()
            if MANIFEST not in names:
                raise InputError(f"{path}: not a saved map of mrslam: there is no {MANIFEST} in it")
            large = [one.filename for one in archive.infolist() if one.file_size > PART_MOST_BYTES]
            if large:
                raise InputError(f"{path}: {large[0]} in it is larger than any map")
            return {name: archive.read(name) for name in (MANIFEST, *PARTS) if name in names}
    except InputError:
        raise
    except DAMAGE as error:
        if raw[:4] != b"PK\x03\x04":
            raise InputError(f"{path}: not a saved map of mrslam") from error
        raise InputError(f"{path}: cut off or damaged ({first_line(error)})") from error


def _manifest(path: Path, raw: bytes) -> Mapping[str, Any]:
    """Return the manifest of a file that this program can read and that has all its parts."""
    try:
        manifest = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged: {MANIFEST} in it is not readable ({first_line(error)})") from error
    if not isinstance(manifest, dict) or manifest.get("kind") != KIND:
        raise InputError(f"{path}: not a saved map of mrslam")
    number = manifest.get("format")
    if not isinstance(number, int) or number < 1:
        raise InputError(f"{path}: damaged: its format is {number!r}")
    if number > FORMAT:
        raise InputError(f"{path}: written by a newer mrslam (format {number}, this one reads {FORMAT}); update it")
    hashes = manifest.get("sha256")
    if not isinstance(hashes, dict) or set(hashes) != set(PARTS):
        raise InputError(f"{path}: damaged: it does not hold {', '.join(PARTS)}")
    return manifest


def of_one_session(name: str, grid: OccupancyGrid, keyframes: Keyframes, scans: KeyScans) -> SavedMap:
    """Return the first version of a saved map."""
    steps = np.hypot(*np.diff(keyframes.T_map_base[:, :2], axis=0).T)
    return SavedMap(grid, keyframes, scans, (Session(name, keyframes.stamps_ns.size, round(float(steps.sum()), 2)),))
