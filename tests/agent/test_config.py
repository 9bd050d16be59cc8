"""Starts that a team knows."""

from __future__ import annotations

import pytest

from mrslam.agent import AgentConfig
from mrslam.agent.config import REVISIONS_LOST, UNSAVED_MOST_S
from mrslam.spatial import InputError


@pytest.mark.parametrize("start", [[1.0, 2.0], [1.0, 2.0, 0.5]])
def test_a_start_is_a_place_with_or_without_a_heading(start: list[float]) -> None:
    assert AgentConfig(starts={"r1": start}).starts == {"r1": start}


def test_states_are_saved_before_more_revisions_are_published_than_a_resumed_map_skips() -> None:
    assert REVISIONS_LOST / UNSAVED_MOST_S >= 50.0  # scans a second
    assert AgentConfig(checkpoint_interval_s=UNSAVED_MOST_S).checkpoint_interval_s == UNSAVED_MOST_S
    with pytest.raises(InputError, match=r"agent\.checkpoint_interval_s must be in 0\.01\.\.2000 s, got 3600"):
        AgentConfig(checkpoint_interval_s=3600.0)


@pytest.mark.parametrize("start", [[], [1.0], [1.0, 2.0, 0.5, 0.0], [1e9, 0.0]])
def test_what_is_no_place_is_refused_by_name(start: list[float]) -> None:
    with pytest.raises(InputError, match=r"agent\.starts\.r1 must be \[x_m, y_m, theta_rad\] or \[x_m, y_m\]"):
        AgentConfig(starts={"r1": start})
