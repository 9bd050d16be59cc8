"""Saved maps whose parts are changed as no program of ours writes them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path


def repacked(file: Path, change: dict[str, bytes | None]) -> Path:
    """Write the archive again with other parts; None leaves one out."""
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(file, "w") as archive:
        for name, part in {**parts, **change}.items():
            if part is not None:
                archive.writestr(name, part)
    return file


def manifest(file: Path, **change: object) -> dict[str, bytes | None]:
    """Return the manifest of a saved map with other values, as a change of its parts."""
    with zipfile.ZipFile(file) as archive:
        held = json.loads(archive.read("manifest.json"))
    return {"manifest.json": json.dumps({**held, **change}).encode()}
