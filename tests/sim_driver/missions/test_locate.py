"""Where logs are looked for, and what is said where they are not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mrslam.sim_driver.missions.locate import DATA_VARIABLE, locate
from mrslam.spatial import InputError


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    here, folder = tmp_path / "here", tmp_path / "data"
    for path in (here, folder / "slam", folder / "other" / "deep"):
        path.mkdir(parents=True)
    (folder / "slam" / "intel.clf.gz").touch()
    monkeypatch.chdir(here)
    monkeypatch.setenv(DATA_VARIABLE, str(folder))
    return folder


def test_files_are_found_in_the_data_folder(data: Path) -> None:
    assert locate("slam/intel.clf.gz") == data / "slam" / "intel.clf.gz"


def test_folders_are_found_too(data: Path) -> None:
    assert locate("other/deep") == data / "other" / "deep"


def test_a_file_of_that_name_elsewhere_in_the_data_folder_is_named(data: Path) -> None:
    where = re.escape(f"intel.clf.gz: not found in this folder, {data} ({DATA_VARIABLE})")
    with pytest.raises(InputError, match=f"^{where}; did you mean slam/intel.clf.gz\\?$"):
        locate("intel.clf.gz")
    (data / "other" / "deep" / "intel.clf.gz").touch()
    with pytest.raises(InputError, match=r"did you mean slam/intel.clf.gz or other/deep/intel.clf.gz\?$"):
        locate("old/intel.clf.gz")
    for name in ("ntel.clf.gz", "*.clf.gz", "intel", "a" * 300, "a\0b"):
        with pytest.raises(InputError, match=re.escape(f"{data} ({DATA_VARIABLE})") + "$"):
            locate(name)


def test_the_variable_is_asked_for_only_where_it_is_not_set(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DATA_VARIABLE, str(data / "gone"))
    with pytest.raises(InputError, match=rf"gone \({DATA_VARIABLE}, which is no folder\)$"):
        locate("intel.clf.gz")
    monkeypatch.delenv(DATA_VARIABLE)
    with pytest.raises(InputError, match=rf"in this folder, missions, .*; set {DATA_VARIABLE} to the folder"):
        locate("intel.clf.gz", Path("missions"))


def test_a_whole_path_is_only_itself(data: Path) -> None:
    with pytest.raises(InputError, match=r"/intel\.clf\.gz: no such file$"):
        locate(str(data / "intel.clf.gz"))
