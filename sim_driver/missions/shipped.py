"""The missions that come with the package: found by name, wherever the command is called from."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file, is_folder

FOLDER = Path(__file__).parent / "shipped_missions"
"""A link to the checkout's ``missions``; a folder of its own in a wheel."""


def shipped_missions() -> list[str]:
    """Return the names of all missions that ship, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def find_mission(path: Path) -> Path:
    """Return the mission file called so: the file as given, else the one that ships under this name.

    ``office``, ``office.toml`` and ``missions/office.toml`` all mean the shipped one where there is no such file.
    Raises ``InputError`` that names the shipped ones.
    """
    if is_file(path):
        return path
    names = shipped_missions()
    if is_folder(path):
        raise InputError(f"{path}: is a folder; name the mission file (.toml) itself")
    if path.suffix in ("", ".toml") and path.stem in names and path.parent in (Path(), Path("missions")):
        return FOLDER / f"{path.stem}.toml"
    near = [] if path.stem in names else get_close_matches(path.stem, names, 1)
    meant = f"did you mean {near[0]}? " if near else ""
    raise InputError(f"{path}: no such mission file; {meant}those that ship are {', '.join(names)}")
