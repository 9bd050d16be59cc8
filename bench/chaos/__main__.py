"""Chaos missions, many: faults of every kind at random, everything that must hold checked at every step.

    python -m bench.chaos --missions 1000 --seed 0

A mission that broke is named with its seed; ``--missions 1 --seed THAT`` plays it again. So is one whose process died,
which counts as broken. One JSON line at the end, which counts what was played until then after Ctrl-C.

``--scheduler tcp://HOST:8786`` plays them on a Dask cluster, whose workers are started in a checkout of this version:
``python -m distributed.cli.dask_worker HOST:8786 --nthreads 1``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import Counter
from contextlib import suppress
from functools import partial
from itertools import islice
from pathlib import Path

from rich.console import Console
from rich.progress import track

from bench.chaos.mission import died, play_chaos
from bench.chaos.schedule import with_fault
from bench.workers import play_all, play_on_cluster
from mrslam.sim_driver.faults.config import KINDS
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.spatial import InputError


def main() -> int:
    """Play the missions and say what broke."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission; the others follow")
    parser.add_argument("--world", help='all in this one: "hotel" (another by each seed), "arena2", ...')
    parser.add_argument(
        "--fault", choices=KINDS, help="only missions in which a robot suffers from this, from --seed on"
    )
    parser.add_argument("--stop", action="store_true", help="at the first mission that breaks")
    parser.add_argument("--figures", type=Path, help="file for what was measured: a JSON line a mission")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes of this machine")
    parser.add_argument("--scheduler", help="Dask scheduler to play on in their place, tcp://host:8786")
    options = parser.parse_args()
    try:
        return play(options)
    except InputError as error:
        parser.error(str(error))


def play(options: argparse.Namespace) -> int:
    """Play the missions of the options; return what the process ends with, 0 where all were played and none broke."""
    console = Console(stderr=True)
    start_s = time.monotonic()
    faults: Counter[str] = Counter()
    broken: dict[int, list[str]] = {}
    seeds = list(islice(with_fault(options.fault, options.seed, options.world), options.missions))
    played = 0
    figures = options.figures.open("a") if options.figures else None
    one = partial(play_chaos, world=options.world)
    with suppress(KeyboardInterrupt):
        if options.scheduler is None:
            ensure_compiled(console.print)
            outcomes = play_all(one, seeds, options.workers, died)
        else:
            outcomes = play_on_cluster(options.scheduler, one, seeds, died)
        for outcome in track(outcomes, "chaos", total=len(seeds), console=console):
            played += 1
            faults += outcome.faults
            if figures is not None:
                print(json.dumps({"seed": outcome.seed, **outcome.figures}), file=figures, flush=True)
            if outcome.violations:
                broken[outcome.seed] = outcome.violations
                console.print(f"seed {outcome.seed}: {len(outcome.violations)} violations; {outcome.violations[0]}")
                if options.stop:
                    break
    line = {
        "what": "chaos",
        "missions": played,
        "seed": options.seed,
        "violations": sum(map(len, broken.values())),
        "broken_seeds": sorted(broken),
        "faults": dict(sorted(faults.items())),
        "seconds": round(time.monotonic() - start_s, 1),
    }
    print(json.dumps(line))
    return 1 if broken or played < len(seeds) else 0


if __name__ == "__main__":
    sys.exit(main())
