"""One pose at a time as many at once."""

from __future__ import annotations

import numpy as np

from mrslam.spatial import se2
from mrslam.spatial.poses import between, compose


def test_scalar_poses_are_those_of_se2() -> None:
    rng = np.random.default_rng(1)
    for a, b in rng.uniform(-4, 4, (50, 2, 3)):
        assert np.allclose(compose(a, b), se2.compose(a, b))
        assert np.allclose(between(a, b), se2.between(a, b))
