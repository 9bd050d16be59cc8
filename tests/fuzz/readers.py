"""Everything the program reads from disk: a small valid file of each kind, its reader, and ways to break the file."""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrslam.agent import Agent, Settings, resume
from mrslam.agent.checkpoint import freeze, write
from mrslam.rbpf import Mapper, MapperConfig, load_checkpoint, save_checkpoint
from mrslam.sim_driver.cli.maps.merge import read_poses
from mrslam.sim_driver.evaluate.relations import read_relations
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.missions.mission import load_mission
from mrslam.sim_driver.missions.traces import LinkTrace
from mrslam.sim_driver.replay.recording import read_recording, write_recording
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import OccupancyGrid, Scan
from mrslam.spatial.files.map_files import read_map, write_map
from mrslam.spatial.files.tum import read_tum, write_tum
from tests.sim_driver.feeds.test_rosbag import NS, Recorder, target

EDGES = np.array([0, 1, 9, 10, 13, 32, 34, 44, 45, 46, 48, 57, 0x5B, 0x7F, 0x80, 0xC0, 0xFE, 0xFF], dtype=np.uint8)
"""Bytes that mean much: ends of lines, separators, digits, limits."""
WORDS = (b"-1", b"0", b"1e999", b"nan", b"inf", b"4294967296", b"-9223372036854775808", b"1e30", b"", b"null", b"[]")
"""What to put in a number's place."""


@dataclass(frozen=True)
class Reader:
    """One kind of file."""

    name: str
    """A file's name of this kind."""
    make: Callable[[Path], Path]
    """Writes a valid file below a folder and returns its path."""
    read: Callable[[Path], object]
    """Reads it to the end."""
    seal: Callable[[bytes], bytes] = bytes
    """Makes broken contents look whole (a checksum, a compression), so that they get past the gate."""
    plain: Callable[[bytes], bytes] = bytes
    """The opposite: what the seal is put on."""


def settings() -> Settings:
    """Return settings of a small robot."""
    return Settings(rbpf=MapperConfig(particles=2, threads=1))


def scans(count: int) -> list[Scan]:
    """Return scans in a square room while the robot drives a little."""
    angles = np.linspace(-np.pi, np.pi, 90, endpoint=False)
    made = []
    for i in range(count):
        wall = 2.0 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles))) - 0.1 * i * np.cos(angles)
        made.append(
            Scan(stamp_ns=i * NS // 10, ranges_m=wall.astype(np.float32), angle_min_rad=-np.pi,
                 angle_increment_rad=float(angles[1] - angles[0]), range_max_m=8.0)
        )  # fmt: skip
    return made


def _carmen(folder: Path) -> Path:
    lines = ["# CARMEN log", "PARAM robot_front_laser_max 81.92"]
    for i in range(6):
        ranges = " ".join(f"{1.0 + 0.01 * k:.2f}" for k in range(20))
        lines.append(f"ODOM {0.1 * i} 0 0 0.5 0 0 {i} host {i}")
        lines.append(f"FLASER 20 {ranges} {0.1 * i} 0 0 {0.1 * i} 0 0 {i} host {i}")
        lines.append(f"ROBOTLASER1 0 -1.57 3.14 0.1654 80 0.01 0 20 {ranges} 0 {0.1 * i} 0 0 0 0 0 0 0 0 0 {i} h {i}")
    path = folder / "log.clf"
    path.write_text("\n".join(lines) + "\n")
    return path


def _carmen_gz(folder: Path) -> Path:
    path = folder / "log.clf.gz"
    path.write_bytes(gzip.compress(_carmen(folder).read_bytes(), mtime=0))
    return path


def _bag(kind: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = target(folder, kind)
        with Recorder(path, kind) as out:
            for i in range(4):
                out.odometry(NS + i * NS // 10, 0.1 * i, 0.0, 0.2 * i)
                out.tf(NS + i * NS // 10, "base_link", "laser", 0.2, 0.0, 0.1)
                out.scan(NS + i * NS // 10, [1.0, 9.0, 0.05, 2.0])
        return path if kind == "bag" else next(path.glob(f"*.{kind}"))

    return make


def _grid() -> OccupancyGrid:
    rng = np.random.default_rng(0)
    return OccupancyGrid(rng.choice(np.array([-1, 0, 100], dtype=np.int8), size=(20, 30)), 0.05, (-1.0, -0.5))


def _map(suffix: str) -> Callable[[Path], Path]:
    """A map's YAML file, or the image beside it."""

    def make(folder: Path) -> Path:
        write_map(folder / "map.yaml", _grid())
        return folder / f"map{suffix}"

    return make


def _pair(folder: Path) -> Path:
    path = folder / "pair.npz"
    np.savez(path, a=_grid().cells, b=_grid().cells, res=0.05, origin_a=np.zeros(2), origin_b=np.zeros(2))
    return path


def _mission(folder: Path) -> Path:
    path = folder / "mission.toml"
    text = """
[mission]
seed = 1
duration_s = 5.0
[world]
name = "arena1"
[[robots]]
id = "r1"
start = [1.0, 1.0, 0.0]
[comms]
link_threshold = 0.5
[[faults]]
kind = "crash"
robot = "r1"
at_s = 1.0
"""
    path.write_text(text)
    return path


def _mapper(folder: Path) -> Path:
    mapper = Mapper(MapperConfig(particles=2, threads=1), seed=1)
    for i, scan in enumerate(scans(4)):
        mapper.update(scan, np.array([0.1 * i, 0.0, 0.0]))
    save_checkpoint(mapper, folder / "mapper.checkpoint")
    return folder / "mapper.checkpoint"


def _agent(folder: Path) -> Path:
    agent = Agent("r1", settings())
    for i, scan in enumerate(scans(4)):
        agent.on_scan(scan, np.array([0.1 * i, 0.0, 0.0]), scan.stamp_ns)
    write(freeze(agent), folder / "mrslam.agent.checkpoint")
    return folder / "mrslam.agent.checkpoint"


def _resealed(raw: bytes) -> bytes:
    """Give a state file the hash of what it holds."""
    head, _, body = raw.partition(b"\n")
    parts = head.split(b" ")
    if len(parts) != 3:
        return raw
    return b" ".join([*parts[:2], hashlib.sha256(body).hexdigest().encode()]) + b"\n" + body


def _text(name: str, text: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_text(text)
        return folder / name

    return make


def _tum(folder: Path) -> Path:
    write_tum(folder / "trajectory.tum", np.arange(5) * NS, np.zeros((5, 3)))
    return folder / "trajectory.tum"


def _recording(folder: Path) -> Path:
    from mrslam.agent import Sensed

    write_recording(folder / "scans.npz", [Sensed(scan.stamp_ns, scan, np.zeros(3)) for scan in scans(3)])
    return folder / "scans.npz"


def _resume(path: Path) -> None:
    before = path.read_bytes()
    resume(Agent("r1", settings()), path)
    assert path.read_bytes() != before or not before  # it saved itself at once


LINKS = "t_s,a,b,quality\n0,r1,r2,0.5\n1.5,r1,r2,1.0\n2,r2,r3,0\n"
RELATIONS = "0.0 1.0 0.5 0.0 0 0 0 0.1\n1.0 2.0 0.5 0.1 0 0 0 0.0\n"
POSES = "map,x_m,y_m,theta_rad\na,0,0,0\nb,1.5,-2,0.3\n"

READERS = (
    Reader("CARMEN log", _carmen, lambda path: open_feed(path).readings),
    Reader("CARMEN log, gzip", _carmen_gz, lambda path: open_feed(path).readings,
           lambda raw: gzip.compress(raw, mtime=0), gzip.decompress),
    Reader("CARMEN log, salvaged", _carmen, lambda path: open_feed(path, salvage=True).readings),
    Reader("ROS1 bag", _bag("bag"), lambda path: open_feed(path).readings),
    Reader("ROS1 bag, salvaged", _bag("bag"), lambda path: open_feed(path, salvage=True).readings),
    Reader("ROS2 db3", _bag("db3"), lambda path: open_feed(path).readings),
    Reader("ROS2 mcap", _bag("mcap"), lambda path: open_feed(path).readings),
    Reader("map YAML", _map(".yaml"), read_map),
    Reader("map image", _map(".pgm"), lambda path: read_map(path.with_suffix(".yaml"))),
    Reader("map bitmap", _map(".pgm"), lambda path: read_map(path, resolution_m=0.05)),
    Reader("map pair", _pair, lambda path: (read_map(path, "a"), read_map(path, "b"))),
    Reader("world YAML", _map(".yaml"), load_world),
    Reader("mission", _mission, load_mission),
    Reader("mapper checkpoint", _mapper, load_checkpoint, _resealed),
    Reader("robot checkpoint", _agent, _resume, _resealed),
    Reader("trajectory", _tum, read_tum),
    Reader("link trace", _text("links.csv", LINKS), LinkTrace.read),
    Reader("relations", _text("log.relations", RELATIONS), read_relations),
    Reader("known poses", _text("poses.csv", POSES), lambda path: read_poses(path, ["a", "b"])),
    Reader("recording", _recording, read_recording),
)  # fmt: skip


def broken(raw: bytes, rng: np.random.Generator) -> bytes:
    """Return contents with a few things wrong: bits, bytes, numbers, pieces missing, doubled or moved."""
    body = bytearray(raw)
    for _ in range(int(rng.integers(1, 5))):
        if not body:
            break
        at = int(rng.integers(len(body)))
        span = int(rng.integers(1, 40))
        match int(rng.integers(8)):
            case 0:
                body[at] ^= 1 << int(rng.integers(8))
            case 1:
                body[at] = int(rng.choice(EDGES))
            case 2:
                del body[at:]
            case 3:
                del body[at : at + span]
            case 4:
                body[at:at] = rng.integers(0, 256, span, dtype=np.uint8).tobytes()
            case 5:
                body[at:at] = body[max(at - span, 0) : at]
            case 6:
                _another_number(body, at, rng)
            case 7:
                lines = bytes(body).split(b"\n")
                i, j = (int(k) for k in rng.integers(len(lines), size=2))
                lines[i], lines[j] = lines[j], lines[i]
                body = bytearray(b"\n".join(lines))
    return bytes(body)


def _another_number(body: bytearray, at: int, rng: np.random.Generator) -> None:
    """Put another word where the next number is."""
    digits = b"0123456789.-"
    start = next((i for i in range(at, len(body)) if body[i] in digits), None)
    if start is None:
        return
    end = start
    while end < len(body) and body[end] in digits:
        end += 1
    body[start:end] = WORDS[int(rng.integers(len(WORDS)))]
