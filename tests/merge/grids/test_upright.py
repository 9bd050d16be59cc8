import numpy as np
import pytest

from mrslam.merge import warp
from mrslam.merge.grids.upright import read_upright
from mrslam.spatial import OccupancyGrid, se2, write_map


def turned_file(path, yaw: float):
    """Write a map with a wall along +x of its image, turned by ``yaw`` about the image's corner at (1, 2)."""
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[10, 5:50] = 100
    write_map(path, OccupancyGrid(cells, 0.05, (1.0, 2.0)))
    text = path.read_text()
    assert "origin: [1.000000, 2.000000, 0.0]" in text
    path.write_text(text.replace("2.000000, 0.0]", f"2.000000, {yaw}]"))
    return OccupancyGrid(cells, 0.05, (0.0, 0.0))


@pytest.mark.parametrize("yaw", [0.3, -1.2, np.pi / 2])
def test_a_turned_image_is_read_into_its_maps_frame(tmp_path, yaw):
    image = turned_file(tmp_path / "m.yaml", yaw)
    read = read_upright(tmp_path / "m.yaml")
    wanted = warp(image, se2.transform(1.0, 2.0, yaw))
    assert read.origin_m == wanted.origin_m
    np.testing.assert_array_equal(read.cells, wanted.cells)
    walls = read.centres(read.is_occupied)
    start, end = se2.apply(se2.transform(1.0, 2.0, yaw), np.array([[0.275, 0.525], [2.475, 0.525]]))
    for corner in (start, end):
        assert np.hypot(*(walls - corner).T).min() < 0.08


def test_an_image_that_is_not_turned_is_read_as_it_is(tmp_path):
    turned_file(tmp_path / "m.yaml", 0.0)
    assert read_upright(tmp_path / "m.yaml").origin_m == (1.0, 2.0)


def test_the_map_asked_for_is_read_from_a_pair_and_an_image_at_the_resolution_asked_for(tmp_path):
    one, two = np.zeros((4, 5), dtype=np.int8), np.full((6, 7), 100, dtype=np.int8)
    np.savez(tmp_path / "pair.npz", a=one, origin_a=(0.0, 0.0), b=two, origin_b=(1.0, 2.0), res=0.1)
    assert read_upright(tmp_path / "pair.npz").shape == (4, 5)
    read = read_upright(tmp_path / "pair.npz", "b")
    assert read.shape == (6, 7) and read.origin_m == (1.0, 2.0)
    turned_file(tmp_path / "m.yaml", 0.3)
    bare = read_upright(tmp_path / "m.pgm", resolution_m=0.02)  # the YAML, with its yaw, is passed over
    assert bare.resolution_m == 0.02 and bare.shape == (40, 60) and bare.origin_m == (0.0, 0.0)
