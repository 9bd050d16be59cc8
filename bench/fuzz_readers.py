"""Coverage-guided fuzzing of all that is read from disk (atheris): ``python -m bench.fuzz_readers [--seconds 60]``.

Needs ``pip install atheris``. Every reader of tests/fuzz/readers.py is given valid files, broken ones, and what
atheris makes of them, in a process of its own for so many seconds. A reader must return or raise ``InputError`` in one
line; anything else is a crash, its input is kept in --out. One JSON line at the end.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent

CORPUS = 50
"""Files to begin with."""


ROOMS = ("sim_driver", "spatial", "comms", "agent", "rbpf")


def kernels() -> list[str]:
    """Return the modules that numba compiles: it cannot read what atheris makes of them."""
    files = [path.relative_to(HERE.parent) for room in ROOMS for path in (HERE.parent / room).rglob("*.py")]
    return [
        ".".join(("mrslam", *path.with_suffix("").parts))
        for path in files
        if "njit" in (HERE.parent / path).read_text()
    ]


def fuzz(name: str, seconds: int, out: Path) -> None:
    """Fuzz one reader in this process, which atheris ends."""
    import atheris

    with atheris.instrument_imports(include=[f"mrslam.{room}" for room in ROOMS], exclude=kernels()):
        from mrslam.spatial import InputError
        from tests.fuzz.readers import READERS, broken
    import numpy as np

    reader = next(reader for reader in READERS if reader.name == name)
    folder = Path(tempfile.mkdtemp())
    path = reader.make(folder)
    whole = path.read_bytes()
    corpus = out / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(0)
    for i in range(CORPUS):
        (corpus / f"{i:03d}").write_bytes(broken(whole, rng) if i else whole)

    def one(data: bytes) -> None:
        path.write_bytes(reader.seal(data) if len(data) % 2 else data)
        try:
            reader.read(path)
        except InputError as error:
            if "\n" in str(error):
                raise RuntimeError("the error has two lines") from error

    atheris.Setup(
        [sys.argv[0], str(corpus), f"-max_total_time={seconds}", f"-artifact_prefix={out}/", "-rss_limit_mb=4096",
         "-timeout=20", "-print_final_stats=1"],
        one,
    )  # fmt: skip
    atheris.Fuzz()


def main() -> int:
    """Fuzz every reader."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=60, help="for each reader")
    parser.add_argument("--readers", nargs="*", help="names; all unless given")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        fuzz(options.one, options.seconds, options.out)
        return 0
    from tests.fuzz.readers import READERS

    row: dict[str, object] = {}
    crashes = 0
    for reader in READERS:
        if options.readers and reader.name not in options.readers:
            continue
        out = options.out / re.sub(r"\W+", "-", reader.name)
        command = [
            sys.executable,
            "-m",
            "bench.fuzz_readers",
            "--one",
            reader.name,
            "--seconds",
            str(options.seconds),
            "--out",
            str(out),
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        runs = re.search(r"number_of_executed_units: (\d+)", done.stderr)
        found = sorted(path.name for path in out.glob("*-*") if path.is_file())
        row[reader.name] = {"runs": int(runs[1]) if runs else 0, "exit_code": done.returncode, "crashes": found}
        crashes += bool(found) or done.returncode != 0
        print(reader.name, row[reader.name], file=sys.stderr, flush=True)
        if done.returncode:
            print(done.stderr[-1500:], file=sys.stderr, flush=True)
    print(json.dumps({"what": "fuzz_readers", "seconds": options.seconds, "broken_readers": crashes, "readers": row}))
    return 1 if crashes else 0


if __name__ == "__main__":
    sys.exit(main())
