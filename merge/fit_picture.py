"""How two maps fit as a picture: the best place, a rival where there is one, and what contradicts at each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment import Alignment, AlignmentConfig, Rejection
from mrslam.alignment.kernels.agreement import CONTRADICTED, MATCHED
from mrslam.alignment.prepared import PreparedMap, main_part, prepare, working_resolution
from mrslam.alignment.verification.bending import bend, straight
from mrslam.alignment.verification.verify import judge_walls
from mrslam.merge.draw import INK, PALETTE, PAPER
from mrslam.merge.picture_key import KEY_PX, key_strip
from mrslam.spatial import OccupancyGrid, se2
from mrslam.spatial.se2 import Transform

FLOOR, ONE_ONLY = (255, 255, 255), (226, 226, 222)
"""RGB of floor that both maps know as free, and of what one knows."""
OF_A, OF_B, AGAINST = PALETTE[0], PALETTE[1], (214, 39, 40)
"""RGB of walls that one map has and the other does not know, and of walls where the other map is free."""
MARGIN_CELLS = 10
LEAST_PX, MOST_PX = 800, 2400
"""The longer side of a panel: small ones are enlarged to about the first, larger ones shrunk to the second, pixels."""
LINE_PX = 24
CAPTION_PX = LINE_PX + KEY_PX
"""Height of the line of text below a panel, and of that with the key, pixels."""
KEY = (("agree", INK), ("a only", OF_A), ("b only", OF_B), ("contradict", AGAINST))


def draw_fit(
    a: OccupancyGrid, b: OccupancyGrid, outcome: Alignment | Rejection, config: AlignmentConfig | None = None
) -> NDArray[np.uint8] | None:
    """Return the picture ``(H, W, 3) uint8`` RGB, first row on top, in map a's frame; None where no place was found.

    The first panel is the best place, the second its nearest rival where the answer is ambiguous. Walls on which both
    maps agree are black, walls where the other map is free red, walls that only one knows in its colour.
    """
    if outcome.T_a_b is None or outcome.evidence is None:
        return None
    verdict = "accepted" if isinstance(outcome, Alignment) else "ambiguous" if outcome.ambiguous else "rejected"
    places = [(outcome.T_a_b, verdict)]
    if isinstance(outcome, Rejection) and outcome.ambiguous:
        places.append((outcome.rivals[0], "its rival"))
    return draw_places(a, b, places, config, is_bent=outcome.evidence.bent_m > 0.0)


def draw_places(
    a: OccupancyGrid,
    b: OccupancyGrid,
    places: Sequence[tuple[Transform, str]],
    config: AlignmentConfig | None = None,
    *,
    is_bent: bool = False,
) -> NDArray[np.uint8]:
    """Return places ``T_a_b (3,)`` with their captions, beside each other: ``(H, W, 3) uint8`` RGB, first row on top.

    Colours are those of :func:`draw_fit`. Map b is bent first where ``is_bent``.
    """
    config = config or AlignmentConfig()
    one, two = main_part(a.cropped()), main_part(b.cropped())
    res = working_resolution(one, two, config)
    maps = prepare(one, res), prepare(two, res)
    panels = [_panel(maps[0], maps[1], T, is_bent, caption, config) for T, caption in places]
    height = max(panel.shape[0] for panel in panels)
    padded = [
        np.pad(panel, ((0, height - panel.shape[0]), (0, 0), (0, 0)), constant_values=PAPER[0]) for panel in panels
    ]
    return np.concatenate(padded, axis=1)


def _panel(
    a: PreparedMap, b: PreparedMap, T_a_b: Transform, is_bent: bool, caption: str, config: AlignmentConfig
) -> NDArray[np.uint8]:
    """Return one place as a picture with its caption below."""
    if is_bent:
        by = bend(a, b, straight(b, T_a_b), config.strain)
        b, T_a_b = by.bent(b), by.T_a_b
        caption += f", bent by {by.residual_m:.2f} m"
    on_a, (matched, _, against, _) = judge_walls(b, a, T_a_b, config.tolerance_m)
    on_b, (_, _, more, _) = judge_walls(a, b, se2.inverse(T_a_b), config.tolerance_m)
    walls_b = se2.apply(T_a_b, b.points)
    stacked = np.concatenate([a.points, walls_b])
    low = stacked.min(axis=0) - (MARGIN_CELLS + 0.5) * a.res  # dots in the middle of pixels
    width, height = (np.ceil((stacked.max(axis=0) - low) / a.res).astype(int) + MARGIN_CELLS).tolist()
    page = np.full((height, width, 3), PAPER, dtype=np.uint8)
    xs, ys = np.meshgrid(low[0] + (np.arange(width) + 0.5) * a.res, low[1] + (np.arange(height) + 0.5) * a.res)
    centres = np.stack([xs, ys], axis=-1)
    in_a, in_b = _states(a, centres), _states(b, se2.apply(se2.inverse(T_a_b), centres))
    page[(in_a > 0) | (in_b > 0)] = ONE_ONLY
    page[(in_a == 1) & (in_b == 1)] = FLOOR
    for points, verdicts, own in ((a.points, on_b, OF_A), (walls_b, on_a, OF_B)):
        _dot(page, points[(verdicts != MATCHED) & (verdicts != CONTRADICTED)], low, a.res, own)
        _dot(page, points[verdicts == MATCHED], low, a.res, INK)
    for points, verdicts in ((a.points, on_b), (walls_b, on_a)):
        _dot(page, points[verdicts == CONTRADICTED], low, a.res, AGAINST, around=1)
    said = f"{caption}: {matched * a.res:.0f} m of wall agree, {max(against, more) * a.res:.0f} m contradict (red)"
    return _captioned(page[::-1], said, a.res)


def _states(side: PreparedMap, at: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return a map's states at places ``(H, W, 2)`` of its frame; unknown outside."""
    c, r = (np.floor((at[..., k] - origin) / side.res).astype(int) for k, origin in ((0, side.x0), (1, side.y0)))
    inside = (r >= 0) & (c >= 0) & (r < side.state.shape[0]) & (c < side.state.shape[1])
    found = np.zeros(at.shape[:2], dtype=np.uint8)
    found[inside] = side.state[r[inside], c[inside]]
    return found


def _dot(
    page: NDArray[np.uint8],
    at: NDArray[np.float64],
    low: NDArray[np.float64],
    res: float,
    rgb: tuple[int, int, int],
    around: int = 0,
) -> None:
    """Colour the cells of places ``(N, 2)``, and so many cells around each."""
    c, r = (np.floor((at[:, k] - low[k]) / res).astype(int) for k in (0, 1))
    for dr in range(-around, around + 1):
        for dc in range(-around, around + 1):
            page[np.clip(r + dr, 0, page.shape[0] - 1), np.clip(c + dc, 0, page.shape[1] - 1)] = rgb


def _captioned(picture: NDArray[np.uint8], text: str, res_m: float) -> NDArray[np.uint8]:
    """Return the picture, enlarged by a whole factor or shrunk where it is very large, with a line and a key below."""
    import cv2

    longer = max(picture.shape[:2])
    enlarged = np.ascontiguousarray(picture)
    if longer > MOST_PX:
        size = (max(picture.shape[1] * MOST_PX // longer, 1), max(picture.shape[0] * MOST_PX // longer, 1))
        enlarged = np.asarray(cv2.resize(enlarged, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    else:
        times = max(LEAST_PX // longer, 1)
        enlarged = enlarged.repeat(times, axis=0).repeat(times, axis=1)
    height, width = enlarged.shape[:2]
    key = key_strip(width, KEY, width / (picture.shape[1] * res_m))
    out = np.full((height + CAPTION_PX, key.shape[1], 3), PAPER, dtype=np.uint8)
    out[:height, :width], out[height + LINE_PX :] = enlarged, key
    cv2.putText(out, text, (8, height + 18), cv2.FONT_HERSHEY_SIMPLEX, 0.45, INK, 1, cv2.LINE_AA)
    return out
