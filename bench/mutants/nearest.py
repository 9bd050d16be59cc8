"""The order in which tests are run against a mutant: nearest to what it breaks first, so that most die in seconds."""

from __future__ import annotations

from pathlib import Path

TESTS = Path("tests")
SLOW = ("mark.slow", "subprocess", "processes")
"""Words in test files that take long."""
IS_SLOW = 4
"""Added to the rank of such files."""
TESTED_BY = {"bench": "chaos"}
"""Folder of the tests of a package that has none of its own name."""
PYTEST = ("-m", "pytest", "-p", "no:cacheprovider", "-q", "-x")


def nearest_first(package: str, file: str = "", top: Path = Path()) -> list[list[str]]:
    """Return the arguments of the runs that are all tests of a package, those nearest to a file in one before the rest.

    Nearest are those that bear its name, then those of its sub-package that import it, then others that do, then the
    rest of its sub-package. Those that start processes or say that they are slow come in a run of their own, before the
    rest: named together with the folder they would run in its order.

    file : str, path of a module from the top of the repository.
    """
    folder = TESTS / TESTED_BY.get(package, package)
    found = sorted((top / folder).rglob("test_*.py")) if file else []
    ranked = sorted((rank, path) for path in found if (rank := _rank(path, Path(file), top)) is not None)
    near, slow = (
        [str(path.relative_to(top)) for rank, path in ranked if (rank >= IS_SLOW) == is_slow]
        for is_slow in (False, True)
    )
    runs = [[*PYTEST, *files] for files in (near, slow) if files]
    rest = [*PYTEST, *(f"--ignore={path}" for path in (*near, *slow)), str(folder)]
    return runs if runs and len(near) + len(slow) == len(found) else [*runs, rest]


def _rank(path: Path, file: Path, top: Path) -> int | None:
    """Return how far a test file is from a module, None where nothing ties the two."""
    text = path.read_text(encoding="utf-8")
    module = ("" if file.parts[0] == "bench" else "mrslam.") + ".".join(file.with_suffix("").parts)
    imports = f"{module} import" in text or f"{module.rpartition('.')[0]} import {file.stem}\n" in text
    is_beside = len(file.parts) > 2 and path.parent == top / TESTS / file.parent
    if path.stem.startswith(f"test_{file.stem}"):
        rank = 0
    elif imports:
        rank = 1 if is_beside else 2
    elif is_beside:
        rank = 3
    else:
        return None
    return rank + IS_SLOW * any(word in text for word in SLOW)
