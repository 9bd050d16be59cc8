"""Who is shown what."""

from __future__ import annotations

from pathlib import Path

from mrslam.sim_driver.missions.run_files import VIEW_FILE
from mrslam.sim_driver.missions.view_options import ViewOptions


def test_a_run_is_shown_where_it_is_recorded_or_a_viewer_is_named() -> None:
    assert not ViewOptions(robots=("r1",))
    assert ViewOptions(record=True) and ViewOptions(address="rerun+http://127.0.0.1:9/proxy")


def test_only_what_is_recorded_has_a_file() -> None:
    assert ViewOptions(record=True).file_of(Path("r1")) == Path("r1") / VIEW_FILE
    assert ViewOptions(address="rerun+http://127.0.0.1:9/proxy").file_of(Path("r1")) is None
