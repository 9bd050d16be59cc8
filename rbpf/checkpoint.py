r"""A mapper on disk: written whole or not at all, verified when read, and resumed to the byte.

File: ``mrslam-mapper <version> <sha256 of the rest>\n``, then a JSON header in one line, then the arrays one after the
other. The header holds everything that is no array, and for each array its dtype, shape and place.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rbpf.config import MapperConfig
from rbpf.mapper import Mapper
from spatial import InputError
from spatial.files import write_bytes

MAGIC = b"mrslam-mapper"
VERSION = 1
DTYPES = ("float64", "float32", "int64", "int32", "uint32", "int8")


def save_checkpoint(mapper: Mapper, path: Path | str) -> None:
    """Write the mapper's whole state; what was at ``path`` stays until the new file is complete."""
    blobs = _Blobs()
    state = {"config": asdict(mapper.config), "seed": mapper.seed, "mapper": mapper.state()}
    header = json.dumps(_pack(state, blobs), separators=(",", ":"), allow_nan=True).encode()
    body = header + b"\n" + b"".join(blobs.parts)
    head = b" ".join([MAGIC, str(VERSION).encode(), hashlib.sha256(body).hexdigest().encode()])
    write_bytes(Path(path), head + b"\n" + body)


def load_checkpoint(path: Path | str) -> Mapper:
    """Return the mapper that was saved; raise ``InputError`` where the file is none, of another version, or damaged."""
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    head, _, body = raw.partition(b"\n")
    parts = head.split(b" ")
    if len(parts) != 3 or parts[0] != MAGIC:
        raise InputError(f"{path}: not a mapper checkpoint")
    if parts[1] != str(VERSION).encode():
        raise InputError(
            f"{path}: checkpoint version {parts[1].decode(errors='replace')}, this program reads {VERSION}"
        )
    if hashlib.sha256(body).hexdigest().encode() != parts[2]:
        raise InputError(f"{path}: the checkpoint is cut off or damaged (its hash does not match)")
    header, _, blob = body.partition(b"\n")
    try:
        state = _unpack(json.loads(header), memoryview(blob))
        mapper = Mapper(MapperConfig(**state["config"]), int(state["seed"]))
        mapper.restore(state["mapper"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: the checkpoint does not fit this program ({error})") from error
    return mapper


class _Blobs:
    """Arrays laid end to end."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.end = 0

    def add(self, array: np.ndarray[Any, Any]) -> int:
        start = self.end
        self.parts.append(np.ascontiguousarray(array).tobytes())
        self.end += len(self.parts[-1])
        return start


def _pack(value: Any, blobs: _Blobs) -> Any:
    if isinstance(value, np.ndarray):
        return {"array": [str(value.dtype), list(value.shape), blobs.add(value)]}
    if isinstance(value, dict):
        return {"dict": {key: _pack(item, blobs) for key, item in value.items()}}
    if isinstance(value, (list, tuple)):
        return [_pack(item, blobs) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def _unpack(value: Any, blob: memoryview) -> Any:
    if isinstance(value, list):
        return [_unpack(item, blob) for item in value]
    if not isinstance(value, dict):
        return value
    if "dict" in value:
        return {key: _unpack(item, blob) for key, item in value["dict"].items()}
    dtype, shape, start = value["array"]
    if dtype not in DTYPES:
        raise ValueError(f"array of {dtype}")
    count = int(np.prod(shape, dtype=np.int64))
    return np.frombuffer(blob, dtype=dtype, count=count, offset=start).reshape(shape).copy()
