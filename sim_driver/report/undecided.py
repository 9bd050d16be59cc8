"""Pairs that are not merged because their maps fit at several places: each place as a picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrslam.merge.fit_picture import draw_places
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.report.png import png_uri

SHOWN = 3
"""Most places of a pair that are drawn: those that sightings say most for."""


def undecided_data(run: RunResults) -> list[dict[str, Any]]:
    """Return each undecided pair with a picture of its places, as the first robot that knows of it has it."""
    undecided: dict[tuple[str, str], dict[str, Any]] = {}
    merged = set()
    for robot_id, robot in run.beliefs.items():
        for row in robot["pairs"]:
            pair = row["a"], row["b"]
            if row["status"] == "accepted":
                merged.add(pair)
            elif pair not in undecided and (shown := _shown(run, robot_id, row)) is not None:
                undecided[pair] = shown
    return [undecided[pair] for pair in sorted(undecided.keys() - merged)]


def _shown(run: RunResults, robot_id: str, row: dict[str, Any]) -> dict[str, Any] | None:
    left = [place for place in row.get("places", ()) if not place.get("refuted", False)]
    a, b = run.map(row["a"]), run.map(row["b"])
    if len(left) < 2 or a is None or b is None:
        return None
    left.sort(key=lambda place: -float(place["llr"]))
    captions = [f"{'ABC'[i]}, sightings {place['llr']:+.1f} nats" for i, place in enumerate(left[:SHOWN])]
    places = [(np.array(place["T_a_b"]), said) for place, said in zip(left, captions, strict=False)]
    return {
        "pair": f"{row['a']}-{row['b']}",
        "robot": robot_id,
        "reason": row["reason"],
        "places": len(left),
        "picture": png_uri(draw_places(a, b, places)),
    }
