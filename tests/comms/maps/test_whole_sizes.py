"""What maps cost whole: measured band by band, as one block would be."""

import lz4.block
import numpy as np
import pytest

from mrslam.comms.maps import whole_sizes
from mrslam.comms.maps.whole_sizes import WholeSizes
from mrslam.spatial import OccupancyGrid, TiledMap


def office(rows: int = 700, cols: int = 900, seed: int = 1) -> np.ndarray:
    """Rooms of 100 x 150 cells with walls, unknown around them, and noise: most of it in the first 22 rows."""
    rng = np.random.default_rng(seed)
    cells = np.full((rows, cols), -1, dtype=np.int8)
    cells[40 : rows - 50, 30 : cols - 70] = 0
    cells[40 : rows - 50 : 100, 30 : cols - 70] = cells[40 : rows - 50, 30 : cols - 70 : 150] = 100
    cells[rng.random(cells.shape) < 0.02] = 25
    cells[:22], cells[22:40] = rng.choice(np.array([0, 100], dtype=np.int8), (22, cols)), -1
    return cells


def tiled(cells: np.ndarray) -> TiledMap:
    return TiledMap.from_grid(OccupancyGrid.at_cell(cells, 0.05, -150, 77))


def test_bands_are_as_large_as_the_whole_cropped_grid() -> None:
    known = tiled(office())
    lz4_bytes, raw_bytes = WholeSizes().of("r1", known)
    grid = known.to_grid()
    assert raw_bytes == grid.cells.size
    whole = len(lz4.block.compress(grid.cells.tobytes(), store_size=False))
    assert lz4_bytes == pytest.approx(whole, rel=0.01)


def test_a_size_does_not_depend_on_what_was_measured_before(monkeypatch: pytest.MonkeyPatch) -> None:
    cells, sizes, compressed = office(), WholeSizes(), []
    real = whole_sizes.lz4_bytes
    monkeypatch.setattr(whole_sizes, "lz4_bytes", lambda band: compressed.append(band.shape) or real(band))
    first = tiled(cells)
    sizes.of("r1", first)
    bands, changed = len(compressed), {**first.tiles}
    cells[300:310, 400:410] = 75
    place = max(set(changed), key=lambda index: (changed[index].cells != tiled(cells).tiles[index].cells).sum())
    changed[place] = tiled(cells).tiles[place]
    grown = TiledMap(0.05, changed, 2)
    assert sizes.of("r1", grown) == WholeSizes().of("r1", grown)
    assert len(compressed) == bands + 1 + bands  # the one band that changed; then all for the second measure
    narrower = TiledMap(0.05, {index: tile for index, tile in changed.items() if index[1] < 8}, 3)
    assert sizes.of("r1", narrower) == WholeSizes().of("r1", narrower)
    assert sizes.of("r2", first) == WholeSizes().of("r2", first)


def test_nothing_costs_nothing() -> None:
    assert WholeSizes().of("r1", TiledMap(0.05)) == (0, 0)
