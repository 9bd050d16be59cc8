"""A saved map continued by a second session, against one mapper over both: one JSON line a log.

    python bench/continued.py [--data DIR] [--seed 1] [--cut 0.5] intel mit-csail aces

A log is cut in two. Each part is mapped by a mapper of its own, which knows nothing of the other, and ``one_map`` makes
one saved map of both, as ``mrslam save`` and ``mrslam merge`` do. Judged are the relations from a pose of the first
session to one of the second (Kuemmerle et al. 2009), over the lasers' trajectories bent as their maps were.

sessions_m : mean translation error of these relations. one_mapper_m : of one mapper over the whole log, the same
relations. ratio : of the two. placed : whether the second session found its place in the first.
cpu_s : of making the two maps one.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from mrslam import rbpf
from mrslam.merge.sessions.one_map import one_map
from mrslam.sim_driver.evaluate.relations import cross_errors, read_relations
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.kernels import load_kernels
from mrslam.spatial import Keyframes, se2
from mrslam.spatial.files.saved_map import SavedMap, of_one_session

FIRST, SECOND = "r1@monday", "r1@tuesday"


def mapped(readings: list[Any], seed: int) -> tuple[rbpf.Mapper, Keyframes]:
    """Return a mapper that has taken the readings, and the finished trajectory of its laser."""
    mapper = rbpf.Mapper(rbpf.MapperConfig(threads=1), seed=seed)
    for reading in readings:
        mapper.update(reading.scan, reading.T_odom_base)
    way = mapper.trajectory()
    return mapper, Keyframes(way.stamps_ns, se2.compose(way.T_map_base, readings[0].scan.T_base_laser))


def session(name: str, mapper: rbpf.Mapper) -> SavedMap:
    """Return a mapper's map as a session to save."""
    local = mapper.snapshot()
    count = len(local.key_scans)
    keyframes = Keyframes(local.keyframes.stamps_ns[:count], local.keyframes.T_map_base[:count])
    return of_one_session(name, local.map.to_grid(), keyframes, local.key_scans)


def continued(name: str, data: Path, seed: int, cut: float) -> dict[str, Any]:
    """Return the row of one log."""
    readings = list(open_feed(data / f"slam/{name}.clf.gz").readings)
    middle = round(cut * len(readings))
    ways, given = {}, {}
    for one, part in ((FIRST, readings[:middle]), (SECOND, readings[middle:])):
        mapper, ways[one] = mapped(part, seed)
        given[one] = session(one, mapper)
    whole = mapped(readings, seed)[1]
    begun_s = time.process_time()
    result = one_map(given, workers=1).result
    cpu_s = time.process_time() - begun_s
    assert result is not None
    team = result.team_map
    row: dict[str, Any] = {"log": name, "seed": seed, "cut": cut, "placed": SECOND in team.T_team_map}
    if not row["placed"]:
        return {**row, "why": team.unplaced.get(SECOND)}
    placed = {}
    for one, way in ways.items():
        bend, stamps_ns = team.bends.get(one), given[one].keyframes.stamps_ns
        bent = Keyframes(way.stamps_ns, se2.compose(team.T_team_map[one], way.T_map_base))
        placed[one] = bent if bend is None else bend.corrected_at(stamps_ns, way)
    relations = read_relations(data / f"slam/{name}.relations")
    of_one = [
        Keyframes(whole.stamps_ns[part], whole.T_map_base[part])
        for part in (np.isin(whole.stamps_ns, ways[FIRST].stamps_ns), np.isin(whole.stamps_ns, ways[SECOND].stamps_ns))
    ]
    pairs = {"sessions_m": (placed[FIRST], placed[SECOND]), "one_mapper_m": of_one}
    errors = {
        key: cross_errors(relations, *((way.stamps_ns, way.T_map_base) for way in pair), np.zeros(3))
        for key, pair in pairs.items()
    }
    row |= {key: round(float(found[:, 0].mean()), 4) for key, found in errors.items()}
    row["relations"] = len(errors["sessions_m"])
    row["ratio"] = round(row["sessions_m"] / row["one_mapper_m"], 2)
    bends = team.bends.values()
    return {**row, "bent_m": round(max((bend.most_m for bend in bends), default=0.0), 3), "cpu_s": round(cpu_s, 1)}


def main() -> None:
    """Continue the logs asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=["intel", "mit-csail", "aces"])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("MRSLAM_DATA", "../shared/data")))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cut", type=float, default=0.5, help="share of the log that the first session has")
    options = parser.parse_args()
    load_kernels(["rbpf", "alignment", "merge", "sim_driver.feeds"])
    for name in options.names:
        print(json.dumps(continued(name, options.data, options.seed, options.cut)), flush=True)


if __name__ == "__main__":
    main()
