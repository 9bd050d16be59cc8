"""Files that are whole or not there: written beside the target, then renamed over it."""

from __future__ import annotations

import errno
import fcntl
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path

from mrslam.spatial.errors import InputError


def is_file(path: Path) -> bool:
    """Return whether the path is a file that may be looked at; False for names that no file can have."""
    return _is(path, Path.is_file)


def is_folder(path: Path) -> bool:
    """Return whether the path is a folder that may be looked at; False for names that no folder can have."""
    return _is(path, Path.is_dir)


def _is(path: Path, kind: Callable[[Path], bool]) -> bool:
    try:
        return kind(path)
    except OSError:  # the name is too long, or a folder above is closed to us
        return False


def write_bytes(path: Path, *pieces: bytes | memoryview, mode: int = 0o666) -> None:
    """Replace the file by these pieces in one step; a crash or a full disk leaves the old one as it was.

    ``mode`` : who may do what with it from its first byte on, less the process's umask.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}.part")
    try:
        part.touch(mode)
        with part.open("wb") as file:
            for piece in pieces:
                file.write(piece)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def unused(path: Path) -> Path:
    """Return the path, with -2, -3 and so on behind its stem where there is such a file already."""
    names = (f"{path.stem}-{k}{path.suffix}" for k in count(2))
    return next(one for one in chain([path], map(path.with_name, names)) if not one.exists())


def write_text(path: Path, content: str) -> None:
    """Replace the text file in one step (UTF-8)."""
    write_bytes(path, content.encode())


def make_folder(folder: Path) -> None:
    """Make the folder unless it is there; raise ``InputError`` where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder ({error.strerror})") from error


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Make the folder unless it is there, and keep other processes from holding it; however this one ends, it lets go.

    Raises ``InputError`` where another one holds it: two that write the same files leave what neither of them did.
    """
    make_folder(folder)
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EACCES):
                raise InputError(
                    f"{folder}: another process writes there; wait for it, or name another folder"
                ) from error
            if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP):  # some network drives know no locks
                raise
        yield
    finally:
        os.close(handle)
