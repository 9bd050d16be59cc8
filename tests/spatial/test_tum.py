import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrslam.spatial import InputError, se2
from mrslam.spatial.files.tum import read_tum, write_tum


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(st.integers(0, 2_000_000_000), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(-np.pi, np.pi)),
        max_size=10,
    )
)
def test_trajectories_round_trip(tmp_path, rows):
    stamps = np.array([row[0] * 1000 for row in rows], dtype=np.int64)
    poses = np.array([row[1:] for row in rows], dtype=np.float64).reshape(-1, 3)
    write_tum(tmp_path / "t.tum", stamps, poses)
    stamps_back, poses_back = read_tum(tmp_path / "t.tum")
    np.testing.assert_array_equal(stamps_back, stamps)
    np.testing.assert_allclose(poses_back[:, :2], poses[:, :2], atol=1e-6)
    np.testing.assert_allclose(se2.wrap(poses_back[:, 2] - poses[:, 2]), 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3\n", "line 1: needs 8 finite numbers"),
        ("# head\n1 0 0 0 0 0 0 1\n1 0 0 0 0 0 x 1\n", "line 3: not a number"),
        ("nan 0 0 0 0 0 0 1\n", "line 1"),
    ],
)
def test_bad_lines_are_named(tmp_path, text, message):
    (tmp_path / "t.tum").write_text(text)
    with pytest.raises(InputError, match=message):
        read_tum(tmp_path / "t.tum")


@pytest.mark.parametrize("column", range(8))
@pytest.mark.parametrize("number", ["1e300", "-1e300", "1e10"])
def test_numbers_beyond_all_bounds_are_refused(tmp_path, column, number):
    words = ["0"] * 8
    words[column] = number
    (tmp_path / "t.tum").write_text("0 0 0 0 0 0 0 1\n" + " ".join(words) + "\n")
    with pytest.raises(InputError, match=r"t\.tum, line 2: times \(s\) and poses \(m\) must be within 9e\+09"):
        read_tum(tmp_path / "t.tum")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_tum(tmp_path / "gone.tum")


def test_a_path_may_be_text(tmp_path):
    write_tum(str(tmp_path / "t.tum"), np.array([1_000_000_000]), np.array([[1.0, 2.0, 0.5]]))
    stamps, poses = read_tum(str(tmp_path / "t.tum"))
    assert stamps.tolist() == [1_000_000_000]
    np.testing.assert_allclose(poses, [[1.0, 2.0, 0.5]], atol=1e-6)
    with pytest.raises(InputError, match=r"no\.tum: cannot be read"):
        read_tum(str(tmp_path / "no.tum"))


def test_numbers_may_be_parted_by_commas(tmp_path):
    (tmp_path / "way.tum").write_text("1.5,2,3,0,0,0,1,0\n2.5, 4, 5, 0, 0, 0, 0, 1\n")
    stamps, poses = read_tum(tmp_path / "way.tum")
    assert stamps.tolist() == [1_500_000_000, 2_500_000_000]
    np.testing.assert_allclose(poses, [[2.0, 3.0, np.pi], [4.0, 5.0, 0.0]])


def test_a_quaternion_of_any_length_is_a_heading(tmp_path):
    (tmp_path / "way.tum").write_text("1 0 0 0 0 0 1 1\n")
    assert read_tum(tmp_path / "way.tum")[1][0, 2] == pytest.approx(np.pi / 2)
