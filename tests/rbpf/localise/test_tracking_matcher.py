"""When a scan in a saved map is searched for."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.front_end import local_matcher
from mrslam.rbpf.front_end.prediction import Guess
from mrslam.rbpf.localise.tracking_matcher import TrackingMatcher
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Found
from mrslam.spatial.matching.gauss_newton import Match
from tests.rbpf.rooms import seen_room


@pytest.mark.parametrize(
    ("inliers", "conflicts", "is_searched"),
    [(0.9, 0.05, False), (0.7, 0.3, False), (0.3, 0.1, False), (0.3, 0.4, True), (0.05, 0.5, True)],
    ids=["fits", "furniture moved", "mostly beyond the map", "fits in part", "elsewhere"],
)
def test_a_scan_is_searched_for_where_most_of_what_the_map_shows_of_it_does_not_fit(
    monkeypatch: pytest.MonkeyPatch, inliers: float, conflicts: float, is_searched: bool
) -> None:
    searched = []

    def match(tiles: Tiles, points: np.ndarray, start: np.ndarray, *_: object) -> Match:
        return Match(start.copy(), -0.4, inliers, conflicts, np.eye(3), 0.0, np.array([1.0, 0.0]))

    def search(tiles: Tiles, points: np.ndarray, centre: np.ndarray, *_: object) -> Found:
        searched.append(centre)
        return Found(centre, 0.0, 0)

    monkeypatch.setattr(local_matcher, "match", match)
    monkeypatch.setattr(local_matcher, "search", search)
    store, points = seen_room()
    guess = Guess(motion=np.array([0.05, 0.0, 0.0]), sigma_m=0.009, sigma_rad=0.01, slip=0.05)
    TrackingMatcher(0.03).match(store.tiles(0), points, np.zeros(3), guess)
    assert bool(searched) is is_searched
