"""A small team on an in-memory network, with a memory of what was true and checks of what must never happen."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from hashlib import blake2b

import numpy as np

from mrslam.comms import (
    CommsConfig,
    CommsNode,
    Effect,
    ExchangeDone,
    ExchangeFailed,
    Incoming,
    LinkConditions,
    MapUpdated,
    MemoryNetwork,
    Send,
)
from mrslam.comms.transport.memory import PERFECT
from mrslam.spatial import Keyframes, KeyScans, LocalMap, OccupancyGrid, Tile, TiledMap
from tests.comms.scans import noise_scans

SECOND = 1_000_000_000
QUICK = CommsConfig(
    exchange_timeout_s=2.0,
    link_source="model",
    beacon_period_s=1.0,
    backoff_s=0.5,
    backoff_max_s=2.0,
    retry_s=0.5,
    stall_timeout_s=4.0,
    window_tiles=3,
    history=3,
)


def fingerprint(local: LocalMap) -> bytes:
    digest = blake2b(digest_size=8)
    digest.update(repr((local.map.resolution_m, local.map.revision)).encode())
    for index in sorted(local.map.tiles):
        digest.update(repr((index, local.map.tiles[index].revision)).encode() + local.map.tiles[index].cells.tobytes())
    digest.update(local.keyframes.stamps_ns.tobytes() + local.keyframes.T_map_base.tobytes())
    digest.update(local.key_scans.starts.tobytes() + local.key_scans.points.tobytes())
    return digest.digest()


def big_map(cells: int = 1000, seed: int = 0, revision: int = 1) -> LocalMap:
    rng = np.random.default_rng(seed)
    grid = np.full((cells, cells), -1, dtype=np.int8)
    for _ in range(60):
        r, c = (int(v) for v in rng.integers(0, cells - 120, size=2))
        grid[r : r + 100, c : c + 110] = 0
        grid[r, c : c + 110] = grid[r : r + 100, c] = 100
    tiled = TiledMap.from_grid(OccupancyGrid(grid, 0.05), revision)
    drive = np.cumsum(rng.normal(scale=0.01, size=(500, 3)), axis=0)
    return LocalMap(tiled, Keyframes(np.arange(500) * SECOND, drive))


class GrowingMap:
    """A map that changes a little with every call."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.tiles: dict[tuple[int, int], Tile] = {}
        self.revision = 0
        self.stamps: list[int] = []
        self.poses: list[list[float]] = []
        self.scans = KeyScans.empty()

    def grow(self) -> LocalMap:
        self.revision += int(self.rng.integers(1, 4))
        for _ in range(int(self.rng.integers(2, 9))):
            index = tuple(int(v) for v in self.rng.integers(-2, 3, size=2))
            old = self.tiles.get(index)
            cells = np.full((64, 64), -1, dtype=np.int8) if old is None else old.cells.copy()
            r, c = self.rng.integers(0, 60, size=2)
            cells[r : r + 9, c : c + 9] = self.rng.choice(np.array([-1, 0, 50, 100], dtype=np.int8))
            self.tiles[index] = Tile(self.revision, cells)
        if self.tiles and self.rng.random() < 0.1:
            self.tiles.pop(next(iter(self.tiles)))
        for _ in range(int(self.rng.integers(0, 40))):
            self.stamps.append(len(self.stamps) * SECOND // 10)
            self.poses.append([float(v) for v in self.rng.normal(size=3)])
        self.scans = self.scans.append(noise_scans(len(self.stamps) - len(self.scans), self.revision, most=20))
        poses = np.array(self.poses).reshape(-1, 3)
        if self.rng.random() < 0.2:
            poses = poses + 0.01
        tiled = TiledMap(0.05, dict(self.tiles), self.revision)
        return LocalMap(tiled, Keyframes(np.array(self.stamps, dtype=np.int64), poses), self.scans)


class Team:
    """Robots on one network; ``groups`` partitions them."""

    def __init__(
        self,
        ids: Iterable[str],
        *,
        seed: int = 0,
        config: CommsConfig = QUICK,
        link: LinkConditions = PERFECT,
        reliable: bool = True,
        corrupt: float = 0.0,
        modes: dict[str, str] | None = None,
        step_ns: int = SECOND // 4,
    ) -> None:
        self.config, self.link, self.corrupt, self.step_ns = config, link, corrupt, step_ns
        self.rng = np.random.default_rng(seed)
        self.groups: dict[str, int] = {}
        self.network = MemoryNetwork(seed, self._conditions, reliable=reliable, queue_s=3.0)
        self.modes = modes or {}
        self.nodes: dict[str, CommsNode] = {}
        self.ends: dict[str, object] = {}
        self.maps: dict[str, GrowingMap] = {}
        self.truth: dict[tuple[str, int, int], bytes] = {}
        self.seen: dict[tuple[str, int, str], tuple[int, int]] = {}
        self.events: list[tuple[int, str, Effect]] = []
        self.boots = 0
        self.may_go_back = False  # by a robot's own word, where others had made up a version of its map
        self.now_ns = 0
        for robot in ids:
            self.start(robot)

    def _conditions(self, a: str, b: str, now_ns: int) -> LinkConditions:
        return self.link if self.groups.get(a, 0) == self.groups.get(b, 0) else LinkConditions(loss=1.0)

    def start(self, robot: str, boot_id: int | None = None) -> None:
        self.boots += 1
        boot = self.boots if boot_id is None else boot_id
        mode = self.modes.get(robot, "distributed")
        self.nodes[robot] = CommsNode(robot, "team", boot, self.config, mode=mode, seed=self.boots)
        self.ends[robot] = self.network.attach(robot)
        self.maps[robot] = GrowingMap(100 * self.boots + len(robot))

    def crash(self, robot: str) -> None:
        self.network.crash(robot)
        del self.nodes[robot], self.ends[robot]

    def publish(self, robot: str) -> None:
        if self.nodes[robot].mode != "central":
            self.nodes[robot].publish(self.maps[robot].grow(), self.now_ns)
            self._record(robot)

    def _record(self, robot: str) -> None:
        store = self.nodes[robot].store
        if robot in store.maps:
            version = store.version(robot)
            found = fingerprint(store.maps[robot])
            assert self.truth.setdefault((robot, *version), found) == found, "one version, two contents"

    def run(self, seconds: float) -> None:
        end_ns = self.now_ns + round(seconds * SECOND)
        while self.now_ns < end_ns:
            self.step()

    def step(self) -> None:
        self.now_ns += self.step_ns
        self.network.advance(self.now_ns)
        for robot, node in self.nodes.items():
            effects: list[Effect] = []
            for item in self.ends[robot].poll():
                if isinstance(item, Incoming):
                    item = replace(item, payload=self._maybe_broken(item.payload))
                effects += node.on_event(item, self.now_ns)
            if self.config.link_source != "measured":
                for peer in self.nodes:
                    if peer != robot:
                        same = self.groups.get(peer, 0) == self.groups.get(robot, 0)
                        effects += node.set_link_quality(peer, 1.0 if same else 0.0, self.now_ns)
            effects += node.on_tick(self.now_ns)
            for effect in effects:
                if isinstance(effect, Send):
                    self.ends[robot].send(effect)
                else:
                    self.events.append((self.now_ns, robot, effect))
            self._record(robot)
            self._check(robot, node, effects)

    def _maybe_broken(self, payload: bytes) -> bytes:
        if self.rng.random() >= self.corrupt:
            return payload
        broken = bytearray(payload)
        for _ in range(int(self.rng.integers(1, 4))):
            broken[int(self.rng.integers(len(broken)))] ^= 1 << int(self.rng.integers(8))
        return bytes(broken[: int(self.rng.integers(1, len(broken) + 1))])

    def _check(self, robot: str, node: CommsNode, effects: list[Effect]) -> None:
        for other, version in node.store.digest().items():
            key = (robot, node.boot_id, other)
            assert self.may_go_back or version >= self.seen.get(key, (0, 0)), f"{robot} went back on {other}"
            self.seen[key] = version
        for effect in effects:
            if isinstance(effect, MapUpdated):
                truth = self.truth[effect.robot_id, effect.epoch, effect.revision]
                assert fingerprint(effect.map) == truth, "content is not what was published"

    def of(self, kind: type, robot: str | None = None) -> list[Effect]:
        return [effect for _, who, effect in self.events if isinstance(effect, kind) and robot in (None, who)]

    def digests(self) -> list[dict[str, tuple[int, int]]]:
        return [node.store.digest() for node in self.nodes.values()]

    def agree(self) -> bool:
        digests = self.digests()
        return all(digest == digests[0] for digest in digests)

    def run_until(self, condition: Callable[[], bool], limit_s: float = 60.0) -> bool:
        """Move time on until it is true, or the limit is over; return whether it is."""
        end_ns = self.now_ns + round(limit_s * SECOND)
        while not condition() and self.now_ns < end_ns:
            self.step()
        return condition()

    def run_until_agreed(self, limit_s: float) -> bool:
        return self.run_until(self.agree, limit_s)

    def exchanges(self) -> tuple[int, int]:
        return len(self.of(ExchangeDone)), len(self.of(ExchangeFailed))
