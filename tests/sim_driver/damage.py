"""A small real run and saved maps of it, and how a crash, a full disk or a careless hand damage each of their files."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rerun import FileSink, RecordingStream, TextLog

from mrslam.agent.shells.saved_files import saved_map_of
from mrslam.sim_driver.missions.agent_record import AgentRecord
from mrslam.spatial import read_map, write_map
from mrslam.spatial.files.saved_map import SUFFIX, write_saved_map
from tests.sim_driver.runs import played
from tests.spatial.archives import manifest, repacked

TABLES = {
    "mission": {"name": "small", "shell": "virtual", "seed": 4, "duration_s": 20.0},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1", "start": [7.2, 4.2, 0.0]}, {"id": "r2", "start": [9.5, 4.0, 0.0]}],
    "rbpf": {"particles": 3},
    "comms": {"exchange_timeout_s": 4.0, "beacon_window": 16},
}
"""Two robots that merge within 20 s."""
WORLD_S = 1_790_000_000.0
"""When the agents began, by the world's clock."""


def make_run(out: Path) -> Path:
    """Play the small mission into ``run``, and leave in ``agents`` what its robots would have left as agents.

    In ``maps`` lie a map with keyframes in one file, and one as map servers have it.
    """
    run = played(TABLES, out / "run")
    settings = json.loads((run / "config.json").read_text())["settings"]
    for robot_id in ("r1", "r2"):
        folder = out / "agents" / robot_id
        shutil.copytree(run / robot_id, folder, ignore=shutil.ignore_patterns("scans.npz", "truth.tum"))
        for name in ("events.jsonl", "robot.json"):
            (folder / name).write_text(_by_the_world(folder / name))
        (folder / "usage.json").write_text('{"cpu_s": 3.1, "peak_rss_mb": 210.0, "scan_age_ms": {}}\n')
        record = {"team": "small", "mode": "distributed", "log": None, "settings": settings}
        AgentRecord(id=robot_id, begun_s=WORLD_S, ended=True, **record).write(folder)
    with RecordingStream("damage", recording_id="damage") as stream:
        stream.set_sinks(FileSink(str(run / "run.rrd")))
        stream.log("words", TextLog("seen"))
        stream.flush()
        stream.disconnect()
    write_saved_map(out / "maps" / "office.mrslam", saved_map_of(run / "r1" / "map.yaml"))
    write_map(out / "maps" / "plain.yaml", read_map(run / "r2" / "map.yaml"))
    return out


def _by_the_world(path: Path) -> str:
    """Return a robot's file with its times by the world's clock."""
    if path.name == "robot.json":
        robot = json.loads(path.read_text())
        for pair in robot["pairs"]:
            pair["accepted_at_s"] = pair["accepted_at_s"] and pair["accepted_at_s"] + WORLD_S
        return json.dumps(robot)
    events = [json.loads(line) for line in path.read_text().splitlines()]
    return "".join(json.dumps({**event, "t": event["t"] + WORLD_S}) + "\n" for event in events)


def _as_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _as_link_to_nowhere(path: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


def _text(change: Callable[[str], str]) -> Callable[[Path], None]:
    """Return a change of a file as text; of other files it spoils some bytes in the middle."""

    def damage(path: Path) -> None:
        raw = path.read_bytes()
        try:
            path.write_text(change(raw.decode()))
        except UnicodeDecodeError:
            middle = len(raw) // 2
            path.write_bytes(raw[:middle] + b"\xff\x00\xfe" * 20 + raw[middle + 60 :])

    return damage


def _numbers(word: str) -> Callable[[Path], None]:
    """Return a change of every number in a text."""

    def change(text: str) -> str:
        parts, within = [], False
        for c in text:
            is_digit = c.isdigit() or (within and c in ".e-")
            if is_digit and not within and (not parts or not parts[-1][-1:].isalnum()):
                parts.append(word)
                within = True
            elif not (is_digit and within):
                within = False
                parts.append(c)
        return "".join(parts)

    return _text(change)


DAMAGE: dict[str, Callable[[Path], object]] = {
    "missing": lambda path: path.unlink(),
    "empty": lambda path: path.write_bytes(b""),
    "half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "without its end": lambda path: path.write_bytes(path.read_bytes()[:-3]),
    "a folder": _as_folder,
    "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "binary": lambda path: path.write_bytes(bytes(range(256)) * 16),
    "UTF-16": lambda path: path.write_bytes(path.read_bytes().decode("latin-1").encode("utf-16")),
    "another type": lambda path: path.write_text('[1, "two", null]\n'),
    "a string": lambda path: path.write_text('"robot"\n'),
    "null": lambda path: path.write_text("null\n"),
    "no keys": lambda path: path.write_text("{}\n"),
    "deep": lambda path: path.write_text("[" * 100_000),
    "a link to nowhere": _as_link_to_nowhere,
    "nan": _numbers("NaN"),
    "huge": _numbers("1e300"),
    "too huge": _numbers("1e999"),
    "long": _numbers("123456789012345678901234567890"),
    "negative": _numbers("-7"),
    "numbers as texts": _numbers('"5"'),
    "a line twice": _text(lambda text: "".join(line + line for line in text.splitlines(keepends=True))),
    "other names": _text(lambda text: text.replace("r1", "../../etc").replace("r2", "")),
    "all null": _text(lambda text: text.replace(": ", ': null, "_": ')),
}
"""What happened -> how it changes the file."""


def _another_map_in(path: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        image = archive.read("map.pgm")
    repacked(path, {"map.pgm": image[::-1]})


def _another_zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme", "hello")


SAVED_MAP_DAMAGE: dict[str, Callable[[Path], object]] = {
    "of a newer program": lambda path: repacked(path, manifest(path, format=2)),
    "another map in it": _another_map_in,
    "without keyframes": lambda path: repacked(path, {"keyframes.npz": None}),
    "another zip": _another_zip,
}
"""The same for saved maps in one file."""


@dataclass(frozen=True)
class Case:
    """One damaged file."""

    file: str
    """Path within the folder of :func:`make_run`."""
    damage: str

    def prepare(self, whole: Path, copy: Path) -> Path:
        """Copy the folder with this file damaged."""
        shutil.copytree(whole, copy)
        (DAMAGE | SAVED_MAP_DAMAGE)[self.damage](copy / self.file)
        return copy


def cases(whole: Path, under: str) -> Iterator[Case]:
    """Yield every file below ``run``, ``agents`` or ``maps``, damaged in every way; one robot stands for all."""
    for path in sorted((whole / under).rglob("*")):
        file = path.relative_to(whole)
        if path.is_file() and "r2" not in file.parts:
            ways = DAMAGE | SAVED_MAP_DAMAGE if path.suffix == SUFFIX else DAMAGE
            yield from (Case(str(file), damage) for damage in ways)
