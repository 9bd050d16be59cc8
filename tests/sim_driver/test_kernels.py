"""Kernels are compiled once, by two processes, and said to be."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from mrslam.sim_driver import kernels

CODE = """
from mrslam.sim_driver.kernels import ensure_compiled
said = []
ensure_compiled(said.append, ("sim_driver.robots", "mutual_detection"))
print(" ".join(said))
"""


def compiled(cache: Path) -> str:
    environment = {**os.environ, "MRSLAM_CACHE": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run([sys.executable, "-c", CODE], env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def test_compiles_what_is_not_on_disk_and_says_so_once(tmp_path: Path) -> None:
    said = compiled(tmp_path)
    assert "First run" in said
    assert "compiling sim_driver.robots" in said
    assert "mutual_detection" in said
    assert {path.name.split("_")[0] for path in tmp_path.glob("kernels/*/*") if any(path.glob("*.nbc"))} >= {
        "robots",
        "mutual",
        "spatial",
    }
    assert compiled(tmp_path).strip() == ""


def test_what_the_second_process_fails_at_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []
    monkeypatch.setattr(kernels, "is_warm", lambda room: False)
    monkeypatch.setattr(kernels, "load_kernels", loaded.extend)
    monkeypatch.setattr(kernels.sys, "executable", "/bin/false")
    monkeypatch.setattr(kernels.os, "sched_getaffinity", lambda pid: {0, 1})
    kernels.ensure_compiled(lambda text: None, ("a", "b", "c"))
    assert loaded == ["a", "c", "a", "b", "c"]


def test_one_core_compiles_all_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []
    monkeypatch.setattr(kernels, "is_warm", lambda room: False)
    monkeypatch.setattr(kernels, "load_kernels", loaded.extend)
    monkeypatch.setattr(kernels.os, "sched_getaffinity", lambda pid: {0})
    kernels.ensure_compiled(lambda text: None, ("a", "b"))
    assert loaded[:2] == ["a", "b"]


def test_ctrl_c_while_kernels_are_loaded_comes_after_the_package_that_is_under_way() -> None:
    """In a compiler's callback it would be lost, or come out as an error of its own."""
    done: list[str] = []

    def warm_up() -> None:
        signal.raise_signal(signal.SIGINT)
        done.append("warm")

    room, before = SimpleNamespace(warm_up=warm_up), signal.signal(signal.SIGINT, signal.default_int_handler)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(kernels, "import_module", lambda name: room)
        patched.setattr(kernels, "mark_warm", done.append)
        with pytest.raises(KeyboardInterrupt):
            kernels.load_kernels(["rbpf", "merge"])
    assert done == ["warm"] and signal.signal(signal.SIGINT, before) is signal.default_int_handler
