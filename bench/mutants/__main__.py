"""Mutants: breaks the program in one place at a time and says whether the tests of that package notice.

    python -m bench.mutants --package agent merge --workers 2
    python -m bench.mutants --only second_look

Each is applied in a copy of the repository, and the tests of its package are run until one fails; chaos mutants are
held against five chaos missions. One line each: killed (by which test), SURVIVED, or stale where the text to change is
not there any more. At the end the tests that killed are run on the program as it is: one that fails there, too, proves
nothing. One JSON line at the end.
"""

from __future__ import annotations

import argparse
import json
import queue
import re
import sys
import tempfile
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from bench.mutants.lists import MUTANTS
from bench.mutants.mutant import Mutant
from bench.mutants.nearest import nearest_first
from bench.mutants.scratch import Ended, Scratch, has_kernels

PACKAGES = sorted({mutant.package for mutant in MUTANTS})
CHAOS = ("-m", "bench.chaos", "--missions", "5", "--workers", "1", "--stop", "--seed")


@dataclass(frozen=True)
class Verdict:
    """What came of one mutant."""

    mutant: Mutant
    word: str
    """"killed", "SURVIVED" or "stale"."""
    by: str
    seconds: float


def judge(scratch: Scratch, mutant: Mutant, timeout_s: float) -> Verdict:
    """Return whether the tests notice a mutant."""
    with scratch.mutated(mutant) as is_there:
        if not is_there:
            return Verdict(mutant, "stale", "its text is not there once", 0.0)
        start_s = time.monotonic()
        for arguments in runs(mutant, scratch.top):
            ended = scratch.run([sys.executable, *arguments], timeout_s, spends_cache=has_kernels(mutant))
            if ended.failed:
                break
    return Verdict(mutant, "killed" if ended.failed else "SURVIVED", _killer(ended), time.monotonic() - start_s)


def runs(mutant: Mutant, top: Path) -> list[list[str]]:
    """Return the arguments of the runs of Python of which one must fail, in the copy of the repository at ``top``."""
    if mutant.chaos is not None:
        return [[*CHAOS, str(mutant.chaos)]]
    return nearest_first(mutant.package, mutant.file, top)


def _killer(ended: Ended) -> str:
    if not ended.failed:
        return ""
    found = re.search(r"^(?:FAILED|ERROR) tests/.+?(?= - |$)|^seed \d+: .*", ended.output, re.MULTILINE)
    return found[0] if found else ended.output.strip().splitlines()[-1][:200] if ended.output.strip() else "no output"


def fail_unbroken(scratch: Scratch, verdicts: Iterable[Verdict], timeout_s: float) -> list[str]:
    """Return which of the tests that killed mutants fail on the program as it is."""
    killers = sorted({v.by.split(" ", 1)[1] for v in verdicts if v.by.startswith(("FAILED ", "ERROR "))})
    if not killers:
        return []
    ended = scratch.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *killers], timeout_s)
    if not ended.failed:
        return []
    return re.findall(r"^(?:FAILED|ERROR) (tests/.+?)(?: - |$)", ended.output, re.MULTILINE) or [
        ended.output.strip()[-200:]
    ]


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--package", nargs="*", choices=PACKAGES, default=PACKAGES)
    parser.add_argument("--only", default="", help="mutants whose file or harm has this text")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--timeout", type=float, default=1800.0, help="seconds; what hangs longer is killed")
    parser.add_argument("--scratch", type=Path, help="folder for the copies, kept, so that kernels are compiled once")
    parser.add_argument("--list", action="store_true", help="say only which texts are stale")
    return parser.parse_args()


def main() -> int:
    """Judge the mutants asked for."""
    options = _options()
    chosen = [m for m in MUTANTS if m.package in options.package and options.only in f"{m.file} {m.harm}"]
    if options.list:
        return _list(chosen)
    start_s = time.monotonic()
    verdicts: list[Verdict] = []
    scratches: queue.SimpleQueue[Scratch] = queue.SimpleQueue()

    def turn(mutant: Mutant) -> Verdict:
        scratch = scratches.get()
        try:
            return judge(scratch, mutant, options.timeout)
        finally:
            scratches.put(scratch)

    def made(number: int) -> None:
        scratch = Scratch((options.scratch or Path(folder)).resolve() / str(number))
        scratch.warm_up()
        scratches.put(scratch)

    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.workers) as threads:
        list(threads.map(made, range(options.workers)))
        for future in as_completed([threads.submit(turn, mutant) for mutant in chosen]):
            verdicts.append(verdict := future.result())
            mutant = verdict.mutant
            said = f"{mutant.file}: {mutant.harm} [{verdict.by}] {verdict.seconds:.0f} s"
            print(f"{verdict.word:8} {mutant.package:16} {said}", flush=True)
        unsound = fail_unbroken(scratches.get(), verdicts, options.timeout)
    words = {word: [v for v in verdicts if v.word == word] for word in ("killed", "SURVIVED", "stale")}
    line = {
        "what": "mutants",
        "mutants": len(verdicts),
        "killed": len(words["killed"]),
        "survived": sorted(f"{v.mutant.file}: {v.mutant.harm}" for v in words["SURVIVED"]),
        "stale": sorted(f"{v.mutant.file}: {v.mutant.harm}" for v in words["stale"]),
        "fail_unbroken": unsound,
        "seconds": round(time.monotonic() - start_s, 1),
    }
    print(json.dumps(line))
    return 1 if words["SURVIVED"] or words["stale"] or unsound else 0


def _list(mutants: list[Mutant]) -> int:
    stale = [m for m in mutants if not Path(m.file).exists() or m.applied_to(Path(m.file).read_text()) is None]
    for mutant in stale:
        print(f"stale    {mutant.package:16} {mutant.file}: {mutant.harm}")
    print(json.dumps({"what": "mutants", "mutants": len(mutants), "stale": len(stale)}))
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
