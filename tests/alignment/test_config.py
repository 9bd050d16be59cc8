import pytest

from mrslam.alignment import AlignmentConfig
from mrslam.spatial import InputError


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", -1),
        ("tolerance_m", 0.0),
        ("min_margin", 1.5),
        ("evaluations", 0),
        ("max_cells", 5),
        ("min_score_m", -1.0),
    ],
)
def test_bad_values_are_named(name, value):
    with pytest.raises(InputError, match=f"alignment.{name} must be"):
        AlignmentConfig(**{name: value})
