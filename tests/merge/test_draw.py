from dataclasses import replace

import numpy as np
import pytest

from mrslam.merge import Bend, TeamMap, TeamMapper
from mrslam.merge.draw import FREE_TINT, INK, PALETTE, PAPER, WALL_SHADE, colours, draw_team, laid, overlaid
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, UNKNOWN, OccupancyGrid, se2
from mrslam.spatial.tiles import assembled
from tests.merge.plans import alignment


def room(left: int, right: int) -> OccupancyGrid:
    """Return a strip of free space with a wall along its bottom."""
    cells = np.full((20, 40), UNKNOWN, dtype=np.int8)
    cells[:, left:right] = 0
    cells[0:2, left:right] = 100
    return OccupancyGrid(cells, 0.1)


LAYERS = {"r1": room(0, 25), "r2": room(15, 40)}


@pytest.fixture
def team_map() -> TeamMap:
    mapper = TeamMapper("r1")
    for robot_id, grid in LAYERS.items():
        mapper.set_map(robot_id, grid)
    mapper.set_map("r3", room(0, 5))
    return mapper.team_map({("r1", "r2"): alignment(se2.IDENTITY)})


def plain(team_map, **options):
    return draw_team(team_map, LAYERS, legend=False, size_px=40, **options)


def is_near(pixel, colour, share):
    wanted = 255 * (1 - share) + share * np.asarray(colour, dtype=float)
    return np.abs(pixel.astype(float) - wanted).max() < 3


def test_free_space_is_tinted_by_who_saw_it_and_the_first_row_is_on_top(team_map):
    picture = plain(team_map)[24:-24, 24:-24]
    assert picture.shape == (20, 40, 3)
    assert picture.dtype == np.uint8
    assert is_near(picture[5, 5], PALETTE[0], 0.22)
    assert is_near(picture[5, 35], PALETTE[1], 0.22)
    assert is_near(picture[5, 20], np.mean([PALETTE[0], PALETTE[1]], axis=0), 0.22)
    assert picture[-1, 5].sum() < 0.8 * sum(PALETTE[0])  # the wall at y = 0 is at the bottom


def twin_of_painted(grid: OccupancyGrid, layers: dict[str, OccupancyGrid]) -> np.ndarray:
    """Return the picture cell by cell, first row on top."""
    hue = colours(list(layers))
    picture = np.empty((*grid.shape, 3), dtype=np.uint8)
    for (r, c), value in np.ndenumerate(grid.cells):
        seen = {}
        for robot, layer in layers.items():
            row, col = np.add((r, c), grid.cell0) - layer.cell0
            if 0 <= row < layer.shape[0] and 0 <= col < layer.shape[1]:
                seen[robot] = layer.cells[row, col]
        walls = [hue[robot] for robot, cell in seen.items() if cell >= OCCUPIED_MIN]
        known = walls + [hue[robot] for robot, cell in seen.items() if 0 <= cell <= FREE_MAX]
        tint = np.mean(known, axis=0) if known else np.zeros(3)
        if value < 0:
            colour = np.array(PAPER)
        elif value >= OCCUPIED_MIN:
            colour = WALL_SHADE * (np.mean(walls, axis=0) if walls else np.array(INK))
        else:
            share = FREE_TINT if value <= FREE_MAX else 0.65
            colour = 255 * (1 - share) + share * tint
        picture[r, c] = np.rint(colour)
    return picture[::-1]


@pytest.mark.parametrize(("rows", "cols", "row0", "col0"), [(30, 40, -4, 3), (140, 200, -70, -1), (5, 7, 64, 63)])
def test_every_cell_has_the_colour_of_those_who_saw_it_also_where_layers_reach_beyond_the_map(
    rows: int, cols: int, row0: int, col0: int
) -> None:
    rng = np.random.default_rng(0)

    def grid(rows: int, cols: int, row0: int, col0: int) -> OccupancyGrid:
        cells = rng.choice(np.array([UNKNOWN, 0, 20, 50, 70, 100], dtype=np.int8), (rows, cols))
        return OccupancyGrid.at_cell(cells, 0.1, row0, col0)

    fused = grid(rows, cols, row0, col0)
    layers = {"r1": grid(30, 60, -10, -5), "r2": grid(80, 92, 8, 9), "r3": grid(20, 20, 15, 30)}
    placed = dict.fromkeys(layers, se2.IDENTITY)
    team = TeamMap(anchor="r1", T_team_map=placed, grid=fused)
    picture = draw_team(team, layers, legend=False, size_px=max(rows, cols))[24:-24, 24:-24]
    assert np.abs(picture.astype(int) - twin_of_painted(fused, layers)).max() <= 1  # float32, rounded


def test_unknown_is_paper(team_map):
    picture = plain(team_map)
    assert (picture[0, 0] == PAPER).all()
    layers = {"r1": OccupancyGrid(np.array([[0, -1, 0]], dtype=np.int8), 0.1)}
    mapper = TeamMapper("r1")
    mapper.set_map("r1", layers["r1"])
    middle = draw_team(mapper.team_map({}), layers, legend=False, size_px=3)[24:-24, 24:-24]
    assert (middle[0, 1] == PAPER).all()
    assert not (middle[0, 0] == PAPER).all()


def test_trajectories_are_drawn_where_the_robots_drove(team_map):
    way = np.stack([np.linspace(0.5, 1.5, 20), np.full(20, 1.0), np.zeros(20)], axis=-1)
    without, with_way = (
        draw_team(team_map, LAYERS, t, legend=False, size_px=400) for t in (None, {"r1": way, "r3": way})
    )
    changed = np.argwhere((without != with_way).any(axis=2))
    assert len(changed) > 50
    row, col = changed.mean(axis=0) - 24
    assert abs(col - 100) < 12
    assert abs(row - 100) < 12
    assert changed[:, 1].min() - 24 > 30
    assert changed[:, 1].max() - 24 < 175


def test_the_legend_names_everyone(team_map):
    bare = draw_team(team_map, LAYERS, legend=False, size_px=600)
    full = draw_team(team_map, LAYERS, size_px=600)
    strip = full[bare.shape[0] :]
    assert strip.shape[0] > 40
    for robot_id, colour in colours(list(LAYERS)).items():
        assert (strip == colour).all(axis=2).any(), robot_id
    assert (np.abs(strip.astype(int) - INK).max(axis=2) < 10).any()


def test_sizes_and_empty_maps(team_map):
    assert max(plain(team_map).shape) == 40 + 48
    assert draw_team(team_map, LAYERS, size_px=1000, legend=False).shape[1] == 1000 + 48
    nothing = draw_team(TeamMapper("r1").team_map({}), {})
    assert nothing.ndim == 3


def test_the_same_team_gives_the_same_picture(team_map):
    assert draw_team(team_map, LAYERS).tobytes() == draw_team(team_map, dict(reversed(LAYERS.items()))).tobytes()


def test_bent_maps_are_laid_bent_and_the_overlay_shows_them_as_they_were(team_map):
    keys = np.stack([np.linspace(1.5, 4.0, 11), np.full(11, 1.0), np.zeros(11)], axis=1)
    bend = Bend(keys, keys + np.linspace(0.0, 0.5, 11)[:, None] * np.array([0.0, 1.0, 0.0]))
    bent = replace(team_map, bends={"r2": bend}, T_team_map={**team_map.T_team_map, "r2": bend.T_team_map_now})

    def walls_m(shown: TeamMap) -> tuple[float, float]:
        layer = assembled(laid(shown, LAYERS)["r2"], shown.grid.resolution_m)
        y = layer.centres(layer.is_occupied)[:, 1]
        return float(y.min()), float(y.max())

    overlay = overlaid(bent, LAYERS)
    assert walls_m(bent)[0] < 0.3 and walls_m(bent)[1] > 0.4
    assert walls_m(overlay) == pytest.approx((0.05, 0.15))
    assert overlay.grid.is_occupied.sum() == team_map.grid.is_occupied.sum()


def test_pictures_show_the_tiles_that_were_fused_and_the_overlay_its_own(team_map):
    assert draw_team(team_map, LAYERS).tobytes() == draw_team(replace(team_map, layers={}), LAYERS).tobytes()
    keys = np.stack([np.linspace(1.5, 4.0, 11), np.full(11, 1.0), np.zeros(11)], axis=1)
    bend = Bend(keys, keys + np.array([0.0, 0.5, 0.0]))
    bent = replace(team_map, bends={"r2": bend}, layers={})
    bent = replace(bent, layers=laid(bent, LAYERS))
    overlay = overlaid(bent, LAYERS)
    assert plain(overlay).tobytes() == plain(replace(overlay, layers={})).tobytes()
    assert plain(overlay).tobytes() != plain(replace(overlay, layers=bent.layers)).tobytes()


def test_the_legend_says_who_is_not_placed(team_map):
    assert list(team_map.unplaced) == ["r3"]
    told, all_placed = (draw_team(one, LAYERS) for one in (team_map, replace(team_map, unplaced={})))
    assert told.shape != all_placed.shape or (told != all_placed).any()


@pytest.mark.parametrize(("resolution_m", "bar_m"), [(0.1, 0.5), (0.2, 1.0), (0.4, 2.0), (1.0, 5.0), (2.0, 10.0)])
def test_the_scale_bar_is_the_longest_round_length_that_fits(resolution_m, bar_m):
    mapper = TeamMapper("r1")
    layers = {"r1": replace(LAYERS["r1"], resolution_m=resolution_m)}
    mapper.set_map("r1", layers["r1"])
    picture = draw_team(mapper.team_map({}), layers, size_px=1000)
    px_per_m = 1000 / (25 * resolution_m)
    bar = (np.abs(picture[-16].astype(int) - INK).max(axis=1) < 10)[24:]
    assert np.argmin(bar) == pytest.approx(bar_m * px_per_m, abs=3.0)


def test_a_legend_too_long_for_a_line_is_continued_on_the_next(team_map):
    names = [f"robot-of-a-long-name-{k}" for k in range(9)]
    everyone = replace(team_map, T_team_map=dict.fromkeys(names, se2.IDENTITY))
    layers = dict.fromkeys(names, LAYERS["r1"])
    bare = draw_team(everyone, layers, legend=False, size_px=400)
    strip = draw_team(everyone, layers, size_px=400)[bare.shape[0] :]
    for name, colour in colours(names).items():
        assert np.count_nonzero((strip == colour).all(axis=2)) > 100, name
