"""What ``mrslam top`` draws of a team."""

from __future__ import annotations

import time
from typing import Any

import pytest
from rich.console import Console

from mrslam.comms import WARN_DAYS
from mrslam.sim_driver.cli.live.top_tables import STALE_S, render

DAY_S = 86_400.0


def status(**more: Any) -> dict[str, Any]:
    link = {
        "peer": "r2", "quality": 0.91, "lq": 0.42, "state": "good", "activity": "idle", "bytes_sent": 1_500,
        "bytes_received": 2_400_000, "bytes_saved": -3_000_000,
    }  # fmt: skip
    return {
        "mode": "distributed", "up_s": 61.0, "age_s": 0.4, "maps": {"r1": {"revision": 7}}, "beacon_bytes": 4_000,
        "exchange_bytes": 5_600_000, "links": [link], "alignments": [{"a": "r1", "b": "r2", "words": "merged"}],
        "certificate_ends_s": None, **more,
    }  # fmt: skip


def row(said: dict[str, Any] | None, *, here: bool = True) -> dict[str, Any]:
    return {"team": "demo", "robot": "r1", "here": here, "status": said}


def drawn(*rows: dict[str, Any]) -> list[str]:
    console = Console(width=200, record=True, file=None, quiet=False)
    with console.capture() as shown:
        console.print(render(rows, "nobody is here"))
    return [" ".join(line.split()) for line in shown.get().splitlines()]


def test_a_robot_and_its_links_are_drawn_with_their_sizes() -> None:
    lines = drawn(row(status()))
    assert "demo r1 distributed 61 s r1 7 4.0 kB 5.6 MB" in lines
    assert "r1 - r2 0.91 0.42 good idle 1.5 kB 2.4 MB -3.0 MB" in lines
    assert "r1: r1 and r2 merged" in lines and not any("certificate" in line for line in lines)
    assert drawn() == ["nobody is here"]


@pytest.mark.parametrize(("age_s", "is_marked"), [(STALE_S - 1.0, False), (STALE_S + 2.0, True)])
def test_a_robot_that_says_nothing_any_more_is_marked(age_s: float, is_marked: bool) -> None:
    assert any("61 s (silent for 7 s)" in line for line in drawn(row(status(age_s=age_s)))) is is_marked


def test_of_a_robot_that_is_gone_no_links_are_drawn() -> None:
    lines = drawn(row(status(age_s=99.0), here=False))
    assert "demo r1 distributed gone r1 7 4.0 kB 5.6 MB" in lines
    assert not any(line.startswith(("r1 - r2", "r1: ")) for line in lines)
    assert "demo r1 gone" in drawn(row(None, here=False)) and "demo r1 here, no status yet" in drawn(row(None))


@pytest.mark.parametrize(("left_days", "is_said"), [(WARN_DAYS + 1.0, False), (WARN_DAYS - 1.0, True), (-1.0, True)])
def test_a_certificate_that_ends_soon_is_said(left_days: float, is_said: bool) -> None:
    lines = drawn(row(status(certificate_ends_s=time.time() + left_days * DAY_S)))
    assert any("its certificate ends in" in line and f"{left_days:.1f} days" in line for line in lines) is is_said
