"""Runs of pytest in children of a process that has the libraries loaded: two fifths of a short run are their import.

``python bench/mutants/warm.py`` waits on its input for requests, one JSON line each, and answers each with two lines:
the child's process, and how it ended. It imports nothing of the program, so that each child finds it as it is then.
"""

from __future__ import annotations

import importlib
import json
import os
import select
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

LIBRARIES = (
    "numpy", "numba", "scipy.sparse.linalg", "scipy.optimize", "scipy.spatial", "cv2", "msgspec", "typer", "rich",
    "hypothesis", "zenoh", "lz4.frame", "cryptography.x509", "pytest", "_pytest.assertion.rewrite",
)  # fmt: skip


class WarmPython:
    """A Python with the libraries loaded, in a folder; it ends with the process that made it."""

    def __init__(self, folder: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).resolve())],
            cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0,
        )  # fmt: skip
        assert self._process.stdin is not None and self._process.stdout is not None
        self._requests, self._answers = self._process.stdin, self._process.stdout  # no buffer hides what is there

    def start(self, arguments: Sequence[str], env: Mapping[str, str], output: Path) -> int:
        """Start ``pytest`` with these arguments, and return its process, the leader of its group."""
        request = {"arguments": list(arguments), "env": dict(env), "output": str(output)}
        self._requests.write(json.dumps(request).encode() + b"\n")
        return int(self._answers.readline())

    def ended(self, timeout_s: float | None = None) -> int | None:
        """Return the exit code of what was started, None where it does not end in time."""
        if not select.select([self._answers], [], [], timeout_s)[0]:
            return None
        return int(self._answers.readline())


def _serve() -> None:
    for name in LIBRARIES:
        importlib.import_module(name)
    for line in sys.stdin:
        request = json.loads(line)
        child = os.fork()
        if child == 0:
            _be_pytest(**request)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def _be_pytest(arguments: list[str], env: dict[str, str], output: str) -> None:
    os.setsid()
    file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream, target in ((file, 1), (file, 2), (os.open(os.devnull, os.O_RDONLY), 0)):
        os.dup2(stream, target)
    os.environ.clear()
    os.environ.update(env)
    sys.modules["numba.core.config"].reload_config()  # where it keeps kernels
    sys.path[0] = str(Path.cwd())
    sys.path[1:1] = env["PYTHONPATH"].split(os.pathsep)
    code = 3
    try:
        code = int(sys.modules["pytest"].main(arguments))
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    _serve()
