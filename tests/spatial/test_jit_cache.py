import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mrslam import jit_cache

TOP = Path(jit_cache.__file__).resolve().parents[1]


def copy_of_sources(tmp_path: Path) -> Path:
    """Copy the sources that the hash reads, so that they can be edited."""
    for package in jit_cache.PACKAGES:
        shutil.copytree(TOP / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def hash_of(top: Path, monkeypatch) -> str:
    monkeypatch.setattr(jit_cache, "__file__", str(top / "jit_cache.py"))
    return jit_cache.source_hash()


def test_an_edited_kernel_gets_another_folder_and_other_edits_do_not(tmp_path, monkeypatch):
    top = copy_of_sources(tmp_path)
    before = hash_of(top, monkeypatch)
    (top / "spatial" / "errors.py").write_text("# no kernels here\n")
    assert hash_of(top, monkeypatch) == before
    kernel = top / "spatial" / "distance.py"
    kernel.write_text(kernel.read_text() + "\n# edited\n")
    assert hash_of(top, monkeypatch) != before


def test_a_new_kernel_file_counts_too(tmp_path, monkeypatch):
    top = copy_of_sources(tmp_path)
    before = hash_of(top, monkeypatch)
    (top / "merge" / "another.py").write_text("from numba import njit\n")
    assert hash_of(top, monkeypatch) != before


def run(code: str, **environment: str) -> str:
    clean = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "MRSLAM_CACHE", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [sys.executable, "-c", code], env=clean | environment, cwd=TOP, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_importing_points_numba_at_the_folder_and_kernels_land_there(tmp_path):
    code = (
        "import numpy; from mrslam.spatial.distance import manhattan; from mrslam.jit_cache import is_warm, mark_warm;"
        "manhattan(numpy.ones((2, 2), dtype=bool)); cold = is_warm('spatial'); mark_warm('spatial');"
        "print(cold, is_warm('spatial'), is_warm('rbpf'))"
    )
    assert run(code, MRSLAM_CACHE=str(tmp_path)) == "False True False"
    assert list((tmp_path / "kernels").rglob("*.nbc"))


def test_numbas_own_setting_wins_also_when_numba_came_first(tmp_path):
    code = "import numba, mrslam; from numba.core import config; print(config.CACHE_DIR)"
    assert run(code, NUMBA_CACHE_DIR=str(tmp_path / "own")) == str(tmp_path / "own")
    assert run(code, MRSLAM_CACHE=str(tmp_path)).startswith(str(tmp_path / "kernels"))


def test_the_folder_follows_the_usual_variables(monkeypatch, tmp_path):
    monkeypatch.delenv("MRSLAM_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert jit_cache.cache_dir().parts[: len(tmp_path.parts) + 2] == (*tmp_path.parts, "mrslam", "kernels")
    monkeypatch.setenv("MRSLAM_CACHE", str(tmp_path / "mine"))
    assert jit_cache.cache_dir().parent == tmp_path / "mine" / "kernels"


def test_old_caches_are_deleted_but_for_the_newest(tmp_path, monkeypatch):
    monkeypatch.setenv("MRSLAM_CACHE", str(tmp_path))
    for i, folder in enumerate([jit_cache.cache_dir(), *(tmp_path / "kernels" / f"old{i}" for i in range(5))]):
        (folder / "x").mkdir(parents=True)
        os.utime(folder, (1000 + i, 1000 + i))
    jit_cache.forget_old(keep=2)
    assert {folder.name for folder in (tmp_path / "kernels").iterdir()} == {jit_cache.cache_dir().name, "old3", "old4"}
