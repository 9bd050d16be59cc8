"""How many pairs of maps can be aligned at all: an oracle knows the truth and asks whether a rival fits as well.

    python -m bench.alignment_limit [--pairs DIR] [--every 1]

One JSON line; by overlap bin, of the overlapping pairs: ``found`` is right and accepted; ``held`` has enough at the
true place to be accepted if no other place were known (all tests but the lead); ``unrivalled`` has no other place that
fits as well there; ``clear`` has the lead that is asked for. No method that reads the two maps by walls and free space
gets beyond ``unrivalled`` but by luck; one that is never to be wrong not much beyond ``clear``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bench.alignment import LOOSE, apart_from, default_pairs
from mrslam import alignment
from mrslam.alignment import AlignmentConfig
from mrslam.alignment.aligners import ALIGNERS
from mrslam.alignment.prepared import is_smaller, main_part, prepare, working_resolution
from mrslam.alignment.result import Candidate
from mrslam.alignment.verification.bent_fits import bent_fits
from mrslam.alignment.verification.decide import bent_claim, rigid_claim
from mrslam.alignment.verification.fits import fits_of, same
from mrslam.spatial import OccupancyGrid, read_map, se2


def at_the_truth(one: OccupancyGrid, two: OccupancyGrid, T_one_two: np.ndarray) -> dict[str, bool]:
    """Return what the oracle says of one pair: the better of the maps as they are, and bent."""
    config = AlignmentConfig()
    a, b = main_part(one.cropped()), main_part(two.cropped())
    if is_smaller(a, b):
        a, b, T_one_two = b, a, se2.inverse(T_one_two)
    res = working_resolution(a, b, config)
    big, small = prepare(a, res), prepare(b, res)
    true = fits_of(big, small, [Candidate(T_one_two)], config)
    others = fits_of(big, small, ALIGNERS["auto"](big, small, config, None), config)
    others = [fit for fit in others if not same(small, fit[1], true[0][1])]
    claims = [rigid_claim(big, small, true + others, config)]
    bent = bent_fits(big, small, [T for _, T, _ in true + others], config)
    own = [fit for fit in bent if fit.start == 0]
    if own:
        claims.append(bent_claim(big, small, own + [fit for fit in bent if fit is not own[0]], config))
    return {
        "held": any(all(t.slack >= 0 for t in claim.judged if not t.is_lead) for claim in claims),
        "unrivalled": any(claim.evidence.margin > 0.0 for claim in claims),
        "clear": any(claim.passed for claim in claims),
    }


def outcomes(folder: Path, every: int) -> Iterator[tuple[float, dict[str, bool]]]:
    """Yield the bin and what was said of every overlapping pair."""
    for pair in json.loads((folder / "index.json").read_text())["pairs"][::every]:
        if pair["negative"]:
            continue
        a, b = (read_map(folder / pair["file"], key) for key in "ab")
        found = alignment.align(a, b)
        metres, radians = apart_from(pair, found.T_a_b)
        right = isinstance(found, alignment.Alignment) and metres < LOOSE[0] and radians < LOOSE[1]
        truth = np.array([pair["gt"][k] for k in ("tx", "ty", "theta")])
        yield pair["bin"], {"found": right, **at_the_truth(a, b, truth)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=Path, default=None, help="as bench/alignment.py")
    parser.add_argument("--every", type=int, default=1, help="take every so manieth pair")
    args = parser.parse_args()
    alignment.warm_up()
    rows = list(outcomes(args.pairs or default_pairs(), args.every))
    table: dict[str, Any] = {}
    for bin_ in sorted({bin_ for bin_, _ in rows}, reverse=True):
        said = [row for b, row in rows if b == bin_]
        table[str(bin_)] = {"n": len(said)} | {key: sum(row[key] for row in said) for key in said[0]}
    print(json.dumps(table))


if __name__ == "__main__":
    main()
