"""SURF's loops against slow, obvious twins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment.kernels import surf


@pytest.fixture(scope="module")
def image():
    rng = np.random.default_rng(3)
    return np.kron(rng.random((9, 11)), np.ones((8, 8))) + 0.1 * rng.random((72, 88))


@pytest.fixture(scope="module")
def ii(image):
    return np.pad(image.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))


def filters(size):
    """Return the masks Dxx, Dyy, Dxy as Bay et al. draw them (figure 2): bands and blocks of one third of the size."""
    lobe, middle = size // 3, size // 2
    dxx, dxy = np.zeros((size, size)), np.zeros((size, size))
    dxx[middle - lobe + 1 : middle + lobe] = np.repeat([1.0, -2.0, 1.0], lobe)
    for rows, cols, value in (
        (slice(middle - lobe, middle), slice(middle + 1, middle + 1 + lobe), 1.0),
        (slice(middle + 1, middle + 1 + lobe), slice(middle - lobe, middle), 1.0),
        (slice(middle - lobe, middle), slice(middle - lobe, middle), -1.0),
        (slice(middle + 1, middle + 1 + lobe), slice(middle + 1, middle + 1 + lobe), -1.0),
    ):
        dxy[rows, cols] = value
    return dxx, dxx.T, dxy


@pytest.mark.parametrize(("size", "step"), [(9, 1), (15, 1), (27, 2), (51, 4)])
def test_determinant_and_sign_like_convolving(image, ii, size, step):
    determinant, positive = surf.hessian(ii, size, step)
    inside = 0
    for i in range(determinant.shape[0]):
        for j in range(determinant.shape[1]):
            r, c = i * step - size // 2, j * step - size // 2
            if r < 0 or c < 0 or r + size > image.shape[0] or c + size > image.shape[1]:
                assert determinant[i, j] == 0.0
                continue
            window = image[r : r + size, c : c + size]
            dxx, dyy, dxy = ((window * mask).sum() / size**2 for mask in filters(size))
            assert determinant[i, j] == pytest.approx(dxx * dyy - (0.9 * dxy) ** 2, abs=1e-9)
            assert positive[i, j] == (dxx + dyy > 0)
            inside += 1
    assert inside > 40 and 0 < positive.sum() < inside


def test_extrema_like_looking_at_all_neighbours():
    grid = np.random.default_rng(0).random((6, 100, 110))
    smooth = sum(np.roll(grid, (i, j, k), (0, 1, 2)) for i in (0, 1) for j in (0, 1, 2) for k in (0, 1, 2))
    layers = np.ascontiguousarray(smooth[2:5])
    out = np.empty((500, 4))
    found = out[: surf.extrema(*layers, 8.0, out)]
    expected, away = [], []
    for r in range(1, 99):
        for c in range(1, 109):
            cube = layers[:, r - 1 : r + 2, c - 1 : c + 2]
            if cube[1, 1, 1] < 8.0 or cube[1, 1, 1] < cube.max():
                continue
            steps = np.eye(3, dtype=int)
            value = lambda d, cube=cube: cube[tuple(1 + d)]  # noqa: E731
            g = np.array([0.5 * (value(d) - value(-d)) for d in steps])
            H = np.array(
                [
                    [
                        value(d) + value(-d) - 2 * value(0 * d)
                        if (d == e).all()
                        else 0.25 * (value(d + e) - value(d - e) - value(e - d) + value(-d - e))
                        for e in steps
                    ]
                    for d in steps
                ]
            )
            top = -np.linalg.solve(H, g)
            away.append(np.abs(top).max())
            if away[-1] <= 1.0:
                expected.append([c + top[2], r + top[1], top[0], value(steps[0] * 0) + 0.5 * g @ top])
    assert len(expected) > 5
    assert any(0.5 < one < 0.8 for one in away) and any(1.2 < one < 2.0 for one in away)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_quadratic_has_its_top_found_exactly():
    top = np.array([7.3, 5.8, 0.4])
    layer, row, col = np.meshgrid(np.arange(-1, 2), np.arange(12), np.arange(14), indexing="ij")
    x, y, s = col - top[0], row - top[1], layer - top[2]
    cube = 5.0 - x**2 - 2.0 * y**2 - 0.7 * s**2 - 0.4 * x * y + 0.3 * x * s - 0.2 * y * s
    out = np.empty((10, 4))
    assert surf.extrema(*cube, 1.0, out) == 1
    np.testing.assert_allclose(out[0], [*top, 5.0], atol=1e-9)


def peak(*tops):
    """Return three layers with one sample higher than all about it in each, None for a layer without."""
    layers = np.zeros((3, 5, 5))
    for layer, top in zip(layers, tops, strict=True):
        layer[2, 2] = 0.0 if top is None else top
    return layers


@pytest.mark.parametrize(
    ("tops", "count"), [((0.5, 2.0, None), 1), ((2.0, 2.0, None), 0), ((None, 2.0, 2.0), 0), ((None, 2.0, 3.0), 0)]
)
def test_a_maximum_is_that_of_one_layer(tops, count):
    assert surf.extrema(*peak(*tops), 1.0, np.empty((10, 4))) == count


def test_where_nothing_rises_or_falls_there_is_no_top():
    assert not surf.top_of_quadratic(np.zeros(3), np.zeros((3, 3)), np.empty(3))
    assert surf.extrema(np.zeros((5, 5)), np.ones((5, 5)), np.zeros((5, 5)), 0.5, np.empty((10, 4))) == 0


def test_no_more_maxima_are_written_than_there_is_room_for():
    layers = np.zeros((3, 20, 20))
    layers[1, 2::4, 2::4] = 1.0
    out = np.full((8, 4), -1.0)
    assert surf.extrema(*layers, 0.5, out[:6]) == 6
    assert (out[:6] >= 0.0).all() and (out[6:] == -1.0).all()


def wavelet(image, x, y, half):
    """Return the two Haar wavelets about a point; what lies outside of the image counts nothing."""
    r, c = round(y), round(x)
    dx = dy = 0.0
    for i in range(r - half, r + half):
        for j in range(c - half, c + half):
            if 0 <= i < image.shape[0] and 0 <= j < image.shape[1]:
                dx += image[i, j] if j >= c else -image[i, j]
                dy += image[i, j] if i >= r else -image[i, j]
    return np.array([dx, dy])


def descriptor_twin(image, x, y, s):
    """Return direction and descriptor of one key point, by the book."""
    samples = []
    for i in range(-6, 7):
        for j in range(-6, 7):
            if i**2 + j**2 < 36:
                answer = wavelet(image, x + i * s, y + j * s, max(1, round(2 * s)))
                samples.append((math.atan2(answer[1], answer[0]), math.exp(-(i**2 + j**2) / 12.5) * answer))
    sums = []
    for k in range(42):
        middle = -math.pi + 0.15 * k
        near = [v for angle, v in samples if abs(math.remainder(angle - middle, 2 * math.pi)) < math.pi / 6]
        sums.append(np.sum(near, axis=0) if near else np.zeros(2))
    x_sum, y_sum = max(sums, key=lambda v: v @ v)
    turn = math.atan2(y_sum, x_sum)
    R = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    numbers = []
    for bi in range(4):
        for bj in range(4):
            total = np.zeros(4)
            for i in range(-1, 7):
                for j in range(-1, 7):
                    at = np.array([x, y]) + R @ np.array([bj * 5 + j - 9.5, bi * 5 + i - 9.5]) * s
                    d = R.T @ wavelet(image, *at, max(1, round(s))) * math.exp(-((i - 2) ** 2 + (j - 2) ** 2) / 12.5)
                    total += [*d, *np.abs(d)]
            numbers += list(total * math.exp(-((bi - 1.5) ** 2 + (bj - 1.5) ** 2) / 4.5))
    return turn, np.array(numbers) / np.linalg.norm(numbers)


@pytest.mark.parametrize(("x", "y", "s"), [(40.3, 30.8, 1.2), (50.0, 41.6, 2.7), (12.2, 60.9, 1.9)])
def test_direction_and_descriptor_like_the_twin(image, ii, x, y, s):
    turn, numbers = descriptor_twin(image, x, y, s)
    out = np.zeros((1, 64), dtype=np.float32)
    surf.describe(ii, np.array([[x, y]]), np.array([s]), out)
    assert surf.orientation(ii, x, y, s) == pytest.approx(turn, abs=1e-9)
    np.testing.assert_allclose(out[0], numbers, atol=1e-5)
