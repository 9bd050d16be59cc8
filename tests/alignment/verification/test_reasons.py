from __future__ import annotations

import math

import pytest

from mrslam.alignment import AlignmentConfig, Evidence, WallEvidence
from mrslam.alignment.verification import reasons


def test_the_lead_bounds_the_confidence_as_the_documentation_says() -> None:
    walls = WallEvidence(matched_m=1000.0)
    evidence = Evidence(a=walls, b=walls, walls=99, crosswise_m=500.0, score_m=1000.0, margin=1.0)
    least = min(asked.slack for asked in reasons.tests(evidence, AlignmentConfig()))
    assert 1.0 / (1.0 + math.exp(-least)) == pytest.approx(0.8909, abs=5e-5)
