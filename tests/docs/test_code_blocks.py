"""What README and the documentation show can be run: Python blocks are, missions are read, command lines are parsed."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import typer.main

from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.settings import parse_assignment

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
GROUP = typer.main.get_command(app)
SOMEBODY = {"robots": [{"id": "r1"}, {"id": "r2"}, {"id": "r3"}], "world": {"name": "arena1"}}
"""Stands in for the rest of the mission that a fragment belongs to."""


def blocks(language: str) -> Iterator[tuple[str, str]]:
    """Yield (where, text) of every fenced block of a language."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for found in re.finditer(rf"^( *)```{language}\b[^\n]*\n(.*?)^\1```", text, re.MULTILINE | re.DOTALL):
            line = text[: found.start()].count("\n") + 1
            yield f"{page.relative_to(ROOT)}:{line}", re.sub(rf"^{found[1]}", "", found[2], flags=re.MULTILINE)


def command_lines() -> Iterator[tuple[str, list[str]]]:
    """Yield (where, words) of every call of mrslam in shell blocks, up to what ends a command."""
    for where, text in blocks("sh"):
        for line in text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            starts = [i for i, word in enumerate(words) if word == "mrslam" or word.endswith("/mrslam")]
            for start in starts:
                if start and words[start - 1] not in ("&&", ";", "|", "do"):
                    continue  # a folder of that name
                call = words[start + 1 :]
                ends = [i for i, word in enumerate(call) if word in ("&&", ";", "|", ">", "2>", "&", "done")]
                yield where, call[: min(ends, default=len(call))]


def inline_calls() -> Iterator[tuple[str, list[str]]]:
    """Yield (where, words) of every `mrslam ...` within a line of text or a table."""
    for page in PAGES:
        prose = re.sub(r"^( *)```.*?^\1```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for found in re.finditer(r"`mrslam ([^`]+)`", prose):
            yield f"{page.relative_to(ROOT)}: {found[0]}", shlex.split(found[1])


def check_call(words: list[str], *, whole: bool) -> None:
    """Raise unless sub-command and options exist, and, for a whole call, all that is required is there."""
    if words[0].startswith("--"):
        assert words[0] in {
            name for option in GROUP.params for name in [*option.opts, "--help", "--install-completion"]
        }, words
        return
    assert words[0] in GROUP.commands, f"there is no sub-command {words[0]!r}"
    if words[0] == "ros" and "--ros-args" in words:  # what follows is ROS's
        words = words[: words.index("--ros-args")]
    command = GROUP.commands[words[0]]
    known = {name for option in command.params for name in [*option.opts, *option.secondary_opts]} | {"--help"}
    for word in words[1:]:
        if word.startswith("-") and not re.fullmatch(r"-?[\d.]+", word):
            assert word.partition("=")[0] in known, f"mrslam {words[0]} has no option {word}"
    for option, value in pairwise(words):
        if option == "--set":
            section, key = parse_assignment(value)[0]
            make_mission(SOMEBODY | {section: {key: parse_assignment(value)[1]}}, Path("mission.toml"))
    if whole and "--help" not in words:
        command.make_context(words[0], words[1:])


def given(found: Iterator[tuple[str, object]]) -> list[object]:
    return [pytest.param(value, id=where) for where, value in found]


@pytest.mark.parametrize("text", given(blocks("python")))
def test_python_runs(text: str, halves: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(halves[0].parents[1])  # a/map.yaml and b/map.yaml, as the blocks name them
    exec(compile(text, "block", "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize("text", given(blocks("toml")))
def test_mission_is_understood(text: str) -> None:
    tables = tomllib.loads(text)
    make_mission(tables if "robots" in tables else SOMEBODY | tables, Path("mission.toml"))


@pytest.mark.parametrize("words", given(command_lines()))
def test_command_line_is_understood(words: list[str]) -> None:
    check_call(words, whole=True)


@pytest.mark.parametrize("words", given(inline_calls()))
def test_call_in_the_text_is_understood(words: list[str]) -> None:
    check_call(words, whole=False)


@pytest.mark.parametrize("words", given(command_lines()))
def test_what_comes_with_the_project_is_there(words: list[str]) -> None:
    for word in words:
        if word.startswith(("missions/", "docs/", "examples/")):
            assert (ROOT / word).exists(), word


@pytest.mark.parametrize("page", [pytest.param(page, id=str(page.relative_to(ROOT))) for page in PAGES])
def test_links_and_scripts_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), target
    for script in re.findall(r"\bpython ((?:bench|examples)/\w+\.py)", text):
        assert (ROOT / script).exists(), script


@pytest.mark.parametrize("name", sorted(GROUP.commands))
def test_help_of_every_command_has_an_example_that_is_right(name: str) -> None:
    command = GROUP.commands[name]
    examples = [line.strip() for line in (command.help or "").splitlines() if line.strip().startswith("mrslam ")]
    assert examples, f"mrslam {name} --help shows no example"
    for example in examples:
        words = shlex.split(re.split(r"  +|\|", example)[0])[1:]
        assert words[0] in GROUP.commands
        check_call(words, whole=False)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["mapp", "x.clf"], "no sub-command"),
        (["map", "x.clf", "--partikles", "3"], "no option --partikles"),
        (["run", "--set", "comms.exchange_timeot_s=3"], "exchange_timeout_s"),
    ],
)
def test_a_wrong_call_is_found(words: list[str], error: str) -> None:
    with pytest.raises(Exception, match=error):
        check_call(words, whole=False)
