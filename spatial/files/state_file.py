r"""A program's state on disk: written whole or not at all, verified when read.

File: ``<kind> <version> <sha256 of the rest>\n``, then a JSON header in one line, then the arrays one after the other.
The header holds everything that is no array, and for each array its dtype, shape and place.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.spatial.errors import InputError
from mrslam.spatial.files.atomic import write_bytes

DTYPES = ("float64", "float32", "int64", "int32", "uint32", "uint16", "int8", "bool")
MISFIT = (TypeError, ValueError, AttributeError, LookupError, ArithmeticError, RecursionError)
"""Errors raised while a state is restored that another program, or another version of this one, packed."""


@dataclass(frozen=True)
class Packed:
    """A copy of a state, taken at one moment; the original may change while the copy is written."""

    header: bytes
    blobs: tuple[bytes | memoryview, ...]


def pack(state: Any) -> Packed:
    """Copy a state made of numbers, text, None, arrays, and lists and dicts of them (dict keys: text).

    Arrays that own what they hold and are read-only are not copied, for nobody can change them.
    """
    blobs = _Blobs()
    header = json.dumps(_packed(state, blobs), separators=(",", ":"), allow_nan=True).encode()
    return Packed(header, tuple(blobs.parts))


def write_state(path: Path, kind: str, version: int, packed: Packed) -> None:
    """Write a packed state; what was at ``path`` stays until the new file is complete."""
    digest = hashlib.sha256(packed.header + b"\n")
    for blob in packed.blobs:
        digest.update(blob)
    head = f"{kind} {version} {digest.hexdigest()}\n".encode()
    write_bytes(path, head, packed.header, b"\n", *packed.blobs)


def read_state(path: Path, kind: str, version: int) -> Any:
    """Return what was packed; raise ``InputError`` where the file is none, of another version, or damaged."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    head, _, body = raw.partition(b"\n")
    parts = head.split(b" ")
    if len(parts) != 3 or parts[0] != kind.encode():
        raise InputError(f"{path}: not a {kind} file")
    if parts[1] != str(version).encode():
        raise InputError(
            f"{path}: checkpoint version {parts[1].decode(errors='replace')}, this program reads {version}"
        )
    if hashlib.sha256(body).hexdigest().encode() != parts[2]:
        raise InputError(f"{path}: the checkpoint is cut off or damaged (its hash does not match)")
    header, _, blob = body.partition(b"\n")
    try:
        return _unpacked(json.loads(header), memoryview(blob))
    except MISFIT as error:
        raise InputError(f"{path}: the checkpoint does not fit this program ({error})") from error


class _Blobs:
    """Arrays laid end to end."""

    def __init__(self) -> None:
        self.parts: list[bytes | memoryview] = []
        self.end = 0

    def add(self, array: np.ndarray[Any, Any]) -> int:
        start = self.end
        is_fixed = array.base is None and not array.flags.writeable and array.flags.c_contiguous and array.size > 0
        self.parts.append(array.data.cast("B") if is_fixed else np.ascontiguousarray(array).tobytes())
        self.end += array.nbytes
        return start


def _packed(value: Any, blobs: _Blobs) -> Any:
    if isinstance(value, np.ndarray):
        return {"array": [str(value.dtype), list(value.shape), blobs.add(value)]}
    if isinstance(value, dict):
        return {"dict": {key: _packed(item, blobs) for key, item in value.items()}}
    if isinstance(value, (list, tuple)):
        return [_packed(item, blobs) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def _unpacked(value: Any, blob: memoryview) -> Any:
    if isinstance(value, list):
        return [_unpacked(item, blob) for item in value]
    match value:
        case {"dict": dict() as items}:
            return {key: _unpacked(item, blob) for key, item in items.items()}
        case {"array": [str() as dtype, list() as shape, int() as start]} if dtype in DTYPES:
            count = int(np.prod(shape, dtype=np.int64))
            return np.frombuffer(blob, dtype=dtype, count=count, offset=start).reshape(shape).copy()
        case dict():
            raise ValueError(f"neither a table nor an array: {list(value)[:3]}")
        case _:
            return value
