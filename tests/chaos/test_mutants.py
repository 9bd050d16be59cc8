"""Mutants are applied, judged, and taken back."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from bench.mutants.__main__ import Verdict, fail_unbroken, judge
from bench.mutants.lists import MUTANTS
from bench.mutants.mutant import Mutant
from bench.mutants.nearest import nearest_first
from bench.mutants.scratch import TOP, Scratch

PACKAGES = ("spatial", "rbpf", "alignment", "mutual_detection", "merge", "comms", "agent", "sim_driver")
LINES = Mutant("tests/chaos/test_mutants.py", "SUM = 1 + 1\n", "SUM = 1 + 2\n", "sums are wrong")
SUM = 1 + 1


def test_a_mutant_whose_text_is_not_there_once_is_stale(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path)
    gone = Mutant("spatial/se2.py", "no such text", "", "nothing")
    many = Mutant("spatial/se2.py", "cos", "sin", "everything")
    missing = Mutant("spatial/nowhere.py", "x", "y", "nothing")
    assert [judge(scratch, one, 60.0).word for one in (gone, many, missing)] == ["stale"] * 3


def test_a_mutant_is_in_the_copy_while_it_is_judged_and_nowhere_else(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path)
    path = scratch.top / LINES.file
    before, stamp_ns = path.read_text(), path.stat().st_mtime_ns
    with scratch.mutated(LINES) as is_there:
        assert is_there and "SUM = 1 + 2\n" in path.read_text()
        assert "SUM = 1 + 1\n" in (TOP / LINES.file).read_text()
    assert path.read_text() == before and path.stat().st_mtime_ns == stamp_ns


def test_what_calls_a_changed_kernel_is_compiled_anew(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path)
    mutant = Mutant("spatial/traversal.py", "NEVER = 1e30", "NEVER = 1e29", "nothing")
    caller, other = (scratch.top / name for name in ("sim_driver/worlds/radio.py", "merge/grids/fuse_kernels.py"))
    before = [path.stat().st_mtime_ns for path in (caller, other)]
    with scratch.mutated(mutant):
        during = [path.stat().st_mtime_ns for path in (caller, other)]
    assert during[0] != before[0] and during[1] == before[1]
    assert [path.stat().st_mtime_ns for path in (caller, other)] == before


def test_a_kernel_that_calls_the_changed_one_does_what_the_change_says(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path)
    kernel = "from numba import njit\n{}\n\n@njit(cache=True)\ndef {}():\n    return {}\n"
    callee, caller = (scratch.top / "spatial" / name for name in ("callee.py", "caller.py"))
    callee.write_text(kernel.format("", "two", "2"))
    caller.write_text(kernel.format("from mrslam.spatial.callee import two", "four", "2 * two()"))
    asked = [sys.executable, "-c", "from mrslam.spatial.caller import four; print(four())"]

    def said(**options: bool) -> str:
        return scratch.run(asked, 120.0, **options).output.strip()

    assert said() == "4"
    with scratch.mutated(Mutant("spatial/callee.py", "return 2", "return 3", "nothing")):
        assert said(spends_cache=True) == "6"
    assert said() == "4"


@pytest.mark.parametrize(("code", "failed"), [("raise SystemExit(1)", True), ("print('fine')", False)])
def test_a_command_fails_as_it_ends(tmp_path: Path, code: str, failed: bool) -> None:
    assert Scratch(tmp_path).run([sys.executable, "-c", code], 60.0).failed is failed


def test_what_hangs_is_ended_and_counts_as_noticed(tmp_path: Path) -> None:
    ended = Scratch(tmp_path).run([sys.executable, "-c", "import threading; threading.Event().wait()"], 1.0)
    assert ended.failed and "did not end within 1 s" in ended.output


def test_there_are_a_hundred_and_a_dozen_for_each_package() -> None:
    assert len(MUTANTS) >= 100
    assert all(sum(mutant.package == package for mutant in MUTANTS) >= 12 for package in PACKAGES)
    assert len({(mutant.file, mutant.old, mutant.new, mutant.chaos) for mutant in MUTANTS}) == len(MUTANTS)


def test_every_mutant_is_a_program_so_that_a_test_and_not_the_compiler_kills_it() -> None:
    for mutant in MUTANTS:
        text = mutant.applied_to((TOP / mutant.file).read_text(encoding="utf-8"))
        assert text is not None, f"stale: {mutant.harm}"
        if mutant.file.endswith(".py"):
            compile(text, mutant.file, "exec")


@pytest.mark.parametrize(
    ("file", "first"),
    [
        ("agent/pairs/hints.py", "tests/agent/pairs/test_hints.py"),
        ("agent/chosen_frame.py", "tests/agent/test_chosen_frame.py"),
        ("merge/joint/bend.py", "tests/merge/joint/test_bend.py"),
    ],
)
def test_the_nearest_tests_come_first_and_all_of_the_package_come(file: str, first: str) -> None:
    package = file.partition("/")[0]
    near, *slow, rest = nearest_first(package, file, TOP)
    names = [name for run in (near, *slow) for name in run if name.startswith("tests/")]
    assert names[0] == first and len(set(names)) == len(names)
    assert rest[-1] == f"tests/{package}" and {f"--ignore={name}" for name in names} <= set(rest)


def test_judges_of_chaos_are_tested_by_its_tests() -> None:
    near, *_, rest = nearest_first("bench", "bench/chaos/places.py", TOP)
    assert "tests/chaos/test_judges.py" in near and rest[-1] == "tests/chaos"


def test_near_tests_that_start_processes_have_a_run_of_their_own_before_the_rest() -> None:
    slow, rest = nearest_first("sim_driver", "sim_driver/run/run_process.py", TOP)[-2:]
    assert "tests/sim_driver/run/test_dying.py" in slow and "tests/sim_driver" not in slow
    assert "--ignore=tests/sim_driver/run/test_dying.py" in rest and rest[-1] == "tests/sim_driver"


def test_where_no_test_is_near_all_of_the_package_are_run_at_once() -> None:
    (only,) = nearest_first("agent", "agent/no_such_module.py", TOP)
    assert only[-1] == "tests/agent" and not any("--ignore" in word for word in only)


def test_a_mutant_that_only_the_rest_of_the_tests_notices_is_killed(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path)
    tests = scratch.top / "tests" / "spatial"
    for path in tests.rglob("test_*.py"):
        path.unlink()
    (tests / "test_se2.py").write_text("def test_holds(): pass\n")
    (tests / "test_rest.py").write_text("import mrslam.spatial.se2 as se2\ndef test_fails(): assert not se2.BROKEN\n")
    mutant = Mutant("spatial/se2.py", "def inverse(", "BROKEN = True\n\n\ndef inverse(", "nothing")
    verdict = judge(scratch, mutant, 60.0)
    assert verdict.word == "killed" and "test_rest.py" in verdict.by
    (tests / "test_rest.py").unlink()  # no test is left for the second run
    assert judge(scratch, mutant, 60.0).word == "SURVIVED"


def test_a_test_that_fails_on_the_program_as_it_is_proves_nothing(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path)
    (scratch.top / "tests" / "test_two.py").write_text("def test_holds(): pass\ndef test_fails(): raise ValueError\n")
    verdicts = [
        Verdict(LINES, "killed", f"FAILED tests/test_two.py::{name}", 1.0) for name in ("test_holds", "test_fails")
    ]
    assert fail_unbroken(scratch, verdicts[:1], 60.0) == []
    assert fail_unbroken(scratch, verdicts, 60.0) == ["tests/test_two.py::test_fails"]
