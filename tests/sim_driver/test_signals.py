"""Ctrl-C is noted once, and breaks off at once when it is pressed again."""

from __future__ import annotations

import signal
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
