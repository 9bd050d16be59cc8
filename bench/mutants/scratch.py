"""A copy of the repository with a cache of compiled kernels of its own, in which mutants are applied and tested."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from bench.mutants.mutant import Mutant
from bench.mutants.warm import WarmPython

TOP = Path(__file__).resolve().parents[2]
CALLS = "\n# calls a mutant\n"
"""Added to the source of kernels that call a mutant's: numba knows by a source's time or content that it changed."""
WARM_UP = "from mrslam.sim_driver.kernels import ensure_compiled; ensure_compiled(print)"


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    failed: bool
    output: str
    seconds: float


class Scratch:
    """One copy; one mutant at a time is in it."""

    def __init__(self, folder: Path) -> None:
        """Copy what git knows or would add, with its times: numba's cache goes by them, or by the sources."""
        self.top, self._warm, self._spent = folder / "repository", folder / "kernels", folder / "kernels-of-a-mutant"
        shutil.rmtree(self.top, ignore_errors=True)
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=TOP, capture_output=True, check=True,
        )  # fmt: skip
        for name in filter(None, listed.stdout.decode().split("\0")):
            source, target = TOP / name, self.top / name
            if source.is_symlink() or source.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target, follow_symlinks=False)
        subprocess.run(["git", "init", "-q"], cwd=self.top, check=True)  # tests of this tool make copies of the copy
        self._warm.mkdir(parents=True, exist_ok=True)
        self._python = WarmPython(self.top)

    def warm_up(self) -> None:
        """Compile all kernels once."""
        ended = self.run([sys.executable, "-c", WARM_UP], 1800.0)
        if ended.failed:
            raise RuntimeError(f"kernels do not compile: {ended.output}")

    @contextmanager
    def mutated(self, mutant: Mutant) -> Iterator[bool]:
        """Apply a mutant for a while; yield False where its text is not found."""
        path = self.top / mutant.file
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        changed = mutant.applied_to(text)
        if changed is None:
            yield False
            return
        texts = {path: changed}
        texts |= {file: file.read_text(encoding="utf-8") + CALLS for file in self._kernels_calling(mutant.file)}
        before = {file: (file.read_text(encoding="utf-8"), file.stat()) for file in texts}
        for file, new in texts.items():
            file.write_text(new, encoding="utf-8")
        try:
            yield True
        finally:
            for file, (old, stat) in before.items():
                file.write_text(old, encoding="utf-8")
                os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))

    def _kernels_calling(self, file: str) -> list[Path]:
        """Return the files of kernels that may call one in this file: numba would run what it compiled of them before.

        None where the file has no kernel. A file counts that imports the module or its package, at whatever remove.
        """
        if "njit" not in (self.top / file).read_text(encoding="utf-8"):
            return []
        waiting = {path: path.read_text(encoding="utf-8") for path in self.top.rglob("*.py") if path.name != file}
        waiting = {path: text for path, text in waiting.items() if "njit" in text or path.name == "__init__.py"}
        found, names = list[Path](), _module_names(file)
        while news := [path for path, text in waiting.items() if any(f"from {name} import" in text for name in names)]:
            for path in news:
                del waiting[path]
                names |= _module_names(str(path.relative_to(self.top)))
            found += news
        return found

    def run(self, command: Sequence[str], timeout_s: float, *, spends_cache: bool = False) -> Ended:
        """Run a command in the copy with the copy's code; one that does not end in time has failed.

        ``spends_cache`` : kernels are not as they were, and what is compiled must not stay.
        """
        cache = self._warm
        if spends_cache:
            cache = self._spent
            shutil.rmtree(cache, ignore_errors=True)
            shutil.copytree(self._warm, cache)
        env = {**os.environ, "PYTHONPATH": str(self.top), "NUMBA_CACHE_DIR": str(cache)}
        start_s = time.monotonic()
        code, output = (
            self._pytest(command, env, timeout_s) if is_pytest(command) else self._run(command, env, timeout_s)
        )
        if code is None:
            output = f"did not end within {timeout_s:.0f} s"
        return Ended(code != 0, output, time.monotonic() - start_s)

    def _pytest(self, command: Sequence[str], env: Mapping[str, str], timeout_s: float) -> tuple[int | None, str]:
        """Return the exit code, None where it does not end in time, and what was said."""
        output = self._warm.parent / "output"
        process = self._python.start(command[3:], env, output)
        code = self._python.ended(timeout_s)
        _end(process)
        if code is None:
            self._python.ended()
        return code, output.read_text(encoding="utf-8", errors="replace")

    def _run(self, command: Sequence[str], env: Mapping[str, str], timeout_s: float) -> tuple[int | None, str]:
        process = subprocess.Popen(
            command, cwd=self.top, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True,
        )  # fmt: skip
        try:
            output = process.communicate(timeout=timeout_s)[0]
            return process.returncode, output
        except subprocess.TimeoutExpired:
            return None, ""
        finally:
            _end(process.pid)
            process.wait()


def is_pytest(command: Sequence[str]) -> bool:
    """Return whether a command is ``python -m pytest``."""
    return list(command[:3]) == [sys.executable, "-m", "pytest"]


def has_kernels(mutant: Mutant) -> bool:
    """Return whether the file that a mutant changes has kernels."""
    path = TOP / mutant.file
    return path.exists() and "njit" in path.read_text(encoding="utf-8")


def _module_names(file: str) -> set[str]:
    module = "mrslam." + file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    return {module}


def _end(process: int) -> None:
    """End a command with all that it started."""
    with suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)
