"""The order in which tests are run against a mutant: nearest to what it breaks first, so that most die in seconds."""

from __future__ import annotations

from pathlib import Path

TESTS = Path("tests")
SLOW = ("mark.slow", "subprocess", "processes")
"""Words in test files that take long."""


def nearest_first(package: str, file: str = "", top: Path = Path()) -> list[str]:
    """Return the arguments that run all tests of a package, nearest to a file first.

    Nearest are those that bear its name, then those of its sub-package that import it, then others that do, then the
    rest of its sub-package. Those that start processes or say that they are slow come after all of these.

    file : str, path of a module from the top of the repository.
    """
    folder = TESTS / package
    arguments = ["-m", "pytest", "-p", "no:cacheprovider", "-q", "-x"]
    if not file:
        return [*arguments, str(folder)]
    found = sorted((top / folder).rglob("test_*.py"))
    near = sorted((rank, path) for path in found if (rank := _rank(path, Path(file), top)) is not None)
    return [*arguments, *(str(path.relative_to(top)) for _, path in near), str(folder)]


def _rank(path: Path, file: Path, top: Path) -> int | None:
    """Return how far a test file is from a module, None where nothing ties the two."""
    text = path.read_text(encoding="utf-8")
    module = "mrslam." + ".".join(file.with_suffix("").parts)
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
    return rank + 4 * any(word in text for word in SLOW)
