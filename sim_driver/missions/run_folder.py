"""A run's folder: its ``config.json`` says whose it is and which robots took part."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file

CONFIG_FILE = "config.json"
"""The resolved mission; written first, so that a run that was broken off has it, too."""
METRICS_FILE = "metrics.json"


def read_config(run: Path) -> dict[str, Any]:
    """Return a run's ``config.json``; raise ``InputError`` where the folder is no run's."""
    path = run / CONFIG_FILE
    try:
        config: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        if not run.exists():
            raise InputError(f"{run}: no such folder; name the one that a run left (its --out)") from error
        raise InputError(f"{run}: not a run's folder ({path.name} is missing)") from error
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON ({error})") from error
    return config


def robots_of(run: Path) -> list[str] | None:
    """Return the robots that the run's ``config.json`` names, in its order; None where the folder is no run's."""
    if not is_file(run / CONFIG_FILE):
        return None
    try:
        config = read_config(run)
        return [RobotConfig(id=robot["id"]).id for robot in config["robots"]]
    except (InputError, TypeError, KeyError):
        return None
