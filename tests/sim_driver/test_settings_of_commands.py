"""Commands that have settings of one section refuse those of others, which would do nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from mrslam.sim_driver.cli.maps.align import align_files
from mrslam.sim_driver.cli.maps.diff import DiffOptions, diff_files
from mrslam.sim_driver.cli.maps.map_log import MapOptions, map_log
from mrslam.sim_driver.cli.maps.merge import merge_files
from mrslam.sim_driver.cli.maps.save import SaveOptions, save_maps
from mrslam.spatial import InputError

A, OUT = Path("a.yaml"), Path("out")


def _map(assignments: list[str]) -> None:
    map_log(
        MapOptions(
            log=Path("a.clf"), particles=5, seed=0, out=OUT, no_odometry=False, relations=None, salvage=False,
            assignments=assignments, rrd=None, view=False, as_json=True,
        )
    )  # fmt: skip


COMMANDS: dict[str, tuple[str, Callable[[list[str]], None]]] = {
    "map": ("rbpf.resolution_m=0.1", _map),
    "align": ("alignment.resolution_m=0.1", lambda given: align_files(A, A, "auto", None, given, True)),
    "merge": ("merge.resolution_m=0.1", lambda given: merge_files([A], OUT, None, "auto", None, given, True)),
    "save": ("merge.resolution_m=0.1", lambda given: save_maps(SaveOptions(maps=[A], out=OUT, assignments=given))),
    "diff": (
        "merge.resolution_m=0.1",
        lambda given: diff_files(DiffOptions(before=A, after=A, out=OUT, assignments=given)),
    ),
}
"""Command -> a setting that it has, and how it is called."""


@pytest.mark.parametrize("command", COMMANDS)
def test_a_setting_of_a_section_that_a_command_does_not_have_is_refused(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    own, call = COMMANDS[command]
    with pytest.raises(InputError, match="--set: unknown key 'comms'"):
        call([own, "comms.link_threshold=0.5"])
    with pytest.raises(InputError, match=r"no such|not found"):
        call([own])
    assert list(tmp_path.iterdir()) == []
