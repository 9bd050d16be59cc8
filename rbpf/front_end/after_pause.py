"""What a robot makes of its first scan after a pause: its map shows where it came to, or what its wheels are worth."""

from __future__ import annotations

import math
from dataclasses import replace

from mrslam.rbpf.front_end.front_end import has_stood
from mrslam.rbpf.front_end.intake import Reading
from mrslam.rbpf.front_end.look_around import is_beyond, is_elsewhere, look_around, shown_at
from mrslam.rbpf.front_end.prediction import Predictor
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.poses import between, compose
from mrslam.spatial.runtime.crew import Crew
from mrslam.spatial.se2 import Transform

UNSEEN_M = 0.5
"""What wheels say of a shorter way in a pause is believed where the map shows nothing: a robot that turned about sees
what it never saw, and is where it was."""


def has_driven_unseen(reading: Reading, predictor: Predictor) -> bool:
    """Return whether wheels say that the robot drove in a pause: one that stood, and sees another place, was carried.

    ``predictor`` : before it waits for the reading's time.
    """
    motion = reading.odom_motion
    return motion is not None and not has_stood(motion) and predictor.is_pause(reading.elapsed_s)


def after_pause(
    reading: Reading,
    moved: Transform,
    T_map_before: Transform,
    tiles: Tiles,
    sigma_m: float,
    crew: Crew | None = None,
    *,
    usual_fit: float = 1.0,
) -> Reading:
    """Return the first reading after a pause with the motion that the robot's map shows, or what speaks against it.

    ``moved (3,)`` : the motion by its wheels, from ``T_map_before (3,)`` in the map ``tiles``; ``sigma_m`` : deviation
    of points from walls, metres. Threads of the ``crew`` that have nothing to do help. ``usual_fit`` : as for
    :func:`look_around`.
    """
    expected = compose(T_map_before, moved)
    if reading.is_set_back:  # it stood, or drove there, or nobody knows
        places = (shown_at(tiles, reading.sample, at, sigma_m) for at in (T_map_before, expected))
        place = next((at for at in places if at is not None), None)
        return replace(reading, is_carried=True) if place is None else came_to(place, T_map_before, reading)
    looked = look_around(tiles, reading.sample, expected, sigma_m, crew, usual_fit)
    if looked.place is None:
        is_unconfirmed = looked.is_contradicted or (looked.is_unknown and math.hypot(moved[0], moved[1]) > UNSEEN_M)
        return replace(reading, is_contradicted=looked.is_contradicted, is_unconfirmed=is_unconfirmed)
    if not is_elsewhere(expected, looked.place):
        return replace(reading, shown=moved)
    # A place far from where its wheels led, and from where it stood, may only look alike to one scan.
    is_unconfirmed = is_beyond(expected, looked.place) and is_elsewhere(T_map_before, looked.place)
    return replace(came_to(looked.place, T_map_before, reading), is_unconfirmed=is_unconfirmed)


def came_to(place: Transform, T_map_before: Transform, reading: Reading) -> Reading:
    """Return a reading whose robot came to a place ``(3,)`` that its map shows, whatever its wheels say."""
    motion = between(T_map_before, place)
    return replace(reading, odom_motion=motion, shown=motion)
