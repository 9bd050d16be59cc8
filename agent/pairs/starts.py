"""Where robots' maps are said to begin: known starts, and hints of a place in a saved map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.config import AgentConfig, check_start
from mrslam.alignment import Prior
from mrslam.comms import is_saved
from mrslam.merge import Pair
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

START_SIGMAS = 4.0
"""A transform farther from the known starts than this many standard deviations is not where they say."""


class Starts:
    """What one robot was told of where maps begin, until a map is begun anew."""

    def __init__(self, own_id: str, config: AgentConfig) -> None:
        """Take the robot's id, the starts that are known, and how sure they are."""
        self._own_id, self._sigma_m, self._sigma_rad = own_id, config.start_sigma_m, config.start_sigma_rad
        self._starts = {robot_id: np.array(start, dtype=np.float64) for robot_id, start in config.starts.items()}
        self._near: dict[str, NDArray[np.float64]] = {}
        self.begun_anew: set[str] = set()
        """Robots that began another map, which is not where they started."""

    def expect(self, map_id: str, near: Sequence[float]) -> None:
        """Look for the own map's begin first near ``[x_m, y_m]`` or ``[x_m, y_m, theta_rad]`` of a saved map."""
        check_start("where a map begins", near)
        self._near[map_id] = np.array(near, dtype=np.float64)

    def forget(self, robot_id: str) -> None:
        """Look no longer where a robot started: it began another map."""
        self.begun_anew.add(robot_id)
        self._starts.pop(robot_id, None)
        if robot_id == self._own_id:
            self._near.clear()

    def prior(self, pair: Pair) -> Prior | None:
        """Return where a pair's maps lie by what was told, None where that does not say it."""
        starts = self._of(pair)
        sure = {robot_id: _sureness(robot_id, start) for robot_id, start in starts.items()}
        if len(starts) < 2 or not any(sure.values()):  # neither heading is known
            return None
        a, b = pair
        if turned := sure[b] > sure[a]:
            a, b = b, a
        T_a_b = se2.between(starts[a], np.append(starts[b], 0.0)[:3])
        # A wrong heading of a also moves b about a's start; the frame of a saved map is what it is.
        unsure, swing_rad = (1.0, 0.0) if is_saved(a) else (2.0, self._sigma_rad)
        place_m2 = unsure * self._sigma_m**2 + (swing_rad * float(np.hypot(*T_a_b[:2]))) ** 2
        turn_rad2 = unsure * self._sigma_rad**2 if sure[b] else np.pi**2
        return Prior(T_a_b, np.diag([place_m2, place_m2, turn_rad2]), of_inverse=turned)

    def say(self, pair: Pair, T_a_b: Transform) -> bool:
        """Return whether a pair's transform is one that what was told expects."""
        prior = self.prior(pair)
        if prior is None:
            return False
        T_a_b = se2.inverse(T_a_b) if prior.of_inverse else T_a_b
        apart = np.append(T_a_b[:2] - prior.T_a_b[:2], se2.wrap(T_a_b[2] - prior.T_a_b[2]))
        return bool(apart @ np.linalg.solve(prior.covariance, apart) < START_SIGMAS**2)

    def _of(self, pair: Pair) -> dict[str, NDArray[np.float64]]:
        """Return where the two maps of a pair begin in one frame, of those of which it is known."""
        for map_id, other in (pair, pair[::-1]):
            if map_id in self._near and other == self._own_id:
                return {map_id: se2.IDENTITY, other: self._near[map_id]}
        return {robot_id: self._starts[robot_id] for robot_id in pair if robot_id in self._starts}


def _sureness(robot_id: str, start: NDArray[np.float64]) -> int:
    """Return how well a start is known: 0 without heading, 1 with it, 2 for a saved map's origin."""
    return 2 if is_saved(robot_id) else int(start.size == 3)
