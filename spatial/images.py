"""Grey images on disk, through OpenCV."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from spatial.errors import InputError
from spatial.files import write_bytes

MAX_PIXELS = 20_000 * 20_000
SILENT = 0
_LOG = getattr(cv2.utils, "logging", cv2)
"""Where OpenCV is told to be silent: it moved in version 5."""


def read_grey(path: Path) -> NDArray[np.uint8]:
    """Return the image as ``(H, W) uint8``, first row on top; raise ``InputError`` where it is not an image."""
    try:
        raw = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    said = _LOG.setLogLevel(SILENT)  # its own words help nobody
    try:
        image = cv2.imdecode(raw, cv2.IMREAD_GRAYSCALE) if raw.size else None
    except cv2.error:
        image = None
    finally:
        _LOG.setLogLevel(said)
    if image is None or image.size == 0:
        raise InputError(f"{path}: not a readable image: {_fault(raw.tobytes())}")
    return image.astype(np.uint8, copy=False)


def _fault(raw: bytes) -> str:
    """Return what is wrong with bytes that OpenCV cannot read as an image."""
    if not raw:
        return "the file is empty"
    header = re.match(rb"P5(?:\s|#[^\n]*\n)+(\d{1,9})\s+(\d{1,9})\s+(\d{1,9})\s", raw)
    if header:
        width, height, top = (int(number) for number in header.groups())
        wanted, held = width * height * (1 if top < 256 else 2), len(raw) - header.end()
        if held < wanted:
            return f"cut short: {width} x {height} cells need {wanted} bytes, the file holds {held}"
    if raw[:2] in (b"P2", b"P5") or raw[:4] == b"\x89PNG" or raw[:2] == b"\xff\xd8":
        return "damaged or cut short"
    return "PGM, PNG, JPEG and the like are"


def write_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write ``(H, W)`` grey or ``(H, W, 3)`` RGB ``uint8``, first row on top; the format follows the file's name."""
    stored = image if image.ndim == 2 else image[..., ::-1]
    try:
        ok, raw = cv2.imencode(path.suffix, np.ascontiguousarray(stored))
    except cv2.error:
        ok, raw = False, np.empty(0, dtype=np.uint8)
    if not ok:
        raise InputError(f"{path}: images cannot be written as {path.suffix!r}")
    write_bytes(path, raw.tobytes())
