"""Keyframes next to each other on one robot's way, by whose scans a place is known."""

from __future__ import annotations

import hashlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import KeyScans, se2
from mrslam.spatial.se2 import Transform


class Stretch(NamedTuple):
    """A keyframe and those before and after it."""

    keys: NDArray[np.int64]
    """``(n,)``, in order, without a gap."""
    T_key_keys: Transform
    """``(n, 3)``: where they are, in the frame of the keyframe."""

    @classmethod
    def of(cls, T_map_key: Transform, k: int, keys: NDArray[np.int64]) -> Stretch:
        """Return the stretch of ``keys (n,)``, which are around keyframe ``k`` of all those ``(K, 3)``."""
        return cls(keys, se2.between(T_map_key[k], T_map_key[keys]))

    def content(self, scans: KeyScans) -> bytes:
        """Return a hash of where the keyframes are and of their scans: stretches that match alike have the same."""
        keys, starts = self.keys, scans.starts[self.keys[0] : self.keys[-1] + 2]
        content = hashlib.blake2b(self.T_key_keys.tobytes() + np.diff(starts).tobytes(), digest_size=16)
        content.update(scans.polar[starts[0] : starts[-1]].tobytes() + scans.origins[keys].tobytes())
        return content.digest()
