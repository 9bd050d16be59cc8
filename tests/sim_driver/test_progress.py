"""Work that takes a while says so where no bar can be shown."""

from __future__ import annotations

import runpy
from collections.abc import Callable

import pytest

from mrslam.sim_driver.cli import console as module
from mrslam.sim_driver.cli import progress
from mrslam.sim_driver.cli.console import console, say
from mrslam.sim_driver.cli.progress import Lines, mission_progress, progress_bar


class Clock:
    """Seconds, moved on by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress, "Lines", lambda say: Lines(say, clock=clock))
    return clock


def test_says_a_line_every_so_often_and_nothing_of_short_work() -> None:
    clock, said = Clock(), []
    lines = Lines(said.append, 10.0, clock)
    for _ in range(25):
        clock.now_s += 1.0
        lines.tell("half done")
    assert said == ["half done, 10 s", "half done, 20 s"]


def test_a_bar_is_lines_where_there_is_no_terminal(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("sweep", 80) as advance:
        for _ in range(3):
            clock.now_s += 6.0
            advance()
    said = capsys.readouterr()
    assert said.err == "sweep: 2 of 80, 12 s\n"
    assert said.out == ""


@pytest.mark.parametrize(("total_s", "whole"), [(240.0, " of 240"), (None, "")])
def test_a_mission_tells_its_time(
    clock: Clock, capsys: pytest.CaptureFixture[str], total_s: float | None, whole: str
) -> None:
    with mission_progress("office") as show:
        clock.now_s += 11.0
        show(30.0, total_s, "r1 12 m2")
    assert capsys.readouterr().err == f"office: 30{whole} s of mission  r1 12 m2, 11 s\n"


def test_a_terminal_gets_no_lines(
    clock: Clock, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(console, "_force_terminal", True)
    work: Callable[[], None]
    with progress_bar("sweep", 80) as work:
        clock.now_s += 60.0
        work()
    assert "1 of 80, 60 s" not in capsys.readouterr().err


def test_no_color_is_honoured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    made = runpy.run_path(module.__file__)["console"]
    assert made.color_system
    assert not made.no_color
    monkeypatch.setenv("NO_COLOR", "1")
    assert runpy.run_path(module.__file__)["console"].no_color


def test_what_is_said_is_no_markup_and_is_not_broken(capsys: pytest.CaptureFixture[str]) -> None:
    text = "no plots: pip install 'mrslam[sweep]' " + "and more " * 20 + "."
    say(text)
    assert capsys.readouterr().err == text + "\n"
