from pathlib import Path

import cv2
import numpy as np
import pytest

from mrslam.spatial import InputError
from mrslam.spatial.files.images import read_image, write_image


@pytest.mark.parametrize("suffix", [".pgm", ".png"])
def test_grey_images_round_trip_to_the_byte(tmp_path, suffix):
    image = np.random.default_rng(0).integers(0, 256, size=(7, 11)).astype(np.uint8)
    write_image(tmp_path / f"a{suffix}", image)
    grey, opaque = read_image(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(grey, image)
    assert opaque is None


@pytest.mark.parametrize("white", [15, 100, 255, 1000, 65535])
def test_greys_are_shares_of_what_a_file_calls_white(tmp_path, white):
    size = 1 if white < 256 else 2
    body = b"".join(value.to_bytes(size, "big") for value in (0, white // 5, white))
    (tmp_path / "a.pgm").write_bytes(b"P5\n# a comment\n3 1\n%d\n" % white + body)
    assert read_image(tmp_path / "a.pgm")[0].tolist() == [[0, 51, 255]]


def test_colours_are_rgb(tmp_path):
    import cv2

    image = np.zeros((2, 2, 3), dtype=np.uint8)
    image[..., 0] = 200  # red
    write_image(tmp_path / "a.png", image)
    blue, green, red = cv2.imread(str(tmp_path / "a.png"))[0, 0]
    assert (red, green, blue) == (200, 0, 0)


@pytest.mark.parametrize("content", [b"", b"no image", b"P5\n10 10\n255\n", b"\x89PNG\r\n\x1a\nrubbish"])
def test_what_is_no_image_is_named(tmp_path, content):
    (tmp_path / "a.pgm").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.pgm: not a readable image"):
        read_image(tmp_path / "a.pgm")


def test_a_cut_image_says_how_much_is_missing_and_nothing_else_is_printed(tmp_path, capfd):
    image = np.full((10, 12), 255, dtype=np.uint8)
    for name in ("a.pgm", "a.png"):
        write_image(tmp_path / name, image)
        (tmp_path / name).write_bytes((tmp_path / name).read_bytes()[:60])
    with pytest.raises(InputError, match=r"cut short: 12 x 10 cells need 120 bytes, the file holds 4[0-9]"):
        read_image(tmp_path / "a.pgm")
    with pytest.raises(InputError, match="damaged or cut short"):
        read_image(tmp_path / "a.png")
    printed = capfd.readouterr()
    assert printed.out == ""
    # Before OpenCV 5 libpng wrote a line of its own that nobody could turn off.
    assert printed.err == ("" if cv2.__version__ >= "5" else "libpng error: PNG input buffer is incomplete\n")


def test_a_missing_image_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone\.pgm: cannot be read"):
        read_image(tmp_path / "gone.pgm")


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_only_pixels_without_any_transparency_are_opaque(tmp_path: Path, kind: type[np.unsignedinteger]) -> None:
    most = np.iinfo(kind).max
    image = np.full((1, 3, 4), most, dtype=kind)
    image[0, :, 3] = 0, most // 2, most
    assert cv2.imwrite(str(tmp_path / "a.png"), image)
    opaque = read_image(tmp_path / "a.png")[1]
    assert opaque is not None and opaque.tolist() == [[False, False, True]]


@pytest.mark.parametrize("name", ["a.nonsense", "a"])
def test_unknown_formats_are_refused(tmp_path, name):
    with pytest.raises(InputError, match="cannot be written as"):
        write_image(tmp_path / name, np.zeros((2, 2), dtype=np.uint8))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "header", [b"P5" + b" " * 5000, b"P5\t" * 3 + b"\t#" * 3000, b"P5 " + b"9" * 6000 + b" 1 255 "]
)
def test_a_header_made_to_take_long_is_refused_at_once(tmp_path, header):
    (tmp_path / "a.pgm").write_bytes(header + b"\xc9")
    with pytest.raises(InputError, match="damaged or cut short"):
        read_image(tmp_path / "a.pgm")


def test_a_cut_image_of_wide_greys_says_how_much_is_missing(tmp_path):
    (tmp_path / "a.pgm").write_bytes(b"P5\n10 10\n65535\n" + bytes(150))
    with pytest.raises(InputError, match="10 x 10 cells need 200 bytes, the file holds 150"):
        read_image(tmp_path / "a.pgm")


def test_what_others_want_to_hear_of_images_is_said_again_afterwards(tmp_path):
    log = getattr(cv2.utils, "logging", cv2)
    before, chosen = log.getLogLevel(), 2
    log.setLogLevel(chosen)
    try:
        (tmp_path / "a.pgm").write_bytes(b"no image")
        with pytest.raises(InputError):
            read_image(tmp_path / "a.pgm")
        assert log.getLogLevel() == chosen
    finally:
        log.setLogLevel(before)
