"""A session at each jump of the clock: said once it is saved, complained of where it is not, and not for ever."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrslam.agent import WallClock, checkpoint
from mrslam.sim_driver.ros.complaints import Complaints
from mrslam.sim_driver.ros.jumps import SAVED_MOST, JumpSessions
from mrslam.sim_driver.ros.outlook import RosBody
from mrslam.sim_driver.ros.sessions import Sessions
from tests.full_disk import full_disk
from tests.sim_driver.ros.test_outlook import make_agent


class Rig:
    """A body that nobody looks at, with what was said and complained of its sessions."""

    def __init__(self, folder: Path) -> None:
        self.agent, self.body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=2.0)
        self.said: list[str] = []
        self.warned: list[str] = []
        self.complaints = Complaints(self.warned.append)
        self.sessions = Sessions(folder, make_agent)
        self.jumps = JumpSessions(self.body.ask, self.sessions.save, self.said.append, self.complaints)

    def act(self) -> list[Path]:
        """Let the agent's thread do what was asked; return the sessions that are there."""
        self.body.act(self.agent, 0)
        return list(self.sessions.folder.glob("*.session"))


def test_a_session_is_reported_once_it_is_saved(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.jumps.on_jump(91.04)
    assert not rig.said
    (path,) = rig.act()
    assert rig.said == [f"the map of before stamps ran backward by 91.0 s is saved as a session: {path}"]
    assert not rig.warned


def test_a_session_that_cannot_be_saved_is_complained_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(tmp_path)
    monkeypatch.setattr(checkpoint, "write", full_disk)
    for times in (1, 2):
        rig.jumps.on_jump(3.0)
        assert rig.act() == [] and not rig.said
        assert len(rig.warned) == 1 and rig.warned[0].endswith("[Errno 28] No space left on device")
        assert rig.complaints.counts["session"] == times


def test_a_clock_that_jumps_for_ever_does_not_fill_the_disk(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    for _ in range(SAVED_MOST + 5):
        rig.jumps.on_jump(60.0)
    assert len(rig.act()) == len(rig.said) == SAVED_MOST
    assert len(rig.warned) == 1 and "not saved as a session any more" in rig.warned[0]
