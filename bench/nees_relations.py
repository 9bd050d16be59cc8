"""How honest the mapper's covariance is on a recorded log: errors of its relations over what it expects of them.

    python bench/nees_relations.py LOG [--most 400]

Beside LOG.clf.gz lies LOG.relations (Kuemmerle et al. 2009). Of each relation between two scans the error of the
finished trajectory is divided by the deviation that the mapper's pose graph has for the one as seen from the other,
with the error of either's own match. Printed is, for x, y and heading, what 68 % of these quotients do not exceed: 1 if
the graph is honest and the reference exact, more where the mapper is too sure of itself or the reference errs.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrslam import rbpf
from mrslam.rbpf.filter.back_end import BackEnd
from mrslam.rbpf.filter.uncertainty import chain_information, turned
from mrslam.rbpf.front_end.motion import chain_cov
from mrslam.sim_driver.evaluate.relations import read_relations
from mrslam.sim_driver.feeds import open_feed
from mrslam.spatial import se2
from mrslam.spatial.pose_graph import Edges, marginal


class Spread:
    """Covariances of relative poses by the mapper's pose graph."""

    def __init__(self, back: BackEnd, stamps_us: NDArray[np.int64]) -> None:
        """``stamps_us (K,)`` of the keyframes."""
        self._stamps_us = stamps_us
        poses = back.filter.trajectory
        keys = np.arange(len(poses) - 1)
        chain = chain_information(back.config, back.arrivals, back.matched)
        motion = Edges(keys, keys + 1, se2.between(poses[:-1], poses[1:]), chain[1:])
        directions, seen = back.filter.headings.as_edges(poses)
        self._nodes = np.concatenate([poses, directions])
        self._edges = Edges.joined([motion, back.loops.as_edges(), seen])
        by_motion = np.linalg.inv(chain_cov(back.config, back.arrivals))
        self._own = np.linalg.inv(by_motion + turned(back.matched, back.arrivals[:, 2]))

    def between(self, first_us: int, second_us: int) -> NDArray[np.float64]:
        """Return the covariance ``(3, 3)`` of the pose at one time in the frame of the pose at another."""
        first, second = (max(int(np.searchsorted(self._stamps_us, us, "right")) - 1, 0) for us in (first_us, second_us))
        own = self._own[first] + self._own[second]
        if first == second:
            return own
        place = np.arange(len(self._nodes))
        place[[0, first]] = first, 0  # it becomes the first node, which is certain
        edges = self._edges._replace(first=place[self._edges.first], second=place[self._edges.second])
        poses = se2.between(self._nodes[first], self._nodes[place])
        return own + marginal(poses, edges, int(place[second]))


def main() -> None:
    """Map, compare and print a JSON line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--most", type=int, default=400, help="relations, drawn at random")
    options = parser.parse_args()
    mapper = rbpf.Mapper(rbpf.MapperConfig(threads=1), seed=1)
    keys, T_base_laser = [], np.zeros(3)
    for reading in open_feed(options.log).readings:
        if mapper.update(reading.scan, reading.T_odom_base).processed:
            keys.append(reading.scan.stamp_ns)
            T_base_laser = reading.scan.T_base_laser
    scans = mapper.trajectory()
    quotients = []
    first_us, second_us, T_first_second = read_relations(
        options.log.with_name(options.log.name.split(".")[0] + ".relations")
    )
    spread = Spread(mapper._back, np.array(keys) // 1000)
    for k in np.random.default_rng(0).permutation(len(first_us))[: options.most]:
        first, second = (int(np.argmin(np.abs(scans.stamps_ns // 1000 - us[k]))) for us in (first_us, second_us))
        T_laser = se2.compose(scans.T_map_base[[first, second]], T_base_laser)
        error = se2.between(T_laser[0], T_laser[1]) - T_first_second[k]
        error[2] = se2.wrap(error[2])
        quotients.append(np.abs(error) / np.sqrt(np.diag(spread.between(first_us[k], second_us[k]))))
    found = np.quantile(np.array(quotients), 0.68, axis=0)
    print(json.dumps({"what": "nees-relations", "relations": len(quotients), "quotient_68": found.round(2).tolist()}))


if __name__ == "__main__":
    main()
