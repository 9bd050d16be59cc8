"""The joint graph of several robots: how long it takes, and what wrong matches between robots do to it.

    python bench/joint.py [--robots 4] [--keyframes 500] [--wrong 0.4] [--seeds 100]

Robots drive loops through the same blocks of streets, each with a map bent in its own way; where two pass one place
there is a match between them, good to some centimetres. A share ``--wrong`` of all matches is then wrong: half of the
seeds at random, half all by the same shift, as a corridor that repeats itself makes them. One JSON line: seconds for
solving from nothing and after one more match, how many wrong matches were believed and right ones were not, and how
far the wrong ones moved any keyframe.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from mrslam.merge import Pair
from mrslam.merge.joint.believable import believable, others
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.ties import NamedMatch, solve
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import KeyScans, se2
from mrslam.spatial.se2 import Transform

STEP_M, BLOCK_M, STREETS = 0.5, 20.0, 4
BENT_M, WAVE_M = 0.15, 60.0
"""How far and over what distance maps are bent: decimetres over tens of metres, as maps of recorded logs are."""
JITTER_M, JITTER_RAD = 0.01, 0.002
"""Noise of each keyframe in its map."""
MATCH_M, MATCH_RAD = 0.02, 0.004
INFORMATION = np.diag([MATCH_M**-2, MATCH_M**-2, MATCH_RAD**-2])
EVERY = 5
"""Keyframes between two matches."""
NEAR_M = 1.0

Matches = list[NamedMatch]


def streets(rng: np.random.Generator, keyframes: int) -> Transform:
    """Return true poses ``(K, 3)`` along a random way through the streets."""
    at, heading, poses = rng.integers(0, STREETS, 2), 0, []
    while len(poses) < keyframes:
        ways = [np.array(way) for way in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        open_ways = [k for k in range(4) if (at + ways[k] >= 0).all() and (at + ways[k] < STREETS).all()]
        forward = [k for k in open_ways if k != (heading + 2) % 4]
        heading = int(rng.choice(forward))
        for step in range(round(BLOCK_M / STEP_M)):
            place = BLOCK_M * at + STEP_M * step * ways[heading]
            poses.append((*place, heading * np.pi / 2))
        at = at + ways[heading]
    return np.array(poses[:keyframes])


def bent(rng: np.random.Generator, truth: Transform) -> Transform:
    """Return what the robot's own map makes of its way, in its own frame: places are moved by a slow wave or two."""
    poses = truth.copy()
    for _ in range(2):
        wave = rng.normal(0.0, 2.0 * np.pi / WAVE_M, 2)
        amount = rng.normal(0.0, BENT_M, 2)
        phase = truth[:, :2] @ wave + rng.uniform(0.0, 2.0 * np.pi)
        poses[:, :2] += np.sin(phase)[:, None] * amount
        poses[:, 2] += 0.5 * np.cos(phase) * (wave[0] * amount[1] - wave[1] * amount[0])  # half of the field's curl
    poses += rng.normal(0.0, (JITTER_M, JITTER_M, JITTER_RAD), poses.shape)
    return se2.between(poses[0], poses)


def team(rng: np.random.Generator, robots: int, keyframes: int) -> tuple[dict[str, Transform], dict[str, Trail]]:
    """Return true ways and the robots' own."""
    truths = {f"r{k + 1}": streets(rng, keyframes) for k in range(robots)}
    trails = {
        name: Trail(bent(rng, truth), KeyScans.of_points([np.empty((0, 2))] * keyframes, np.zeros((keyframes, 2))))
        for name, truth in truths.items()
    }
    return truths, trails


def matches_of(rng: np.random.Generator, truths: dict[str, Transform]) -> Matches:
    """Return a match wherever two robots passed one place, once in a while."""
    found: Matches = []
    names = sorted(truths)
    for n, a in enumerate(names):
        for b in names[n + 1 :]:
            for j in range(0, len(truths[b]), EVERY):
                away = np.hypot(*(truths[a][:, :2] - truths[b][j, :2]).T)
                i = int(np.argmin(away))
                if away[i] < NEAR_M:
                    T = se2.between(truths[a][i], truths[b][j]) + rng.normal(0.0, (MATCH_M, MATCH_M, MATCH_RAD))
                    found.append((a, b, KeyMatch(i, j, T, INFORMATION)))
    return found


def spoilt(
    rng: np.random.Generator, trails: dict[str, Trail], matches: Matches, share: float, together: bool
) -> tuple[Matches, set[int]]:
    """Return the matches with wrong ones among them, and the indices of these: a share of each pair's."""
    out, wrong = list(matches), set[int]()
    for pair in sorted({(a, b) for a, b, _ in matches}):
        mine = [k for k, (a, b, _) in enumerate(matches) if (a, b) == pair]
        shift = np.array([BLOCK_M * rng.choice((-1.0, 1.0)), 0.0, 0.0])
        for k in rng.choice(mine, int(share * len(mine)), replace=False):
            a, b, match = matches[k]
            T_map_i = trails[a].T_map_key[match.i]
            T_map_wrong = se2.compose(shift, se2.compose(T_map_i, match.T_i_j))
            elsewhere = se2.transform(*rng.uniform((-9, -9, -3), (9, 9, 3)))
            T = se2.between(T_map_i, T_map_wrong) if together else elsewhere
            out[k] = (a, b, match._replace(T_i_j=T))
            wrong.add(int(k))
    return out, wrong


def judged(trails: dict[str, Trail], matches: Matches) -> tuple[Matches, Matches]:
    """Return the matches that are believable, pair by pair, and the others of robots that these tie."""
    found: dict[Pair, dict[tuple[int, int], KeyMatch]] = {}
    for a, b, match in matches:
        found.setdefault((a, b), {})[match.i, match.j] = match
    chosen, ambiguous = believable(trails, found, {})
    return chosen, others(found, chosen, ambiguous)


def ends(one: NamedMatch) -> tuple[str, str, int, int]:
    """Return which keyframes of which robots a match ties."""
    a, b, match = one
    return a, b, match.i, match.j


def placed(truths: dict[str, Transform], trails: dict[str, Trail]) -> dict[str, Transform]:
    """Return the ways as alignment would lay them: rigidly, by the truth of the first keyframe."""
    first = se2.inverse(truths[min(truths)][0])
    return {name: se2.compose(se2.compose(first, truths[name][0]), trail.T_map_key) for name, trail in trails.items()}


def play(seed: int, robots: int, keyframes: int, share: float) -> dict[str, float]:
    """Solve one team's graph without and with wrong matches."""
    rng = np.random.default_rng(seed)
    truths, trails = team(rng, robots, keyframes)
    matches = matches_of(rng, truths)
    bad, wrong = spoilt(rng, trails, matches, share, seed % 2 == 1)
    start = placed(truths, trails)
    key = {(a, b, match.i, match.j): k for k, (a, b, match) in enumerate(bad)}
    is_wrong = {at for at, k in key.items() if k in wrong}
    sound, rest = ([one for one in part if ends(one) not in is_wrong] for part in judged(trails, matches))
    clean, _ = solve(trails, start, sound, rest)
    began = time.perf_counter()
    poses, ties = solve(trails, start, *judged(trails, bad))
    nothing_s = time.perf_counter() - began
    trusted = {ends(tie[:3]) for tie in ties if tie.believed}
    began = time.perf_counter()
    solve(trails, poses, *judged(trails, bad))
    again_s = time.perf_counter() - began
    moved = max(float(np.hypot(*(poses[name] - clean[name])[:, :2].T).max()) for name in trails)
    return {
        "matches": len(matches), "wrong": len(wrong), "wrong_believed": len(trusted & is_wrong),
        "right_dropped": len(key.keys() - is_wrong - trusted), "moved_m": moved,
        "nothing_s": nothing_s, "again_s": again_s,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--keyframes", type=int, default=500)
    parser.add_argument("--wrong", type=float, default=0.4)
    parser.add_argument("--seeds", type=int, default=100)
    options = parser.parse_args()
    rows = [play(seed, options.robots, options.keyframes, options.wrong) for seed in range(options.seeds)]
    line: dict[str, object] = {"what": "joint", **vars(options)}
    for key in ("matches", "wrong", "wrong_believed", "right_dropped"):
        line[key] = int(sum(row[key] for row in rows))
    line["moved_m"] = round(max(row["moved_m"] for row in rows), 4)
    for key in ("nothing_s", "again_s"):
        line[key] = round(float(np.median([row[key] for row in rows])), 3)
    print(json.dumps(line))


if __name__ == "__main__":
    main()
