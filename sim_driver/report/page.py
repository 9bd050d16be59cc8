"""Writing the page: one file that needs nothing else."""

from __future__ import annotations

import html
import json
from pathlib import Path

from mrslam.sim_driver.evaluate import References
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.run_files import REPORT_FILE
from mrslam.sim_driver.report.data import page_data
from mrslam.spatial.files.atomic import write_text

TEMPLATE = Path(__file__).with_name("page.html")
"""The page without its data."""


def write_report(folder: Path, out: Path | None = None, references: References | None = None) -> Path:
    """Write the report of the run in ``folder`` (into it unless ``out`` says where else) and return its path."""
    data = page_data(RunResults.read(folder), references)
    # "</" would end the script element that holds the data, and "<!--" begin a comment in it
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    page = TEMPLATE.read_text(encoding="utf-8")
    page = page.replace("{{title}}", html.escape(f"{data['name']}: {data['headline']}")).replace("{{data}}", text)
    path = folder / REPORT_FILE if out is None else out
    write_text(path, page)
    return path
