"""Grey images on disk, through OpenCV."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from spatial.errors import InputError
from spatial.files import write_bytes

MAX_PIXELS = 20_000 * 20_000


def read_grey(path: Path) -> NDArray[np.uint8]:
    """Return the image as ``(H, W) uint8``, first row on top; raise ``InputError`` where it is not an image."""
    try:
        raw = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        image = cv2.imdecode(raw, cv2.IMREAD_GRAYSCALE) if raw.size else None
    except cv2.error as error:
        raise InputError(f"{path}: not a readable image") from error
    if image is None or image.size == 0:
        raise InputError(f"{path}: not a readable image (PGM, PNG, JPEG and the like are)")
    return image.astype(np.uint8, copy=False)


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
