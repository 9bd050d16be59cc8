"""Corrected trajectories with every scan: a robot knows keyframes of a teammate, and the teammate knows the rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from mrslam.merge import Bend
from mrslam.sim_driver.missions.run_files import KEYFRAMES_FILE, TRAJECTORY_FILE, team_file
from mrslam.spatial import InputError, Keyframes
from mrslam.spatial.files.keyframes import read_keyframes
from mrslam.spatial.files.tum import read_tum, write_tum


def fill_team_ways(out: Path, robots: Sequence[str], say: Callable[[str], None]) -> None:
    """Rewrite ``<robot>/team/<other>.tum`` with all scans of the other, where both robots ended in good order.

    What is damaged is named, and the keyframes stay as they are.
    """
    for robot in robots:
        for other in robots:
            path = out / robot / team_file(other)
            parts = [path, out / other / KEYFRAMES_FILE, out / other / TRAJECTORY_FILE]
            if robot != other and all(part.is_file() for part in parts):
                try:
                    corrected, every = Keyframes(*read_tum(path)), Keyframes(*read_tum(parts[2]))
                    own, _ = read_keyframes(parts[1])
                except InputError as error:
                    say(str(error))
                    continue
                filled = with_every_scan(corrected, own, every)
                write_tum(path, filled.stamps_ns, filled.T_map_base)


def with_every_scan(corrected: Keyframes, own: Keyframes, every: Keyframes) -> Keyframes:
    """Return ``every`` scan of a robot as its ``corrected`` keyframes have them; ``own`` : the same in its own map."""
    _, known, mine = np.intersect1d(corrected.stamps_ns, own.stamps_ns, return_indices=True)
    if known.size == 0:
        return corrected
    return Bend(own.T_map_base[mine], corrected.T_map_base[known]).corrected_at(own.stamps_ns[mine], every)
