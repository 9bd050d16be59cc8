"""Seeds for everything random in a mission, all from its one seed."""

from __future__ import annotations

import hashlib

from mrslam.sim_driver.missions.mission import Mission


def seed_for(mission: Mission, purpose: str) -> int:
    """Return the seed of one random thing; other purposes and other missions' seeds do not correlate with it."""
    text = f"{mission.mission.seed}/{purpose}".encode()
    return int.from_bytes(hashlib.sha256(text).digest()[:4], "little")
