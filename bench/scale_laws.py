"""Laws of what a team costs, fitted to the rows of ``bench/scale.py``, and a picture of them.

    python bench/scale_laws.py FILE [--plot docs/images/scale.png]

Over robots: y ~ n^p of whole runs of the same number of minutes in one world, where there are at least three numbers of
robots. Over time: what a robot takes in each minute of the longest run of each number of robots, in the first tenth of
it and in the last half; a cost that follows news falls once the building is known. ``--plot`` needs matplotlib
(``pip install 'mrslam[sweep]'``).
"""

from __future__ import annotations

import argparse
import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Row = dict[str, Any]


def laws(rows: list[Row]) -> list[str]:
    """Return the fitted laws, a line for each figure."""
    return [*over_robots(rows), *over_time(rows)]


def over_robots(rows: list[Row]) -> list[str]:
    """Return the fitted exponents over the number of robots."""
    groups: dict[tuple[float, str], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row["minutes"], row["world"]].append(row)
    lines = []
    for (minutes, world), group in sorted(groups.items()):
        if len({row["robots"] for row in group}) < 3:
            continue
        figures: dict[str, list[float]] = {
            "CPU of all": [row["cpu_s"] for row in group],
            **{f"CPU of {room}": [row["cpu_by_room_s"][room] for row in group] for room in group[0]["cpu_by_room_s"]},
            "alignments": [row["alignments"] for row in group],
            "memory": [row["peak_rss_mb"] for row in group],
            "bytes a robot": [sum(row["bytes_a_robot_minute"].values()) for row in group],
        }
        log_n = [math.log(row["robots"]) for row in group]
        for name, values in figures.items():
            if min(values) > 0:
                power = float(np.polyfit(log_n, np.log(values), 1)[0])
                lines.append(f"{world}, {minutes:g} min: {name} ~ robots^{power:.2f}")
    return lines


def over_time(rows: list[Row]) -> list[str]:
    """Return what a robot takes in a minute early and late in each number of robots' longest run."""
    lines = []
    for row in longest(rows):
        early, late = slice(0, max(1, len(row["by_minute"]) // 10)), slice(len(row["by_minute"]) // 2, None)
        for name, unit, values in (
            ("CPU", "s", a_minute(row, "cpu_s")),
            ("beacons", "kB", a_minute(row, "beacon_bytes") / 1e3),
            ("exchanges", "kB", a_minute(row, "exchange_bytes") / 1e3),
        ):
            lines.append(
                f"{row['world']}, {row['robots']} robots, {row['minutes']:g} min: {name} a robot-minute "
                f"{values[early].mean():.1f} -> {values[late].mean():.1f} {unit}"
            )
    return lines


def longest(rows: list[Row]) -> list[Row]:
    """Return the last of the longest runs of each number of robots, of those with several minutes noted."""
    best: dict[int, Row] = {}
    for row in rows:
        if len(row.get("by_minute", ())) >= 2 and row["minutes"] >= best.get(row["robots"], row)["minutes"]:
            best[row["robots"]] = row
    return [best[robots] for robots in sorted(best)]


def a_minute(row: Row, name: str) -> NDArray[np.float64]:
    """Return what a robot took of a figure in each minute ``(M,)``; the notes are sums from the beginning."""
    sums = np.array([minute[name] for minute in row["by_minute"]], dtype=np.float64)
    return np.diff(sums, prepend=0.0) / noted_robots(row)


def noted_robots(row: Row) -> int:
    """Return of how many robots the notes by minute are: those of the first of the run's processes."""
    return -(-int(row["robots"]) // int(row.get("processes", 1)))


def plot(rows: list[Row], path: Path) -> None:
    """Draw CPU and bytes of a robot-minute and memory over the mission, and CPU by room of the largest team."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    if not (runs := longest(rows)):
        raise SystemExit("no row is of two minutes or more: nothing to draw")
    figure, ((cpu, sent), (memory, rooms)) = plt.subplots(2, 2, figsize=(11.0, 7.5), layout="constrained")
    for row in runs:
        minutes = 1.0 + np.arange(len(row["by_minute"]))
        label = f"{row['robots']} robots"
        cpu.plot(minutes, a_minute(row, "cpu_s"), label=label)
        sent.plot(minutes, a_minute(row, "exchange_bytes") / 1e3, label=label)
        memory.plot(minutes, [minute["peak_rss_mb"] / noted_robots(row) for minute in row["by_minute"]], label=label)
    for axes, title, unit in (
        (cpu, "CPU of a robot", "seconds a minute"),
        (sent, "exchanged by a robot, without beacons", "kB a minute"),
        (memory, "memory, peak of a process, by its robots", "MB a robot"),
    ):
        axes.set(title=title, xlabel="minute of the mission", ylabel=unit, yscale="log")
        axes.legend()
    row = runs[-1]
    names = list(row["cpu_by_room_s"])
    of_room = [np.array([minute["cpu_by_room_s"][name] for minute in row["by_minute"]]) for name in names]
    shares = [np.maximum(np.diff(sums, prepend=0.0), 0.0) / noted_robots(row) for sums in of_room]
    rooms.stackplot(1.0 + np.arange(len(row["by_minute"])), shares, labels=names)
    rooms.set(title=f"CPU of a robot of {row['robots']}, by room", xlabel="minute", ylabel="seconds a minute")
    rooms.legend(fontsize="small")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> None:
    """Print the laws, and draw them where asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path)
    parser.add_argument("--plot", type=Path)
    args = parser.parse_args()
    rows = [json.loads(line) for line in args.rows.read_text(encoding="utf-8").splitlines()]
    print("\n".join(laws(rows)))
    if args.plot:
        plot(rows, args.plot)


if __name__ == "__main__":
    main()
