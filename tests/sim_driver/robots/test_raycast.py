import threading

import numpy as np
import pytest

from mrslam.sim_driver.robots.raycast import cast, cast_discs, leap_field
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial.distance import euclidean


def naive(is_wall, x, y, angle, limit):
    """The nearest crossing of a beam with the square of any wall cell, by the slab test on all of them."""
    rows, cols = np.nonzero(is_wall)
    dx, dy = np.cos(angle), np.sin(angle)
    with np.errstate(divide="ignore", invalid="ignore"):
        tx = np.sort(np.stack([(cols - x) / dx, (cols + 1 - x) / dx]), axis=0)
        ty = np.sort(np.stack([(rows - y) / dy, (rows + 1 - y) / dy]), axis=0)
    near, far = np.maximum(tx[0], ty[0]), np.minimum(tx[1], ty[1])
    hits = near[(near < far) & (near >= 0)]
    return hits.min() if hits.size and hits.min() < limit else np.inf


@pytest.mark.parametrize("name", ["arena1", "arena2", "office:5"])
def test_equals_the_slab_test(name):
    world, rng = load_world(name), np.random.default_rng(1)
    leap = leap_field(world.clearance_cells)
    step = 2 * np.pi / 24
    for _ in range(12):
        x, y = world.free_start(rng)[:2] / world.resolution_m + rng.uniform(-0.5, 0.5, 2)
        heading = rng.uniform(-np.pi, np.pi)
        out = np.empty(24, dtype=np.float32)
        cast(leap, x, y, heading, -np.pi, step, 90.0, out)
        expected = [naive(world.is_wall, x, y, heading - np.pi + i * step, 90.0) for i in range(24)]
        assert np.isfinite(out).sum() > 6
        assert np.allclose(out, expected, atol=1e-3)


def test_axis_parallel_beams_and_noise_worlds():
    rng = np.random.default_rng(0)
    walls = rng.random((60, 80)) < 0.04
    walls[[0, -1]] = True
    walls[:, [0, -1]] = True
    leap = leap_field(euclidean(walls))
    for row, col in rng.permutation(np.argwhere(~walls))[:60]:
        out = np.empty(4, dtype=np.float32)
        cast(leap, col + 0.5, row + 0.5, 0.0, 0.0, np.pi / 2, 500.0, out)
        right = np.flatnonzero(walls[row, col:])[0] - 0.5
        up = np.flatnonzero(walls[row:, col])[0] - 0.5
        left = np.flatnonzero(walls[row, : col + 1][::-1])[0] - 0.5
        down = np.flatnonzero(walls[: row + 1, col][::-1])[0] - 0.5
        assert np.allclose(out, [right, up, left, down], atol=1e-4)


@pytest.mark.parametrize("name", ["arena1", "arena2"])
def test_beams_along_the_edges_of_cells_end(name):
    """From where people put robots, on round numbers, beams run along edges: neither cell beside is the right one."""
    world = load_world(name)
    leap, scale = leap_field(world.clearance_cells), 1.0 / world.resolution_m
    points = [
        (x, y)
        for x in np.round(np.arange(0.1, world.size_m[0], 0.1), 1)
        for y in np.round(np.arange(0.1, world.size_m[1], 0.1), 1)
        if world.clearance_m((x, y)) > 0.2
    ]
    headings = (0.0, np.pi / 2, np.pi)
    out = np.empty((len(points), len(headings), 360), dtype=np.float32)

    def look():
        for i, (x, y) in enumerate(points):
            for k, heading in enumerate(headings):
                cast(leap, x * scale, y * scale, heading, -np.pi, np.pi / 180, 600.0, out[i, k])

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    thread.join(timeout=60.0)
    assert not thread.is_alive()
    assert np.isfinite(out).all()
    for i in np.random.default_rng(2).integers(len(points), size=6):
        x, y = points[i][0] * scale, points[i][1] * scale
        ahead = [naive(world.is_wall, x, y + off, 0.0, 600.0) for off in (-1e-6, 1e-6)]
        assert min(abs(out[i, 0, 180] - one) for one in ahead) < 1e-3


def test_a_leap_never_passes_a_wall():
    walls = np.random.default_rng(3).random((40, 40)) < 0.02
    leap = leap_field(euclidean(walls))
    rows, cols = np.nonzero(walls)
    for r, c in np.argwhere(leap >= 2):
        # From the worst corner of the cell to the nearest point of any wall cell.
        gap = np.hypot(np.maximum(np.abs(rows - r) - 1, 0), np.maximum(np.abs(cols - c) - 1, 0)).min()
        assert leap[r, c] <= gap + 1e-6


def test_outside_and_inside_walls():
    walls = np.ones((5, 5), dtype=bool)
    leap = leap_field(euclidean(walls))
    out = np.empty(3, dtype=np.float32)
    cast(leap, 2.5, 2.5, 0.0, 0.0, 1.0, 50.0, out)
    assert (out == 0.0).all()
    cast(leap, -20.0, 300.0, 0.0, 0.0, 1.0, 50.0, out)
    assert np.isposinf(out).all()


def test_discs_against_points_on_their_edge():
    centres, radii = np.array([[2.0, 1.0], [4.0, 2.0], [-3.0, 0.0]]), np.array([0.3, 0.5, 0.4])
    ranges = np.full(720, 10.0, dtype=np.float32)
    cast_discs(0.1, -0.2, 0.3, -np.pi, np.pi / 360, centres, radii, ranges)
    hit = ranges < 10.0
    assert 20 < hit.sum() < 200
    angles = 0.3 - np.pi + np.arange(720) * np.pi / 360
    ends = np.array([0.1, -0.2]) + ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    on_edge = np.abs(np.linalg.norm(ends[:, None] - centres[None], axis=-1) - radii[None]).min(axis=1)
    assert on_edge[hit].max() < 1e-4
    # Every beam whose line passes a centre within its radius, ahead, is shortened.
    along = (centres[None, :, 0] - 0.1) * np.cos(angles)[:, None] + (centres[None, :, 1] + 0.2) * np.sin(angles)[
        :, None
    ]
    aside = np.linalg.norm(centres - [0.1, -0.2], axis=1) ** 2 - along**2
    assert np.array_equal(hit, ((along > 0) & (aside < radii**2)).any(axis=1))


def test_walls_hide_discs_and_a_disc_around_the_laser_is_not_seen():
    ranges = np.full(4, 1.0, dtype=np.float32)
    cast_discs(0.0, 0.0, 0.0, 0.0, np.pi / 2, np.array([[3.0, 0.0], [0.0, 0.1]]), np.array([0.5, 0.3]), ranges)
    assert (ranges == 1.0).all()
