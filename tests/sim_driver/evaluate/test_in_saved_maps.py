"""Whether robots found their place in saved maps, as a run tells it."""

from __future__ import annotations

from typing import Any

import pytest

from mrslam.sim_driver.evaluate.in_saved_maps import as_words, in_saved_maps


def told(*events: tuple[float, str]) -> list[dict[str, Any]]:
    return [{"t": t, "event": kind, "map": "office@monday", "reason": f"at {t:.0f}"} for t, kind in events]


@pytest.mark.parametrize(
    ("events", "localised_s", "lost_s"),
    [
        ([(11.0, "localised")], 11.0, None),
        ([(11.0, "localised"), (12.0, "tracking"), (40.0, "lost")], 11.0, 40.0),
        ([(11.0, "localised"), (20.0, "not_localised"), (30.0, "localised")], 11.0, None),
        ([(5.0, "not_here"), (11.0, "tracking"), (70.0, "not_localised")], 11.0, 70.0),
    ],
)
def test_a_robot_is_in_a_saved_map_from_when_it_was_found_until_it_was_lost(
    events: list[tuple[float, str]], localised_s: float, lost_s: float | None
) -> None:
    (row,) = in_saved_maps({"r1": told(*events), "r2": told((3.0, "not_here"), (4.0, "lost"))})
    assert (row["robot"], row["map"], row["localised_s"], row["lost_s"]) == ("r1", "office@monday", localised_s, lost_s)
    lost = "" if lost_s is None else f", and lost there after {lost_s:.0f} s: at {lost_s:.0f}"
    assert as_words(row) == f"r1 was localised in office@monday after 11 s{lost}"
