"""Grey images on disk, through OpenCV."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import InputError
from mrslam.spatial.files.atomic import write_bytes

RAW_PGM = re.compile(rb"P5(?:\s|#[^\n]*\n)+(\d{1,9})\s+(\d{1,9})\s+(\d{1,9})\s")
"""Width, height and the number that is white."""
SILENT = 0
"""OpenCV's level of logging at which it prints nothing."""


def read_image(path: Path) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Return an image's greys ``(H, W) uint8``, first row on top, and which pixels are opaque, None for all.

    Raises ``InputError`` where it is not an image.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    return decoded_image(path, content)


def decoded_image(path: Path, content: bytes) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Return what :func:`read_image` does of an image's bytes; ``path`` is named in errors."""
    import cv2  # in functions only: grids and scans are used without it

    raw = np.frombuffer(content, dtype=np.uint8)
    header = RAW_PGM.match(raw[:1000].tobytes())
    white = int(header[3]) if header else 255
    log = getattr(cv2.utils, "logging", cv2)  # it moved in version 5
    level = log.setLogLevel(SILENT)  # its own messages help nobody
    try:
        grey = _decode(raw, cv2.IMREAD_GRAYSCALE)
        whole = grey if header and white == 255 else _decode(raw, cv2.IMREAD_UNCHANGED)  # as most maps are: read once
    finally:
        log.setLogLevel(level)
    if grey is None or whole is None:
        raise InputError(f"{path}: not a readable image: {_fault(raw.tobytes())}")
    if header and white not in (255, 65535):  # the decoder takes the numbers as they are
        grey = np.clip(np.rint(whole * (255.0 / max(white, 1))), 0, 255).astype(np.uint8)
    has_alpha = whole.ndim == 3 and whole.shape[2] == 4
    opaque = whole[..., 3] == np.iinfo(whole.dtype).max if has_alpha else None
    return grey.astype(np.uint8, copy=False), opaque


def _decode(raw: NDArray[np.uint8], how: int) -> NDArray[Any] | None:
    import cv2

    try:
        image = cv2.imdecode(raw, how) if raw.size else None
    except cv2.error:
        return None
    return image if image is not None and image.size else None


def _fault(raw: bytes) -> str:
    """Return what is wrong with bytes that OpenCV cannot read as an image."""
    if not raw:
        return "the file is empty"
    header = RAW_PGM.match(raw)
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
    write_bytes(path, encoded_image(path, image))


def encoded_image(path: Path, image: NDArray[np.uint8]) -> bytes:
    """Return the bytes of :func:`write_image`'s file."""
    import cv2

    stored = image if image.ndim == 2 else image[..., ::-1]
    try:
        ok, raw = cv2.imencode(path.suffix, np.ascontiguousarray(stored))
    except cv2.error:
        ok, raw = False, np.empty(0, dtype=np.uint8)
    if not ok:
        raise InputError(f"{path}: images cannot be written as {path.suffix!r}")
    return raw.tobytes()
