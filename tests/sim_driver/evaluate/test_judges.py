"""Which source judges a pair, and what counts as a wrong merge."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.alignment import Alignment, Evidence
from mrslam.sim_driver.evaluate import judges
from mrslam.sim_driver.evaluate.judges import Judgement, PairJudge, References, map_judge, pair_judge, relations_of
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial import InputError, OccupancyGrid, se2

STAMPS = np.arange(50) * 100_000_000
WAY = np.stack([np.linspace(0.0, 10.0, 50), np.linspace(0.0, 3.0, 50) ** 2, np.linspace(0.0, 1.0, 50)], axis=1)
"""Way of r1 in its own map, where the reference trajectory has it, too."""
T_A_B = se2.transform(2.0, -1.0, 0.5)


def relations() -> Any:
    """Return exact relations between r1's first poses and r2's last, whose ways follow each other in one log."""
    later = se2.compose(T_A_B, WAY)
    return STAMPS[:20] // 1000, STAMPS[30:] // 1000 + 10**7, se2.between(WAY[:20], later[30:])


def run(logs: tuple[str | None, str | None] = (None, None), **changed: Any) -> Any:
    ways = {"r1": (STAMPS, WAY), "r2": (STAMPS + 10**10, WAY)}
    robots = [SimpleNamespace(id=name, log=log) for name, log in zip(ways, logs, strict=True)]
    truth = SimpleNamespace(relations=None)
    made = {
        "mission": SimpleNamespace(robots=robots, truth=truth, world=None), "robots": {name: {} for name in ways},
        "trajectory": ways.__getitem__, "T_world_map": {}, "T_world_way": {}, "map": lambda robot: None,
    }  # fmt: skip
    return SimpleNamespace(**{**made, **changed})


@pytest.mark.parametrize(
    ("off_m", "off_deg", "is_false"), [(0.1, 1.0, False), (0.6, 0.0, True), (0.0, 6.0, True), (0.45, 4.5, False)]
)
def test_a_merge_is_false_half_a_metre_or_five_degrees_off(off_m: float, off_deg: float, is_false: bool) -> None:
    assert Judgement(off_m, off_deg, "truth").is_false is is_false


@pytest.mark.parametrize(("off_m", "off_deg"), [(0.6, 0.0), (0.0, 6.0)])
def test_a_merge_of_maps_whose_first_stretch_is_bent_is_judged_by_their_whole_ways(
    off_m: float, off_deg: float
) -> None:
    assert not Judgement(0.6, 6.0, "truth", alignment_m=0.1, alignment_deg=0.1).is_false
    assert Judgement(0.1, 0.1, "truth", alignment_m=off_m, alignment_deg=off_deg).is_false


def test_truth_is_preferred_to_a_reference_and_that_to_a_true_map() -> None:
    off = {"r1": np.zeros(3), "r2": se2.compose(T_A_B, se2.transform(1.0, 0.0, 0.0))}
    true = {"r1": np.zeros(3), "r2": T_A_B}
    both = (true, "simulated truth"), (off, "reference trajectories"), (off, "alignment with the true map")
    found = PairJudge(run(), None, both).judge("r1", "r2", T_A_B)
    assert isinstance(found, Judgement)
    assert (found.judged_by, found.error_m, found.alignment_m) == ("simulated truth", pytest.approx(0.0), None)
    assert [words for _, words in pair_judge(run(), References()).places] == [words for _, words in both]


def test_the_alignments_own_error_is_that_by_the_robots_whole_ways() -> None:
    bent = {"r1": np.zeros(3), "r2": se2.compose(T_A_B, se2.transform(0.3, 0.0, 0.0))}
    true = {"r1": np.zeros(3), "r2": T_A_B}
    simulated = run(T_world_map=true, T_world_way=bent)
    found = pair_judge(simulated, References()).judge("r1", "r2", bent["r2"])
    assert isinstance(found, Judgement)
    assert (found.error_m, found.alignment_m) == (pytest.approx(0.3), pytest.approx(0.0))


def test_the_alignments_own_error_is_that_in_the_middle_of_what_the_maps_share() -> None:
    places = {"r1": np.zeros(3), "r2": np.zeros(3)}
    maps = {name: OccupancyGrid(np.zeros((10, 10), dtype=np.int8), 0.1, (50.0, 0.0)) for name in places}
    simulated = run(T_world_map=places, T_world_way=places, map=maps.get)
    found = pair_judge(simulated, References()).judge("r1", "r2", se2.transform(0.0, -0.505, 0.01))
    assert isinstance(found, Judgement) and not found.is_false
    assert found.error_m == pytest.approx(0.505) and found.alignment_m == pytest.approx(0.0, abs=0.01)


def test_one_reference_may_hold_for_all_robots() -> None:
    T_reference_b = se2.compose(T_A_B, WAY)
    together = np.concatenate([STAMPS, STAMPS + 10**10]), np.concatenate([WAY, T_reference_b])
    found = pair_judge(run(), References(trajectories={"": together})).judge("r1", "r2", T_A_B)
    assert isinstance(found, Judgement)
    assert (found.judged_by, found.error_m) == ("reference trajectories", pytest.approx(0.0, abs=1e-6))


@pytest.mark.parametrize(("logs", "is_judged"), [(("a", "a"), True), (("a", "b"), False), ((None, None), False)])
def test_relations_judge_robots_of_one_log(logs: tuple[str | None, str | None], is_judged: bool) -> None:
    judge = PairJudge(run(logs), relations(), [({}, "simulated truth"), ({}, "the true map")])
    found = judge.judge("r1", "r2", se2.compose(T_A_B, se2.transform(0.2, 0.0, 0.0)))
    if not is_judged:
        assert found == "no truth, reference, relation or true map links the two"
        return
    assert isinstance(found, Judgement)
    assert (found.judged_by, found.error_m) == ("20 of 20 relations", pytest.approx(0.2))


def test_relations_that_a_mission_names_and_are_gone_are_noted_and_those_asked_for_are_an_error(tmp_path: Path) -> None:
    tables = {"robots": [{"id": "r1", "log": "a.log"}], "truth": {"relations": "gone.relations"}}
    moved = RunResults(tmp_path, make_mission(tables, tmp_path / "one.toml"), {}, {})
    assert relations_of(moved, References()) is None and relations_of(moved, References()) is None
    assert len(moved.damage) == 1 and moved.damage[0].startswith("gone.relations: not found in")
    with pytest.raises(InputError, match="not a relations file"):
        relations_of(moved, References(relations=tmp_path / "none"))


def test_each_map_is_aligned_with_the_true_map_once(monkeypatch: pytest.MonkeyPatch) -> None:
    aligned: list[str] = []
    placed = Alignment(T_A_B, 0.9, Evidence(), np.eye(3), "auto")
    monkeypatch.setattr(judges, "align", lambda true_map, grid: aligned.append(grid) or placed)
    references = References(true_map=OccupancyGrid(np.zeros((3, 3), dtype=np.int8), 0.05))
    judge = pair_judge(run(map=lambda robot: robot), references)
    against = map_judge(judge, references)
    assert against is not None and against[1] == {"r1": placed.T_a_b, "r2": placed.T_a_b}
    assert judge.judge("r1", "r2", T_A_B) != "no truth, reference, relation or true map links the two"
    assert aligned == ["r1", "r2"]
