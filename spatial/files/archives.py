"""Archives of arrays (``.npz``) that other programs may have written, and that may be damaged."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import InputError, first_line


def read_arrays(path: Path, *names: str, raw: bytes | None = None) -> dict[str, NDArray[Any]]:
    """Return the arrays of these names, or all of them where no name is given.

    ``raw`` : the archive's bytes where they are within another file; ``path`` is then only named in errors. Raises
    ``InputError`` where the file cannot be read, is no archive, or lacks one of them.
    """
    try:
        with (
            io.BytesIO(raw) if raw is not None else path.open("rb") as file,
            np.load(file, allow_pickle=False) as archive,
        ):
            arrays = {name: archive[name] for name in names or archive.files}
    except KeyError as error:
        raise InputError(f"{path}: needs arrays {', '.join(names)} ({first_line(error)})") from error
    except Exception as error:  # what numpy, zipfile and zlib raise on damaged archives is anything
        raise InputError(f"{path}: not a readable .npz ({first_line(error)})") from error
    for name, array in arrays.items():
        if not isinstance(array, np.ndarray):
            raise InputError(f"{path}: {name} is no array")
    return arrays


def arrays_in(path: Path) -> list[str]:
    """Return the names of the arrays; raise ``InputError`` where the file is no archive."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return list(archive.files)
    except Exception as error:
        raise InputError(f"{path}: not a readable .npz ({first_line(error)})") from error
