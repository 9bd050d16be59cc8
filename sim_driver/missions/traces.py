"""Link qualities over time from a file, so that a mission's meetings can be played again."""

from __future__ import annotations

import csv
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

from mrslam.spatial import InputError

Pair = tuple[str, str]


class LinkTrace:
    """Quality of every pair's link as a staircase over mission time; 0 before its first line."""

    def __init__(self, steps: dict[Pair, list[tuple[int, float]]]) -> None:
        """Take ``(t_ns, quality)`` steps of each pair, in order of time; pairs have their names in order."""
        self._times = {pair: [t for t, _ in line] for pair, line in steps.items()}
        self._values = {pair: [quality for _, quality in line] for pair, line in steps.items()}

    @property
    def pairs(self) -> list[Pair]:
        """The pairs that it tells of."""
        return sorted(self._times)

    @classmethod
    def read(cls, path: Path) -> LinkTrace:
        """Read a CSV file with the columns ``t_s, a, b, quality``; lines beginning with # are comments."""
        steps: dict[Pair, list[tuple[int, float]]] = defaultdict(list)
        try:
            text = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: cannot be read ({error})") from error
        for number, row in enumerate(csv_rows(text, path), start=1):
            if not row or row[0].lstrip().startswith("#") or row[0].strip() == "t_s":
                continue
            try:
                t_s, a, b, quality = float(row[0]), row[1].strip(), row[2].strip(), float(row[3])
            except (ValueError, IndexError) as error:
                raise InputError(f"{path}, line {number}: needs t_s,a,b,quality ({error})") from error
            if not (0.0 <= quality <= 1.0 and 0.0 <= t_s < 1e9) or a == b:
                raise InputError(f"{path}, line {number}: needs t_s >= 0, two robots and a quality in 0..1, got {row}")
            line = steps[_pair(a, b)]
            if line and line[-1][0] > t_s * 1e9:
                raise InputError(f"{path}, line {number}: times of a pair must not run backward")
            line.append((round(t_s * 1e9), quality))
        if not steps:
            raise InputError(f"{path}: holds no link quality")
        return cls(dict(steps))

    def quality(self, a: str, b: str, now_ns: int) -> float:
        """Return the quality of the link between two robots, in [0, 1]."""
        pair = _pair(a, b)
        index = bisect_right(self._times.get(pair, []), now_ns)
        return self._values[pair][index - 1] if index else 0.0


class TracedLinks:
    """The links of one robot, told to its agent."""

    def __init__(self, trace: LinkTrace, robot_id: str, peers: list[str]) -> None:
        """Take the trace as seen by one robot."""
        self._trace, self._robot_id, self._peers = trace, robot_id, peers

    def qualities(self, now_ns: int) -> dict[str, float]:
        """Return the quality of the link to each peer, now."""
        return {peer: self._trace.quality(self._robot_id, peer, now_ns) for peer in self._peers}


def csv_rows(text: Iterable[str], path: Path) -> Iterator[list[str]]:
    """Yield the rows of a CSV file's lines; raise ``InputError`` where they are none."""
    try:
        yield from csv.reader(text)
    except csv.Error as error:
        raise InputError(f"{path}: not a CSV file ({error})") from error


def _pair(a: str, b: str) -> Pair:
    return (a, b) if a < b else (b, a)
