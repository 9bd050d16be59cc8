"""Evidence as typed fields, and as rows of JSON."""

from __future__ import annotations

import pytest

from mrslam.alignment import Evidence, WallEvidence

FULL = Evidence(
    a=WallEvidence(30.0, 2.0, 3.0, 1.0), b=WallEvidence(20.0, 4.0, 1.0, 0.5), overlap_m2=40.0, overlap=0.5,
    free_m2=35.0, acceptance_index=0.97, crosswise_m=6.0, extent_m=4.0, walls=7, residual=0.1, score_m=19.0, margin=0.8,
    proposal={"correlation_m": 12.0},
)  # fmt: skip


def test_a_row_holds_every_number_by_its_name_and_is_read_back():
    row = FULL.as_row()
    assert row["matched_a_m"] == 30.0 and row["deep_b_m"] == 0.5 and row["correlation_m"] == 12.0
    assert row["wall_agreement_a"] == pytest.approx(30 / 35) and row["contradiction"] == pytest.approx(4 / 54)
    assert len(row) == 1 + 8 + 3 + 12 and all(type(value) is float for value in row.values())
    assert Evidence.from_row(row) == FULL


def test_a_row_of_somebody_elses_method_is_kept_as_its_own_numbers():
    assert Evidence.from_row({"votes": 3.0, "margin": 0.4}) == Evidence(margin=0.4, proposal={"votes": 3.0})


def test_swapping_exchanges_the_maps_and_nothing_else():
    other = FULL.swapped()
    assert (other.a, other.b) == (FULL.b, FULL.a) and other.swapped() == FULL
    assert other.as_row()["opposed_b_m"] == 2.0 and other.margin == FULL.margin


def test_ratios_take_the_worse_direction_and_no_wall_gives_a_huge_one():
    assert FULL.matched_m == 20.0
    assert FULL.contradicted_per_m == pytest.approx(3 / 20) and FULL.deep_per_m == pytest.approx(1 / 20)
    assert Evidence(a=WallEvidence(contradicted_m=1.0)).contradicted_per_m > 100.0
    assert Evidence().contradicted_per_m == 0.0 and Evidence().contradiction == 0.0
