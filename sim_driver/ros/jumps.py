"""What becomes of the map so far when stamps run backward: it is saved as a session, and said once that is done."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from mrslam.agent import Agent
from mrslam.sim_driver.ros.complaints import Complaints

SAVED_MOST = 10
"""Most sessions that jumps of the clock make in a node's life: a bag that loops for ever would fill the disk."""


class JumpSessions:
    """Has the agent's thread save a session at each jump of the clock."""

    def __init__(
        self,
        ask: Callable[[Callable[[Agent], Path]], Future[Path]],
        save: Callable[[Agent], Path],
        say: Callable[[str], None],
        complaints: Complaints,
    ) -> None:
        """``ask(save)`` : has the agent's thread call ``save``, which returns the session's file; ``say`` a line."""
        self._ask, self._save, self._say, self._complaints = ask, save, say, complaints
        self._asked = 0

    def on_jump(self, back_s: float) -> None:
        """Save the map so far, for stamps ran backward by so many seconds."""
        if self._asked == SAVED_MOST:
            words = f"stamps ran backward {SAVED_MOST} times: the map of before is not saved as a session any more"
            self._complaints.once("sessions", words)
            return
        self._asked += 1
        self._ask(self._save).add_done_callback(lambda saved: self._report(saved, back_s))

    def _report(self, saved: Future[Path], back_s: float) -> None:
        """Say where the session is, or complain that there is none."""
        error = saved.exception()
        if error is None:
            self._say(
                f"the map of before stamps ran backward by {back_s:.1f} s is saved as a session: {saved.result()}"
            )
        else:
            self._complaints.once(
                "session", f"the map of before stamps ran backward is not saved as a session: {error}"
            )
