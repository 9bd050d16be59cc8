"""When the placed maps are joined again: for so many new keyframes, after so much time, for another alignment."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.agent.joining import Joining
from mrslam.merge import BentTeam, Placement
from tests.agent.duo import S

T_A_B = np.array([1.0, 0.0, 0.0])


class Keyframes(list[int]):
    """Keyframes of a way, all with scans."""

    @property
    def scans(self) -> SimpleNamespace:
        return SimpleNamespace(shown=self)


def is_due(
    joining: Joining,
    t_s: float,
    *,
    epoch: int = 1,
    T_a_b: np.ndarray | None = T_A_B,
    bent: BentTeam | None = None,
    **keyframes: int,
) -> bool:
    """Return whether maps of so many keyframes are joined at a time; that of b is of this epoch."""
    epochs = {"b": epoch}
    maps = {
        name: SimpleNamespace(epoch=epochs.get(name, 1), trail=Keyframes([0] * count))
        for name, count in keyframes.items()
    }
    placement = Placement(anchor="a", T_rigid=dict.fromkeys(keyframes, T_A_B))
    alignments = {} if T_a_b is None else {("a", "b"): T_a_b}
    job = joining.next_job(placement, bent or BentTeam(), maps, alignments, (), round(t_s * S))  # type: ignore[arg-type]
    assert job is None or {name: len(trail) for name, trail in job.trails.items()} == keyframes
    return job is not None


def begun() -> Joining:
    """Return one that has joined two maps of 200 keyframes at 0 s."""
    joining = Joining()
    assert is_due(joining, 0.0, a=200, b=200)
    return joining


@pytest.mark.parametrize(
    ("t_s", "new", "due"), [(9.0, 80, False), (11.0, 0, False), (11.0, 65, False), (11.0, 75, True), (59.0, 65, False)]
)
def test_a_share_of_new_keyframes_is_joined_after_the_least_time(t_s: float, new: int, due: bool) -> None:
    assert is_due(begun(), t_s, a=200, b=200 + new) == due


def test_a_few_keyframes_are_not_joined_though_they_are_a_large_share() -> None:
    joining = Joining()
    assert is_due(joining, 0.0, a=20, b=20)
    assert not is_due(joining, 11.0, a=27, b=20)
    assert is_due(joining, 11.0, a=28, b=20)


def test_few_new_keyframes_are_joined_at_last_and_none_never() -> None:
    joining = begun()
    assert not is_due(joining, 299.0, a=201, b=200)
    assert is_due(joining, 301.0, a=201, b=200)
    assert not is_due(joining, 900.0, a=201, b=200)


def test_the_last_few_keyframes_are_joined_once_no_more_come() -> None:
    joining = begun()
    assert not is_due(joining, 40.0, a=200, b=202)
    assert not is_due(joining, 70.0, a=200, b=204)
    assert not is_due(joining, 129.0, a=200, b=204)
    assert is_due(joining, 130.0, a=200, b=204)
    assert not is_due(joining, 600.0, a=200, b=204)


def test_a_third_map_and_one_begun_anew_are_joined_after_the_least_time() -> None:
    assert not is_due(begun(), 9.0, a=200, b=200, c=5)
    assert is_due(begun(), 11.0, a=200, b=200, c=5)
    assert is_due(begun(), 11.0, a=200, b=200, epoch=2)


def test_another_alignment_waits_for_others_that_may_follow_but_not_for_keyframes() -> None:
    assert not is_due(begun(), 3.5, a=200, b=200, T_a_b=T_A_B + 0.2)
    assert is_due(begun(), 4.5, a=200, b=200, T_a_b=T_A_B + 0.2)


def test_an_alignment_where_matches_have_the_maps_is_no_news_and_one_that_is_withdrawn_is() -> None:
    tied = BentTeam(places={("a", "b"): np.array([T_A_B + 2.0, T_A_B])})
    joining = Joining()
    assert is_due(joining, 0.0, a=200, b=200, T_a_b=None, bent=tied)
    assert not is_due(joining, 10.0, a=200, b=200, T_a_b=T_A_B + 0.09, bent=tied)
    assert is_due(joining, 10.0, a=200, b=200, T_a_b=T_A_B + 0.7, bent=tied)
    assert is_due(joining, 20.0, a=200, b=200, T_a_b=None, bent=tied)


def test_of_many_keyframes_another_alignment_waits_as_their_number_grows() -> None:
    joining = Joining()
    assert is_due(joining, 0.0, a=1000, b=1000)
    assert not is_due(joining, 15.5, a=1000, b=1000, T_a_b=T_A_B + 0.2)
    assert is_due(joining, 16.5, a=1000, b=1000, T_a_b=T_A_B + 0.2)


@pytest.mark.parametrize("off", [(0.12, 0.0, 0.0), (0.0, -0.12, 0.0), (0.0, 0.0, 0.006)])
def test_an_alignment_that_was_refined_is_joined_again_once_it_has_moved(off: tuple[float, float, float]) -> None:
    joining = begun()
    for step in range(1, 6):
        is_far = step == 5  # 0.096 m or 0.0048 rad after the fourth step
        T = T_A_B + step / 5 * np.array(off)
        assert is_due(joining, 10.0 * step, a=200, b=200, T_a_b=T) == is_far


def test_one_map_alone_is_not_joined() -> None:
    assert not is_due(Joining(), 0.0, a=200)
    assert not is_due(Joining(), 0.0, a=200, b=0)


def test_keyframes_without_scans_bring_nothing_to_join(monkeypatch: pytest.MonkeyPatch) -> None:
    joining = begun()
    monkeypatch.setattr(Keyframes, "scans", SimpleNamespace(shown=range(200)))
    assert not any(is_due(joining, t_s, a=200, b=900) for t_s in (11.0, 61.0, 301.0, 900.0))
    monkeypatch.setattr(Keyframes, "scans", SimpleNamespace(shown=range(300)))
    assert is_due(joining, 901.0, a=900, b=900)
