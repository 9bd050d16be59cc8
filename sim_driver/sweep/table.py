"""A sweep's one tidy table: a line a run, knobs and seed first."""

from __future__ import annotations

import csv
import importlib
import io
from pathlib import Path
from typing import Any

from mrslam.spatial.files.atomic import write_bytes, write_text

Rows = list[dict[str, Any]]


def write_table(rows: Rows, out: Path) -> list[Path]:
    """Write ``sweep.csv`` (an empty cell: no value), and ``sweep.parquet`` where pyarrow is installed."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: "" if value is None else value for key, value in row.items()} for row in rows)
    write_text(out / "sweep.csv", buffer.getvalue())
    written = [out / "sweep.csv"]
    try:
        arrow = importlib.import_module("pyarrow")
        parquet = importlib.import_module("pyarrow.parquet")
    except ImportError:
        return written
    sink = io.BytesIO()
    columns = {key: [number_or_text(row[key]) for row in rows] for key in rows[0]}
    parquet.write_table(arrow.table({key: _of_one_type(values) for key, values in columns.items()}), sink)
    write_bytes(out / "sweep.parquet", sink.getvalue())
    return [*written, out / "sweep.parquet"]


def _of_one_type(values: list[Any]) -> list[Any]:
    if any(isinstance(value, str) for value in values):
        return [None if value is None else str(value) for value in values]
    if any(isinstance(value, float) for value in values):
        return [None if value is None else float(value) for value in values]
    return values


def number_or_text(value: Any) -> Any:
    """Return a knob's value as a number where it is one."""
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return value
    return value
