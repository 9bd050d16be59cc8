"""Ctrl-C is noted once, and breaks off at once when it is pressed again."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from mrslam.sim_driver.cli.signals import interrupts_noted, signals_heard


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Leave the process's handlers as they were."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def test_the_first_is_noted_and_the_second_breaks_off() -> None:
    before = signal.getsignal(signal.SIGINT)
    with interrupts_noted() as is_pressed:
        assert not is_pressed()
        signal.raise_signal(signal.SIGINT)
        assert is_pressed()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_signals_are_listed_as_they_come_and_do_nothing_else() -> None:
    heard = signals_heard(signal.SIGINT, signal.SIGTERM)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGTERM):
        signal.raise_signal(number)
    assert heard == [signal.SIGTERM, signal.SIGINT, signal.SIGTERM]


def test_the_first_says_what_comes(capfd: pytest.CaptureFixture[str]) -> None:
    with interrupts_noted():
        signal.raise_signal(signal.SIGINT)
    assert "stopping with what there is; Ctrl-C again breaks off" in capfd.readouterr().err


@pytest.mark.parametrize(("reason", "words"), [("KeyboardInterrupt", "mrslam: stopped\n"), ("typer.Exit(130)", "")])
def test_a_command_that_is_broken_off_says_so(reason: str, words: str) -> None:
    code = (
        "import typer; from mrslam.sim_driver.cli import app, main\n"
        f"@app.command('now')\ndef now() -> None: raise {reason}\n"
        "main()"
    )
    ended = subprocess.run([sys.executable, "-c", code, "now"], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (130, words)


def test_a_command_that_is_broken_off_before_it_began_says_so() -> None:
    code = (
        "import sys\n"
        "class Slow:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'numpy': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Slow())\n"
        "from mrslam.sim_driver.cli import main; main()"
    )
    ended = subprocess.run([sys.executable, "-c", code, "config"], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (130, "mrslam: stopped\n")
