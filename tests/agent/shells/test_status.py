"""How a robot says in words how maps fit together."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mrslam.agent.shells.status import _words


@pytest.mark.parametrize(
    ("confidence", "status", "words"),
    [
        (0.876, "accepted", "merged, confidence 0.88"),
        (None, "untried", "too small yet"),
        (None, "rejected", "not merged: they do not fit"),
    ],
)
def test_a_pair_in_words(confidence: float | None, status: str, words: str) -> None:
    alignment = None if confidence is None else SimpleNamespace(confidence=confidence)
    belief = SimpleNamespace(alignment=alignment, status=status, reason="too small yet", words="they do not fit")
    assert _words(belief) == words  # type: ignore[arg-type]
