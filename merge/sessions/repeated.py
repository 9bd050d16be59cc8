"""Sessions that a saved map holds already: given again they would count as newer than what was seen after them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

from mrslam.spatial import InputError
from mrslam.spatial.files.saved_map import SavedMap, Session


def check_sessions(given: Mapping[str, SavedMap]) -> None:
    """Raise ``InputError`` where two of the maps, by their names, hold the same session."""
    for (one, before), (other, after) in combinations(given.items(), 2):
        for session, keys in _sessions(before):
            for again, again_keys in _sessions(after):
                if _is_same(session, keys, again, again_keys):
                    raise InputError(
                        f"{other}: its session {again.name} is in {one} already; "
                        "once more it would count as newer than what was seen since"
                    )


def _sessions(saved: SavedMap) -> list[tuple[Session, set[tuple[int, bytes]]]]:
    """Return each session with those of its keyframes that the map still holds: stamp and scan."""
    starts = saved.scans.starts
    keys = [
        (int(stamp_ns), saved.scans.polar[starts[k] : starts[k + 1]].tobytes())
        for k, stamp_ns in enumerate(saved.keyframes.stamps_ns)
    ]
    out, first = [], 0
    for session in saved.sessions:
        out.append((session, set(keys[first : first + session.keyframes])))
        first += session.keyframes
    return out


def _is_same(one: Session, keys: set[tuple[int, bytes]], other: Session, other_keys: set[tuple[int, bytes]]) -> bool:
    """Return whether two sessions are one: paths of one length, to the centimetre, and a keyframe that both have.

    The path is kept as it was driven, however the map is bent since; of a drive that went on it is longer. Where of the
    keyframes none is left, the names say it. Of maps without a path, as those of other systems, nobody can tell.
    """
    if one.way_m != other.way_m or not one.way_m:
        return False
    return not keys.isdisjoint(other_keys) or (one.name == other.name and not (keys and other_keys))
