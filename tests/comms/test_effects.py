"""What a node tells its shell."""

from __future__ import annotations

import numpy as np

from mrslam.comms.effects import EPOCHS, TeammateClaim


def test_a_claim_is_about_the_two_maps_that_were_seen_and_no_later_ones() -> None:
    claim = TeammateClaim("b", 7, "c", np.zeros(3), 1.0, of_robot=9)
    assert claim.is_of(7, 9) and claim.is_of(7, 9 + EPOCHS)
    assert not claim.is_of(8, 9) and not claim.is_of(7, 10)
    older = TeammateClaim("b", 7, "c", np.zeros(3), 1.0)  # the peer's program does not say which of c's
    assert older.is_of(7, 10) and not older.is_of(8, 10)
