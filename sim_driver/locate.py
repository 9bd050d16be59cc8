"""Where recorded data is found: as given, beside the mission, or in the data folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from spatial import InputError
from spatial.files import is_file, is_folder

DATA_VARIABLE = "MRSLAM_DATA"


def locate(name: str, beside: Path | None = None) -> Path:
    """Return the file called ``name``: absolute or from here, from ``beside``, or from the data folder.

    The data folder is ``$MRSLAM_DATA``, else a folder ``shared/data`` next to the checkout. Raises ``InputError`` that
    lists where it was looked for.
    """
    tried = [folder / name for folder in _folders(beside)]
    for path in tried:
        if is_file(path) or is_folder(path):
            return path.resolve()
    places = ", ".join(str(path.parent) for path in tried)
    raise InputError(f"{name}: not found in {places}; set {DATA_VARIABLE} to the folder that holds it")


def _folders(beside: Path | None) -> Iterator[Path]:
    yield Path()
    if beside is not None:
        yield beside
    if DATA_VARIABLE in os.environ:
        yield Path(os.environ[DATA_VARIABLE])
    else:
        yield Path("../shared/data")
        if beside is not None:
            yield beside.parent / "../shared/data"
