"""A sweep's table: one type a column, and empty cells where there is no value."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from mrslam.sim_driver.sweep.table import _of_one_type, number_or_text, write_table


def test_a_value_that_is_not_there_is_an_empty_cell(tmp_path: Path) -> None:
    rows = [{"knob": "a", "seed": 0, "off_m": None}, {"knob": "b", "seed": 1, "off_m": 0.5}]
    write_table(rows, tmp_path)
    with (tmp_path / "sweep.csv").open(encoding="utf-8") as file:
        assert list(csv.reader(file)) == [["knob", "seed", "off_m"], ["a", "0", ""], ["b", "1", "0.5"]]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([1, "auto", None], ["1", "auto", None]),
        ([1, 2.5, None], [1.0, 2.5, None]),
        ([1, 2, None], [1, 2, None]),
    ],
)
def test_a_column_has_one_type(values: list[object], expected: list[object]) -> None:
    found = _of_one_type(values)
    assert found == expected and [type(value) for value in found] == [type(value) for value in expected]


def test_a_knob_is_a_number_where_it_is_one() -> None:
    assert [number_or_text(value) for value in ("0.5", "1e3", "auto", 3, None)] == [0.5, 1000.0, "auto", 3, None]
