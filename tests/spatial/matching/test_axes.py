"""Principal axes against numpy's eigenvectors."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.spatial.matching.axes import eigenvalues, least_axis, main_axis


@pytest.mark.parametrize("angle_rad", [0.0, 0.4, 1.3, 2.0, -0.7])
def test_axes_and_eigenvalues_are_those_of_the_matrix(angle_rad: float) -> None:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    turn = np.array([[cos, -sin], [sin, cos]])
    matrix = turn @ np.diag([5.0, 2.0]) @ turn.T
    xx, xy, yy = matrix[0, 0], matrix[0, 1], matrix[1, 1]
    assert eigenvalues(xx, xy, yy) == pytest.approx(np.linalg.eigvalsh(matrix))
    main = main_axis(xx, xy, yy)
    for axis, value in ((np.array([np.cos(main), np.sin(main)]), 5.0), (np.array(least_axis(xx, xy, yy)), 2.0)):
        assert np.hypot(*axis) == pytest.approx(1.0)
        assert matrix @ axis == pytest.approx(value * axis)
