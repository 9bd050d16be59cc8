from __future__ import annotations

import math

import pytest

from mrslam.alignment import AlignmentConfig
from mrslam.alignment.verification import reasons


def test_the_lead_bounds_the_confidence_as_the_documentation_says() -> None:
    ways = ("matched", "contradicted", "deep")
    evidence = {f"{way}_{side}_m": 1000.0 * (way == "matched") for way in ways for side in "ab"}
    evidence |= {"walls": 99.0, "crosswise_m": 500.0, "score_m": 1000.0, "margin": 1.0}
    least = min(asked.slack for asked in reasons.tests(evidence, AlignmentConfig()))
    assert 1.0 / (1.0 + math.exp(-least)) == pytest.approx(0.8909, abs=5e-5)
