"""In a saved map of a part of a building a place is not believed, however well it fits, unless somebody told it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.agent.known_map import MOST_LOOK_ALIKES, KnownMap
from mrslam.agent.pairs import part_saved
from mrslam.agent.pairs.part_saved import in_whole
from mrslam.agent.shells import runner
from mrslam.alignment import AlignmentConfig, Rejection
from mrslam.spatial import LocalMap, OccupancyGrid, TiledMap
from tests.agent.duo import robot
from tests.agent.pairs.floors import Floors, found

MONDAY = "office@monday"
CONFIG = AlignmentConfig()


def room(open_cells: int) -> KnownMap:
    """Return a room of 4 m, of one wall of which so many cells are missing, with nothing known behind."""
    cells = np.full((88, 88), -1, dtype=np.int8)
    cells[4:84, 4:84] = 100
    cells[5:83, 5:83] = 0
    cells[10 : 10 + open_cells, 83] = -1
    return KnownMap((1, 1), LocalMap(TiledMap.from_grid(OccupancyGrid(cells, 0.05), 1)))


def searched(saved: KnownMap, near: list[float] | None = None) -> Any:
    """Return the first job of a robot that was given a saved map."""
    team = Floors("r2")
    team.take_saved_map(MONDAY, saved, near)
    return team.job(0.0)


@pytest.mark.parametrize(("open_cells", "is_refused"), [(0, False), (16, False), (60, True)])
def test_a_place_in_a_map_that_ends_in_the_open_is_ambiguous(open_cells: int, is_refused: bool) -> None:
    place = found()
    saved = room(open_cells)
    outcome = in_whole(searched(saved), place, CONFIG)
    assert (saved.look_alikes >= MOST_LOOK_ALIKES) == is_refused
    if not is_refused:
        assert outcome is place
        return
    assert isinstance(outcome, Rejection)
    assert outcome.reason.startswith("ambiguous: the saved map shows 16 m2 and ends in the open")
    assert outcome.T_a_b is place.T_a_b and outcome.evidence is place.evidence


def test_a_place_that_somebody_told_is_believed_there_too() -> None:
    job = searched(room(60), [0.0, 0.0])
    assert job.prior is not None and job.searched is None and in_whole(job, place := found(), CONFIG) is place


def test_what_is_refused_for_another_reason_keeps_it_and_the_map_is_not_looked_at() -> None:
    job = searched(saved := room(60))
    nowhere = Rejection("too little wall in common", 0.1, None, "auto")
    assert in_whole(job, nowhere, CONFIG) is nowhere and "look_alikes" not in vars(saved)


def test_only_where_a_place_in_a_saved_map_is_sought_is_it_asked_what_that_shows() -> None:
    team = Floors("r1", "r2")
    assert team.job(0.0).searched is None  # a teammate's map grows
    team = Floors("r2")
    team.take_saved_map(MONDAY, room(0))
    for k in range(2):
        job = team.job(20.0 * k)
        assert k or (job.searched is team.maps[MONDAY] and not job.is_believed)
        team.end(job, found(wall_m=50.0), 20.0 * k)
    assert team.beliefs[job.a, job.b].alignment is not None
    team.grow("r2", 150, 3)
    job = team.job(60.0)
    assert job.searched is team.maps[MONDAY] and job.is_believed
    assert in_whole(replace(job, searched=room(60)), place := found(), CONFIG) is place  # it is there already


def test_whoever_aligns_asks_it(monkeypatch: pytest.MonkeyPatch) -> None:
    job, place = searched(room(60)), found()
    monkeypatch.setattr(runner, "align", lambda *args, **kwargs: place)
    shell = SimpleNamespace(agent=robot("r1", 1), _matcher=None)
    assert isinstance(runner.Runner._align(shell, job), Rejection)  # type: ignore[arg-type]
    assert runner.Runner._align(shell, replace(job, searched=None)) is place  # type: ignore[arg-type]
    bendable = Rejection("walls lie where the other map is free", 0.1, None, "auto", place.T_a_b, may_bend=True)
    monkeypatch.setattr(runner, "align", lambda *args, **kwargs: bendable)
    monkeypatch.setattr(runner, "align_bent", lambda *args, **kwargs: place)
    assert isinstance(runner.Runner._align(shell, job), Rejection)  # type: ignore[arg-type]


@pytest.mark.parametrize(("open_cells", "is_told"), [(0, True), (20, False)])
def test_places_that_fit_alike_are_told_apart_only_where_all_was_saved(
    open_cells: int, is_told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, place = searched(saved := room(open_cells)), found()
    monkeypatch.setattr(part_saved, "told_apart", lambda *_: place)
    outcome = Rejection("ambiguous", 0.2, None, "auto", np.zeros(3), rivals=(np.ones(3),))
    assert saved.is_whole is is_told
    assert in_whole(job, outcome, CONFIG) is (place if is_told else outcome)
    assert in_whole(replace(job, searched=None), outcome, CONFIG) is outcome
    assert in_whole(job, replace(outcome, rivals=()), CONFIG).reason == "ambiguous"
    monkeypatch.setattr(part_saved, "told_apart", lambda *_: None)
    assert in_whole(job, outcome, CONFIG) is outcome
