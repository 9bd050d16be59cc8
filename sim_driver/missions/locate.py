"""Where recorded data is found: as given, beside the mission, or in the data folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from glob import escape
from pathlib import Path

from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file, is_folder

DATA_VARIABLE = "MRSLAM_DATA"
DEEPEST = 4
"""So many folders below the data folder a file is still looked for, to ask whether that one was meant."""


def locate(name: str, beside: Path | None = None) -> Path:
    """Return the file called ``name``: absolute or from here, from ``beside``, or from the data folder.

    The data folder is ``$MRSLAM_DATA``, else a folder ``shared/data`` next to the checkout. Raises ``InputError`` that
    lists where it was looked for, and what may have been meant.
    """
    folders = [*_near(beside), *_data_folders(beside)]
    for folder in folders:
        path = folder / name
        if is_file(path) or is_folder(path):
            return path.resolve()
    if Path(name).is_absolute():
        raise InputError(f"{name}: no such file")
    raise InputError(f"{name}: not found in {', '.join(dict.fromkeys(map(_words, folders)))}{_advice(name, beside)}")


def _advice(name: str, beside: Path | None) -> str:
    """Return what to do about a name that was not found, as the end of a sentence."""
    for folder in _data_folders(beside):
        meant = _of_that_name(folder, Path(name).name)
        if meant:
            return f"; did you mean {' or '.join(meant)}?"
    if DATA_VARIABLE not in os.environ:
        return f"; set {DATA_VARIABLE} to the folder that holds it"
    return ""


def _of_that_name(folder: Path, file_name: str) -> list[str]:
    """Return files of exactly this name below the folder, named from there."""
    found: list[str] = []
    if file_name:
        for depth in range(1, DEEPEST + 1):
            with suppress(OSError, ValueError):  # a name that no file can have, or a folder closed to us
                paths = sorted(folder.glob("*/" * depth + escape(file_name)))
                found += [path.relative_to(folder).as_posix() for path in paths if is_file(path)]
    return found


def _near(beside: Path | None) -> Iterator[Path]:
    yield Path()
    if beside is not None:
        yield beside


def _data_folders(beside: Path | None) -> Iterator[Path]:
    if DATA_VARIABLE in os.environ:
        yield Path(os.environ[DATA_VARIABLE])
    else:
        yield Path("../shared/data")
        if beside is not None:
            yield beside.parent / "../shared/data"


def _words(folder: Path) -> str:
    """Return what a folder is called in messages."""
    if str(folder) == os.environ.get(DATA_VARIABLE):
        return f"{folder} ({DATA_VARIABLE})" if is_folder(folder) else f"{folder} ({DATA_VARIABLE}, which is no folder)"
    return "this folder" if folder == Path() else str(folder)
