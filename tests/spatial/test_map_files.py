import contextlib
import io
import zipfile

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrslam.spatial import InputError, OccupancyGrid, TiledMap, read_map, write_map
from mrslam.spatial.files.images import read_image, write_image

trinary = arrays(np.int8, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.sampled_from([-1, 0, 100]))


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(trinary, st.floats(-500, 500), st.floats(-500, 500), st.sampled_from([0.01, 0.025, 0.05, 0.1234]))
def test_maps_round_trip(tmp_path, cells, x, y, resolution):
    grid = OccupancyGrid(cells, resolution, (x, y))
    write_map(tmp_path / "map.yaml", grid)
    back = read_map(tmp_path / "map.yaml")
    np.testing.assert_array_equal(back.cells, cells)
    assert back.resolution_m == resolution
    np.testing.assert_allclose(back.origin_m, (x, y), atol=1e-6)


def test_shades_are_written_as_free_unknown_or_occupied(tmp_path):
    cells = np.array([[0, 35, 36, 64, 65, 100, -1]], dtype=np.int8)
    write_map(tmp_path / "map.yaml", OccupancyGrid(cells, 0.05))
    assert read_map(tmp_path / "map.yaml").cells.tolist() == [[0, 0, -1, -1, 100, 100, -1]]


def test_the_first_row_of_cells_is_the_bottom_of_the_image(tmp_path):
    cells = np.array([[100, 100], [0, 0]], dtype=np.int8)
    write_map(tmp_path / "map.yaml", OccupancyGrid(cells, 0.05))
    assert read_image(tmp_path / "map.pgm")[0].tolist() == [[254, 254], [0, 0]]


def test_the_files_hold_what_other_map_tools_ask_for(tmp_path):
    write_map(tmp_path / "map.yaml", OccupancyGrid(np.zeros((3, 4), dtype=np.int8), 0.05, (-1.0, 2.0)))
    meta = yaml.safe_load((tmp_path / "map.yaml").read_text())
    assert meta == {
        "image": "map.pgm",
        "mode": "trinary",
        "resolution": 0.05,
        "origin": [-1.0, 2.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    assert (tmp_path / "map.pgm").read_bytes().startswith(b"P5")


def test_an_empty_map_is_one_unknown_cell(tmp_path):
    write_map(tmp_path / "map.yaml", OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05))
    assert read_map(tmp_path / "map.yaml").cells.tolist() == [[-1]]


def test_negated_images_and_own_thresholds(tmp_path):
    write_image(tmp_path / "m.png", np.array([[0, 128, 255]], dtype=np.uint8))
    (tmp_path / "m.yaml").write_text(
        "image: m.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 1\noccupied_thresh: 0.9\nfree_thresh: 0.1\n"
    )
    assert read_map(tmp_path / "m.yaml").cells.tolist() == [[0, -1, 100]]


def read_as(tmp_path, image, **meta):
    write_image(tmp_path / "m.png", np.array(image, dtype=np.uint8))
    text = yaml.safe_dump({"image": "m.png", "resolution": 0.1, "origin": [0, 0, 0], **meta})
    (tmp_path / "m.yaml").write_text(text)
    return read_map(tmp_path / "m.yaml").cells.tolist()


def test_a_map_savers_unknown_is_unknown_though_its_own_threshold_makes_it_free(tmp_path):
    """Nav2 saves unknown as 205, occupancy 0.196, beside ``free_thresh: 0.25``."""
    assert read_as(tmp_path, [[0, 205, 254]], free_thresh=0.25) == [[100, -1, 0]]
    assert read_as(tmp_path, [[255, 50, 1]], free_thresh=0.25, negate=1) == [[100, -1, 0]]
    assert read_as(tmp_path, [[0, 205, 206, 254]], free_thresh=0.25) == [[100, 0, 0, 0]]  # one of many greys


def test_a_map_without_thresholds_has_those_of_map_servers(tmp_path):
    assert read_as(tmp_path, [[0, 88, 91, 203, 206, 254]]) == [[100, 100, -1, -1, 0, 0]]  # 65 and 20 percent dark


def test_modes_of_map_servers(tmp_path):
    greys = [[0, 65, 100, 101, 205, 255]]
    assert read_as(tmp_path, greys, mode="raw") == [[0, 65, 100, -1, -1, -1]]
    cells = read_as(tmp_path, [[255, 204, 153, 51, 0]], mode="scale", free_thresh=0.1, occupied_thresh=0.6)
    assert cells == [[0, 20, 60, 100, 100]]
    with pytest.raises(InputError, match=r"m\.yaml: mode must be one of trinary, scale, raw, got 'rwa'"):
        read_as(tmp_path, greys, mode="rwa")


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_what_is_transparent_is_unknown(tmp_path, mode):
    image = np.zeros((1, 4, 4), dtype=np.uint8)
    image[0, :2, :3] = 255
    image[0, ::2, 3] = 255
    cv2.imwrite(str(tmp_path / "m.png"), image)
    (tmp_path / "m.yaml").write_text(f"image: m.png\nresolution: 0.1\norigin: [0, 0, 0]\nmode: {mode}\n")
    assert read_map(tmp_path / "m.yaml").cells.tolist() == [[0, -1, 100, -1]]


def test_what_is_transparent_is_unknown_where_it_is_in_the_image(tmp_path):
    image = np.full((2, 3, 4), 255, dtype=np.uint8)
    image[0, 1, 3] = 0  # in the upper row, which is the map's last one
    cv2.imwrite(str(tmp_path / "m.png"), image)
    (tmp_path / "m.yaml").write_text("image: m.png\nresolution: 0.1\norigin: [0, 0, 0]\n")
    assert read_map(tmp_path / "m.yaml").cells.tolist() == [[0, 0, 0], [0, -1, 0]]


@pytest.mark.parametrize("suffix", [".yaml", ".yml"])
@pytest.mark.parametrize("image", ["map.png", "map.pgm"])
def test_an_image_is_read_by_the_yaml_that_names_it(tmp_path, caplog, image, suffix):
    write_image(tmp_path / image, np.array([[60, 254]], dtype=np.uint8))
    described = (tmp_path / "map").with_suffix(suffix)
    described.write_text(f"image: {image}\nresolution: 0.2\norigin: [-1, 2, 0]\nnegate: 1\n")
    grid, by_yaml = read_map(tmp_path / image), read_map(described)
    assert (grid.resolution_m, grid.origin_m) == (0.2, (-1.0, 2.0))
    assert grid.cells.tolist() == by_yaml.cells.tolist() == [[-1, 100]]
    assert not caplog.records
    bare = read_map(tmp_path / image, resolution_m=0.1)
    assert (bare.resolution_m, bare.origin_m) == (0.1, (0.0, 0.0)) and bare.cells.tolist() == [[100, 0]]


def test_the_picture_of_a_map_beside_it_is_the_map(tmp_path, caplog):
    grid = OccupancyGrid(np.array([[0, 100], [-1, 0]], dtype=np.int8), 0.1, (-1.0, 2.0))
    write_map(tmp_path / "map.yaml", grid)
    write_image(tmp_path / "map.png", np.zeros((2, 2), dtype=np.uint8))
    read = read_map(tmp_path / "map.png")
    assert (read.resolution_m, read.origin_m) == (0.1, (-1.0, 2.0)) and np.array_equal(read.cells, grid.cells)
    write_image(tmp_path / "map.png", np.zeros((3, 2), dtype=np.uint8))
    assert read_map(tmp_path / "map.png").resolution_m == 0.05 and "no map.yaml beside it" in caplog.text


def test_an_image_of_its_name_in_another_folder_is_not_the_map(tmp_path, caplog):
    (tmp_path / "old").mkdir()
    for image in ("map.png", "old/map.pgm"):
        write_image(tmp_path / image, np.array([[0, 254]], dtype=np.uint8))
    (tmp_path / "map.yaml").write_text("image: old/map.pgm\nresolution: 0.2\norigin: [0, 0, 0]\n")
    assert read_map(tmp_path / "map.png").resolution_m == 0.05 and "no map.yaml beside it" in caplog.text


@pytest.mark.parametrize(
    "text", ["image: other.pgm\nresolution: 0.2\norigin: [0, 0, 0]\n", "just: this\n", "- : : [", "7"]
)
def test_a_yaml_that_does_not_name_the_image_is_not_its(tmp_path, caplog, text):
    for image in ("map.png", "other.pgm"):
        write_image(tmp_path / image, np.array([[0, 254]], dtype=np.uint8))
    (tmp_path / "map.yaml").write_text(text)
    assert read_map(tmp_path / "map.png").resolution_m == 0.05
    assert "no map.yaml beside it names this image; taking 0.05 m a cell" in caplog.text


def test_a_bare_image_takes_the_resolution_given(tmp_path, caplog):
    write_image(tmp_path / "m.png", np.array([[0, 255, 127]], dtype=np.uint8))
    grid = read_map(tmp_path / "m.png", resolution_m=0.1)
    assert grid.cells.tolist() == [[100, 0, -1]]
    assert grid.resolution_m == 0.1
    assert not caplog.records
    assert read_map(tmp_path / "m.png").resolution_m == 0.05
    assert "0.05 m a cell" in caplog.text


def test_npz_pairs(tmp_path):
    a, b = np.zeros((2, 3), dtype=np.int8), np.full((4, 1), 100, dtype=np.int8)
    np.savez(tmp_path / "p.npz", a=a, b=b, origin_a=[1.0, 2.0], origin_b=[0.0, 0.0], res=0.05)
    assert read_map(tmp_path / "p.npz").origin_m == (1.0, 2.0)
    np.testing.assert_array_equal(read_map(tmp_path / "p.npz", "b").cells, b)
    with pytest.raises(InputError, match="needs arrays c, origin_c, res"):
        read_map(tmp_path / "p.npz", "c")


def test_an_array_whose_header_does_not_end(tmp_path):
    header = io.BytesIO()
    np.save(header, np.zeros((2, 3), dtype=np.int8))
    with zipfile.ZipFile(tmp_path / "p.npz", "w") as archive:
        archive.writestr("a.npy", header.getvalue().replace(b"(2, 3)", b"(2, 3 "))
    with pytest.raises(InputError, match="not a readable"):
        read_map(tmp_path / "p.npz")


def test_a_member_that_is_no_array(tmp_path):
    np.savez(tmp_path / "p.npz", origin_a=[0.0, 0.0], res=0.05)
    with zipfile.ZipFile(tmp_path / "p.npz", "a") as archive:
        archive.writestr("a.npy", b"text")
    with pytest.raises(InputError, match="a is no array"):
        read_map(tmp_path / "p.npz")


GOOD = {"image": "m.png", "resolution": 0.05, "origin": [0.0, 0.0, 0.0]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"image": None}, "image"),
        ({"image": "gone.png"}, "gone.png' does not exist"),
        ({"image": "m" * 300}, "does not exist"),
        ({"image": "two\nlines.png"}, "lines.png' does not exist"),
        ({"image": 7}, "does not exist"),
        ({"image": "."}, "is not a file"),
        ({"resolution": None}, "needs the keys"),
        ({"resolution": "coarse"}, "must be numbers"),
        ({"resolution": -0.05}, "resolution must be in 0.001..100 m"),
        ({"resolution": [1]}, "must be numbers"),
        ({"origin": [0.0]}, "must be numbers"),
        ({"origin": 3}, "must be numbers"),
        ({"origin": [0.0, 0.0, 0.5]}, "its image is turned by 0.5 rad in its frame"),
        ({"origin": [1e9, 0.0, 0.5]}, "origin must be finite and within"),
        ({"origin": [0.0, 0.0, float("nan")]}, "origin"),
        ({"origin": [float("inf"), 0.0, 0.0]}, "origin must be finite"),
        ({"occupied_thresh": "high"}, "must be numbers"),
        ({"negate": "maybe"}, "must be numbers"),
        ({"occupied_thresh": float("nan")}, "thresh"),
        ({"occupied_thresh": 0.1, "free_thresh": 0.9}, "thresh"),
    ],
)
def test_broken_yaml_files_are_named_with_what_is_wrong(tmp_path, change, message):
    write_image(tmp_path / "m.png", np.zeros((2, 2), dtype=np.uint8))
    meta = {key: value for key, value in (GOOD | change).items() if value is not None}
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(meta))
    with pytest.raises(InputError, match=message) as caught:
        read_map(tmp_path / "m.yaml")
    assert "m.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "number",
    [1e300, -1e300, 1e-300, float("nan"), float("inf"), float("-inf"), 0, -1, 10**400],
    ids=lambda number: f"{number:.3}"[:9] if isinstance(number, float) else str(number)[:9],
)
@pytest.mark.parametrize("key", ["resolution", "x", "y", "yaw", "negate", "occupied_thresh", "free_thresh"])
def test_every_number_of_a_map_is_refused_or_works(tmp_path, key, number):
    write_image(tmp_path / "m.png", np.zeros((2, 2), dtype=np.uint8))
    origin = [number if key == axis else 0.0 for axis in ("x", "y", "yaw")]
    change = {"origin": origin} if key in ("x", "y", "yaw") else {key: number}
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(GOOD | change))
    try:
        grid = read_map(tmp_path / "m.yaml")
    except InputError as error:
        assert "m.yaml" in str(error) and "\n" not in str(error)
        return
    assert abs(number) <= 1 or key == "negate"  # nothing else takes a larger one
    assert grid.known_area_m2() >= 0.0 and TiledMap.from_grid(grid).to_grid().resolution_m == grid.resolution_m


@pytest.mark.parametrize(
    "content", [b"", b"just words", b"[1, 2", b"\xff\xfe\x00", b"- 1\n- 2\n", b"a: !!python/object:os.system x"]
)
def test_files_that_are_no_map_are_named(tmp_path, content):
    (tmp_path / "m.yaml").write_bytes(content)
    with pytest.raises(InputError, match=r"m\.yaml"):
        read_map(tmp_path / "m.yaml")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="no such map file"):
        read_map(tmp_path / "gone.yaml")
    with pytest.raises(InputError, match="is a folder, not a map file"):
        read_map(tmp_path)


@pytest.mark.parametrize(
    "arrays_",
    [
        {"a": np.zeros((2, 2), dtype=np.int8)},
        {"a": np.zeros((2, 2)), "origin_a": [0.0, 0.0], "res": 0.05},
        {"a": np.zeros((2, 2), dtype=np.int8), "origin_a": [0.0], "res": 0.05},
        {"a": np.zeros((2, 2), dtype=np.int8), "origin_a": [0.0, 0.0], "res": [0.05, 0.1]},
        {"a": np.zeros((2, 2), dtype=np.int8), "origin_a": ["x", "y"], "res": 0.05},
        {"a": np.array([{}], dtype=object), "origin_a": [0.0, 0.0], "res": 0.05},
        {"a": np.full((2, 2), 120, dtype=np.int8), "origin_a": [0.0, 0.0], "res": 0.05},
    ],
)
def test_broken_arrays_are_named(tmp_path, arrays_):
    np.savez(tmp_path / "p.npz", **arrays_)
    with pytest.raises(InputError):
        read_map(tmp_path / "p.npz")


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=200), st.sampled_from(["f.npz", "f.yaml", "f.pgm", "f.png"]))
def test_rubbish_raises_nothing_but_input_errors(tmp_path, content, name):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError):
        read_map(tmp_path / name)


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_archives_raise_nothing_but_input_errors(tmp_path, data):
    path = tmp_path / "p.npz"
    np.savez(path, a=np.zeros((4, 4), dtype=np.int8), origin_a=[0.0, 0.0], res=0.05)
    raw = bytearray(path.read_bytes())
    raw[data.draw(st.integers(0, len(raw) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(bytes(raw[: data.draw(st.integers(0, len(raw)))]))
    with contextlib.suppress(InputError):
        read_map(path)


@pytest.mark.parametrize("name", ["floor #2", "r1: kitchen", "@home", "[a]", "\U0001f916", "it's", "plan 9"])
def test_a_map_of_any_name_is_read_again(tmp_path, name):
    grid = OccupancyGrid(np.zeros((2, 3), dtype=np.int8), 0.05)
    write_map(tmp_path / f"{name}.yaml", grid)
    assert read_map(tmp_path / f"{name}.yaml").shape == (2, 3)


@pytest.mark.parametrize("value", ["2001-99-99", "0x_", "!!int x", "!!bool x", "!!timestamp x"])
def test_odd_yaml_values_are_named(tmp_path, value):
    (tmp_path / "map.yaml").write_text(f"image: map.pgm\nresolution: {value}\norigin: [0, 0, 0]\n")
    with pytest.raises(InputError, match=r"map\.yaml"):
        read_map(tmp_path / "map.yaml")


def test_endings_in_capitals_are_read(tmp_path):
    write_map(tmp_path / "map.yaml", OccupancyGrid(np.zeros((1, 2), np.int8), 0.1))
    (tmp_path / "map.yaml").rename(tmp_path / "MAP.YAML")
    assert read_map(tmp_path / "MAP.YAML").resolution_m == 0.1


def test_an_image_turned_by_a_rounding_error_is_not_turned(tmp_path):
    write_map(tmp_path / "map.yaml", OccupancyGrid(np.zeros((1, 2), np.int8), 0.1, (1.0, 2.0)))
    meta = yaml.safe_load((tmp_path / "map.yaml").read_text())
    (tmp_path / "map.yaml").write_text(yaml.safe_dump({**meta, "origin": [1.0, 2.0, -1e-7]}))
    assert read_map(tmp_path / "map.yaml").origin_m == (1.0, 2.0)


def test_arrays_that_are_no_cells_are_not_taken_for_some(tmp_path):
    np.savez(tmp_path / "m.npz", a=np.array([[0, 100, 255]], np.uint8), origin_a=np.zeros(2), res=0.05)
    with pytest.raises(InputError, match=r"a must be int8 .*, got uint8"):
        read_map(tmp_path / "m.npz")


def test_a_bare_image_has_a_wall_where_grids_have_one(tmp_path):
    write_image(tmp_path / "m.png", np.array([[102, 90, 88, 0]], np.uint8))  # 60, 65, 65 and 100 percent
    assert read_map(tmp_path / "m.png", resolution_m=0.05).cells.tolist() == [[-1, -1, 100, 100]]


def test_in_proportion_a_savers_unknown_is_a_share(tmp_path):
    cells = read_as(tmp_path, np.array([[254, 205, 0]], np.uint8), mode="scale")
    assert cells == [[0, 0, 100]]


def test_the_yaml_that_is_passed_over_is_named(tmp_path, caplog):
    write_map(tmp_path / "map.yaml", OccupancyGrid(np.zeros((1, 2), np.int8), 0.1))
    assert read_map(tmp_path / "map.pgm", resolution_m=0.2).resolution_m == 0.2
    assert "map.yaml" in caplog.text and "passed over" in caplog.text


class Rogue:
    """An object whose reading writes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (self.path, "w")


def test_nothing_is_run_that_an_archive_holds(tmp_path):
    rogue = np.array([[Rogue(str(tmp_path / "written"))]], dtype=object)
    np.savez(tmp_path / "m.npz", a=rogue, origin_a=np.zeros(2), res=0.05)
    with pytest.raises(InputError, match="not a readable"):
        read_map(tmp_path / "m.npz")
    assert not (tmp_path / "written").exists()
