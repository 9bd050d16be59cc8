"""Where compiled kernels are kept on disk.

Numba does not notice when a cached kernel's callee changed in another file, and would run old code. So the cache
folder's name carries a hash of every kernel source: an edited kernel finds an empty folder and is compiled afresh.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from contextlib import suppress
from pathlib import Path

PACKAGES = ("spatial", "rbpf", "alignment", "mutual_detection", "merge", "comms", "agent", "sim_driver")
"""Packages of this distribution, lowest floor first."""


def source_hash() -> str:
    """Return a short hash of all sources of this distribution that use numba."""
    top = Path(__file__).resolve().parent
    digest = hashlib.sha256(f"{sys.version_info[:2]}".encode())
    for package in PACKAGES:
        for path in sorted((top / package).rglob("*.py")):
            source = path.read_bytes()
            if b"njit" in source:
                digest.update(str(path.relative_to(top)).encode() + b"\0" + source)
    return digest.hexdigest()[:16]


def cache_dir() -> Path:
    """Return the folder for compiled kernels, under ``$MRSLAM_CACHE``, ``$XDG_CACHE_HOME`` or ``~/.cache``."""
    root = os.environ.get("MRSLAM_CACHE")
    if root is not None:
        return Path(root) / "kernels" / source_hash()
    caches = os.environ.get("XDG_CACHE_HOME")
    return (Path(caches) if caches else Path("~/.cache").expanduser()) / "mrslam" / "kernels" / source_hash()


def use_cache_dir() -> None:
    """Point numba at :func:`cache_dir`, unless ``NUMBA_CACHE_DIR`` is set. Must run before any kernel is defined."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    folder = str(cache_dir())
    os.environ["NUMBA_CACHE_DIR"] = folder  # inherited by agent processes
    numba_config = sys.modules.get("numba.core.config")
    if numba_config is not None:
        numba_config.CACHE_DIR = folder  # type: ignore[attr-defined]


def is_warm(package: str) -> bool:
    """Return whether all kernels of this package, as the sources are now, were compiled to disk once."""
    return _mark(package).is_file()


def mark_warm(package: str) -> None:
    """Remember that all kernels of this package are on disk; in vain where the folder cannot be written to."""
    with suppress(OSError):
        _mark(package).parent.mkdir(parents=True, exist_ok=True)
        _mark(package).touch()


def _mark(package: str) -> Path:
    folder = os.environ.get("NUMBA_CACHE_DIR") or cache_dir()  # which reads every source for its hash
    return Path(folder) / f"{package}.compiled"


def forget_old(keep: int = 4) -> None:
    """Delete the caches of older sources, but for the newest ``keep``; other versions may still be in use."""
    if not cache_dir().is_dir():
        return
    folders = sorted(cache_dir().parent.iterdir(), key=lambda folder: folder.stat().st_mtime, reverse=True)
    for folder in folders[keep:]:
        if folder != cache_dir():
            shutil.rmtree(folder, ignore_errors=True)
