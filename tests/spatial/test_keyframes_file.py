import numpy as np
import pytest

from mrslam.spatial import InputError, Keyframes, KeyScans
from mrslam.spatial.files.keyframes import NAMES, read_keyframes, read_scanned_keyframes, write_keyframes

RNG = np.random.default_rng(0)
KEYFRAMES = Keyframes(np.arange(4) * 1_000_000_000, RNG.normal(size=(4, 3)))
SCANS = KeyScans.of_points([RNG.uniform(1.0, 5.0, (20, 2)) for _ in range(4)], np.zeros((4, 2)))


def test_what_is_written_is_read(tmp_path):
    path = tmp_path / "keyframes.npz"
    write_keyframes(path, KEYFRAMES, SCANS)
    keyframes, scans = read_keyframes(path)
    assert np.array_equal(keyframes.stamps_ns, KEYFRAMES.stamps_ns)
    assert np.array_equal(keyframes.T_map_base, KEYFRAMES.T_map_base)
    assert scans.equals(SCANS)


def test_keyframes_without_scans(tmp_path):
    path = tmp_path / "keyframes.npz"
    write_keyframes(path, KEYFRAMES, KeyScans.empty())
    assert len(read_keyframes(path)[1]) == 0


@pytest.mark.parametrize(
    ("name", "wrong", "says"),
    [
        ("stamps_ns", np.arange(3), "are no keyframes"),
        ("stamps_ns", np.zeros(4), "are no keyframes"),
        ("T_map_base", np.full((4, 3), np.nan), "not finite"),
        ("T_map_base", np.zeros((4, 3), np.complex128), "not finite"),
        ("starts", np.array([0, 99], np.int32), "keyframes.npz"),
        ("polar", np.zeros((80, 2)), "polar must be"),
        ("origins", np.full((4, 2), np.inf, np.float32), "origins must be"),
    ],
)
def test_wrong_content_is_named(tmp_path, name, wrong, says):
    path = tmp_path / "keyframes.npz"
    arrays = (KEYFRAMES.stamps_ns, KEYFRAMES.T_map_base, SCANS.starts, SCANS.polar, SCANS.origins)
    np.savez_compressed(path, **{**dict(zip(NAMES, arrays, strict=True)), name: wrong})
    with pytest.raises(InputError, match=says) as error:
        read_keyframes(path)
    assert "\n" not in str(error.value) and str(path) in str(error.value)


def test_more_scans_than_keyframes_are_named(tmp_path):
    few = Keyframes(KEYFRAMES.stamps_ns[:3], KEYFRAMES.T_map_base[:3])
    write_keyframes(tmp_path / "k.npz", few, SCANS)
    for read in (read_keyframes, read_scanned_keyframes):
        with pytest.raises(InputError, match=r"k\.npz: 4 scans of 3 keyframes"):
            read(tmp_path / "k.npz")


@pytest.mark.parametrize("content", [b"", b"nonsense", b"PK\x03\x04 cut"])
def test_what_is_no_archive_is_named(tmp_path, content):
    path = tmp_path / "keyframes.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"keyframes\.npz: not a readable"):
        read_keyframes(path)


def test_keyframes_without_scans_are_left_out_where_scans_are_asked_for(tmp_path):
    keyframes = Keyframes(np.arange(3), np.arange(9.0).reshape(3, 3))
    write_keyframes(tmp_path / "k.npz", keyframes, KeyScans.blank(2))
    scanned, scans = read_scanned_keyframes(tmp_path / "k.npz")
    assert scanned.stamps_ns.tolist() == [0, 1] and len(scans) == 2
    np.testing.assert_array_equal(scanned.T_map_base, keyframes.T_map_base[:2])
