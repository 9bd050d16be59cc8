"""A mapper on disk: written whole or not at all, verified when read, and resumed to the byte."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.mapper import Mapper
from mrslam.spatial import InputError
from mrslam.spatial.files.state_file import MISFIT, pack, read_state, write_state

KIND = "mrslam-mapper"
"""First word of the file."""
VERSION = 3
"""Of the file's content besides the mapper's state, which has a layout of its own; raised when it changes."""


def save_checkpoint(mapper: Mapper, path: Path | str) -> None:
    """Write the mapper's whole state; what was at ``path`` stays until the new file is complete."""
    state = {"config": asdict(mapper.config), "seed": mapper.seed, "mapper": mapper.state()}
    write_state(Path(path), KIND, VERSION, pack(state))


def load_checkpoint(path: Path | str) -> Mapper:
    """Return the mapper that was saved; raise ``InputError`` where the file is none, of another version, or damaged."""
    state = read_state(Path(path), KIND, VERSION)
    try:
        mapper = Mapper(MapperConfig(**state["config"]), int(state["seed"]))
        mapper.restore(state["mapper"])
    except MISFIT as error:
        raise InputError(f"{path}: the checkpoint does not fit this program ({error})") from error
    return mapper
