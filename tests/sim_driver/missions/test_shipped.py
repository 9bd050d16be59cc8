"""Missions that ship are found by name from anywhere; a file of one's own comes first."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrslam.sim_driver.missions.mission import load_mission
from mrslam.sim_driver.missions.shipped import find_mission, shipped_missions
from mrslam.sim_driver.sweep import make_plan
from mrslam.spatial import InputError

CHECKOUT = Path(__file__).parents[3] / "missions"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_all_missions_of_the_checkout_ship() -> None:
    assert shipped_missions() == sorted(path.stem for path in CHECKOUT.glob("*.toml"))
    assert "office" in shipped_missions()


@pytest.mark.parametrize("name", ["office", "office.toml", "missions/office.toml"])
def test_a_shipped_mission_is_found_by_its_name(name: str) -> None:
    mission = load_mission(Path(name))
    assert mission.mission.name == "office"
    assert mission.world is not None
    assert mission.world.name == "office"


def test_files_beside_a_shipped_mission_are_found() -> None:
    assert load_mission(Path("intel-two")).find("intel-two.links.csv").is_file()


def test_a_sweep_takes_one_too() -> None:
    assert len(make_plan(Path("office-two"), seeds=1).points) == 16


def test_ones_own_file_comes_first(elsewhere: Path) -> None:
    own = elsewhere / "office.toml"
    own.write_text('[[robots]]\nid = "mine"\nlog = "x.clf"\n')
    assert [robot.id for robot in load_mission(Path("office.toml")).robots] == ["mine"]


def test_a_folder_is_no_mission(elsewhere: Path) -> None:
    (elsewhere / "mine").mkdir()
    with pytest.raises(InputError, match=r"mine: is a folder; name the mission file"):
        find_mission(Path("mine"))


def test_a_slip_of_the_pen_is_told_what_was_meant() -> None:
    with pytest.raises(InputError, match="no such mission file; did you mean office"):
        find_mission(Path("ofice.toml"))


@pytest.mark.parametrize("name", ["nosuch", "elsewhere/office.toml", "office.tml", "/office.toml"])
def test_what_is_not_there_is_said_with_what_is(name: str) -> None:
    with pytest.raises(InputError, match=rf"{name}: no such mission file; those that ship are .*\boffice\b"):
        find_mission(Path(name))
