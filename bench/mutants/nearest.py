"""The order in which tests are run against a mutant: nearest to what it breaks first, so that most die in seconds."""

from __future__ import annotations

from pathlib import Path

TESTS = Path("tests")


def nearest_first(package: str, file: str = "", top: Path = Path()) -> list[str]:
    """Return the arguments that run all tests of a package, nearest to a file first.

    Nearest are those that bear its name, then those that import it, then those of its sub-package, each with the files
    that hold no slow test first.

    file : str, path of a module from the top of the repository.
    """
    folder = TESTS / package
    arguments = ["-m", "pytest", "-p", "no:cacheprovider", "-q", "-x"]
    if not file:
        return [*arguments, str(folder)]
    found = sorted((top / folder).rglob("test_*.py"))
    near = sorted((rank, path) for path in found if (rank := _rank(path, Path(file), top)) is not None)
    return [*arguments, *(str(path.relative_to(top)) for _, path in near), str(folder)]


def _rank(path: Path, file: Path, top: Path) -> tuple[int, bool] | None:
    """Return how far a test file is from a module, None where nothing ties the two."""
    text = path.read_text(encoding="utf-8")
    module = "mrslam." + ".".join(file.with_suffix("").parts)
    is_slow = "mark.slow" in text
    if path.stem.startswith(f"test_{file.stem}"):
        return 0, is_slow
    if f"{module} import" in text or f"{module.rpartition('.')[0]} import {file.stem}\n" in text:
        return 1, is_slow
    if len(file.parts) > 2 and path.parent == top / TESTS / file.parent:
        return 2, is_slow
    return None
