"""What an earlier run left in the folder of a new one: it goes once that has begun, and nothing else does."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import (
    CHECKPOINT,
    OF_ROBOT,
    OF_RUN,
    TEAM_FOLDER,
    TWIN,
    team_file,
)
from mrslam.sim_driver.missions.run_folder import read_config, robots_of
from mrslam.spatial import InputError

ASIDE = ".earlier"
"""Folder in a run's own in which an earlier run waits until the new one has begun."""


@contextmanager
def earlier_set_aside(mission: Mission, out: Path) -> Iterator[str | None]:
    """Set aside what an earlier run left in ``out`` and yield its name, None where there was none.

    It comes back where the new run raises ``InputError`` in here, for then it could not begin; else it goes: what fails
    once the new run is over must not cost its files. Raises as :func:`clear_earlier` does.
    """
    aside = out / ASIDE
    shutil.rmtree(aside, ignore_errors=True)  # of a process that was killed
    name = clear_earlier(mission, out, aside)
    try:
        yield name
    except InputError as error:
        if name is None:
            raise
        clear_earlier(mission, out)  # what the new run has written by now
        for path in [path for path in aside.rglob("*") if path.is_symlink() or not path.is_dir()]:
            _move(path, out / path.relative_to(aside))
        raise InputError(f"{error}; the earlier run in {out} is as it was") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def clear_earlier(mission: Mission, out: Path, aside: Path | None = None) -> str | None:
    """Remove what an earlier run left in ``out`` and return its name, None where there was none.

    Only files that a run writes go, to the folder ``aside`` where one is told. Raises ``InputError``, and removes
    nothing, where the new run would read one of them, or where a robot's checkpoint is there that belongs to no run.
    """
    replay = mission.replay
    if replay is not None and replay.resolve() == out.resolve():
        raise InputError(f"{out}: the drive that is played again is kept there; name another folder with --out")
    robots = robots_of(out)
    if robots is None:
        _refuse_agents(mission, out)
        return None
    left = _left_by(out, robots)
    _refuse_inputs(mission, left)
    config = read_config(out)
    for path in left:
        if aside is None:
            path.unlink(missing_ok=True)
        else:
            _move(path, aside / path.relative_to(out))
    for robot_id in robots:
        for folder in (out / robot_id / TWIN, out / robot_id / TEAM_FOLDER, out / robot_id):
            with suppress(OSError):  # somebody put something of their own there
                folder.rmdir()
    section = config.get("mission")
    return str(section.get("name") or "a mission") if isinstance(section, dict) else "a mission"


def _move(path: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    path.replace(target)


def _left_by(out: Path, robots: Sequence[str]) -> list[Path]:
    """Return the files of a run that are there; last ``config.json``, so that what breaks off is resumed."""
    folders = [folder for robot_id in robots for folder in (out / robot_id, out / robot_id / TWIN)]
    named = [*(folder / name for folder in folders for name in OF_ROBOT), *(out / name for name in OF_RUN)]
    named += [folder / team_file(robot_id) for folder in folders for robot_id in robots]
    return [path for path in named if path.is_file() or path.is_symlink()]


def _refuse_inputs(mission: Mission, left: Sequence[Path]) -> None:
    """Raise where the mission reads a file that would be removed."""
    world = () if mission.world is None else (mission.world.name,)
    files = {path.resolve(): path for path in left}
    for name in (*mission.files, *world):
        with suppress(InputError):  # a built-in world is no file
            path = mission.find(name)
            read = [file for file in files if file == path.resolve() or path.resolve() in file.parents]
            if not read:
                continue
            text = f"{files[read[0]]}: the mission reads this file of an earlier run, which the new one would replace"
            break
    else:
        return
    raise InputError(f"{text}; name another folder with --out")


def _refuse_agents(mission: Mission, out: Path) -> None:
    """Raise where a robot's checkpoint lies that no run left: it is all that an agent knows."""
    for robot in mission.robots:
        if (out / robot.id / CHECKPOINT).exists():
            raise InputError(
                f"{out / robot.id}: holds the checkpoint of an agent (mrslam agent); name another folder with --out, "
                "or remove it"
            )
