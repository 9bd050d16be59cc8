"""The maps of a store as a state that can be written to disk and restored."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mrslam.comms.maps.snapshots import Proof, Snapshot
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.keyframe_codec import SCALE, to_blocks, to_key_scans
from mrslam.spatial import TILE_CELLS, Keyframes, KeyScans, Tile, TiledMap
from mrslam.spatial.tiles import MOST_CELLS, box_cells


def store_state(store: MapStore) -> dict[str, Any]:
    """Return the newest snapshot of every robot and the own epoch.

    What is staged is left out, and saved maps that this robot was given: it is given them again.
    """
    newest = {name: store.newest(name) for name in (*store.digest(), *store.saved_digest()) if name not in store.given}
    before, store.states = store.states, {}
    for robot, snapshot in newest.items():
        if snapshot is not None:
            held, state = before.get(robot, (None, {}))
            store.states[robot] = (snapshot, state if held is snapshot else _snapshot_state(snapshot))
    return {"epoch": store.own_epoch, "maps": {robot: state for robot, (_, state) in store.states.items()}}


def restore_store(store: MapStore, state: dict[str, Any], skip: int) -> None:
    """Restore the maps of an earlier run; the own map continues under its old epoch, ``skip`` revisions later.

    Between its last checkpoint and its end that run may have published revisions that are lost here and that teammates
    hold. Which tiles they changed is unknown, so all of the own map counts as changed and is sent once more.
    """
    epoch, kept = int(state["epoch"]), {robot: _snapshot(one) for robot, one in sorted(state["maps"].items())}
    store.own_epoch = epoch
    for robot, snapshot in kept.items():
        if robot in store.given:
            continue
        if robot == store.own_id:
            revision = snapshot.map.revision + skip
            tiles = {index: Tile(revision, tile.cells) for index, tile in snapshot.map.tiles.items()}
            blocks = tuple(replace(block, revision=revision) for block in snapshot.blocks)
            snapshot = replace(snapshot, map=TiledMap(snapshot.map.resolution_m, tiles, revision), blocks=blocks)
        store.put(robot, snapshot)


def _snapshot_state(snapshot: Snapshot) -> dict[str, Any]:
    """Return a snapshot of N tiles and K keyframes in B blocks as arrays of its own, read-only.

    ``places (N, 2)``, ``revisions (N,)``, ``cells (N, 64, 64) int8``; ``block_revisions (B,)``, ``stamps_ns (K,)``,
    ``poses (K, 3) int32`` (mm, mm, 0.1 mrad); ``proof`` in hex.
    """
    tiles = snapshot.map.tiles
    cells = (
        np.stack([tile.cells for tile in tiles.values()]) if tiles else np.empty((0, TILE_CELLS, TILE_CELLS), np.int8)
    )
    blocks, scans = snapshot.blocks, to_key_scans(snapshot.blocks)
    state: dict[str, Any] = {
        "epoch": snapshot.epoch,
        "revision": snapshot.map.revision,
        "resolution_m": snapshot.map.resolution_m,
        "places": np.array(list(tiles), dtype=np.int64).reshape(-1, 2),
        "revisions": np.array([tile.revision for tile in tiles.values()], dtype=np.int64),
        "cells": cells,
        "block_revisions": np.array([block.revision for block in blocks], dtype=np.int64),
        "stamps_ns": np.concatenate([block.stamps_ns for block in blocks]) if blocks else np.empty(0, np.int64),
        "proof": None if snapshot.proof is None else [part.hex() for part in vars(snapshot.proof).values()],
        "poses": np.concatenate([block.poses for block in blocks]) if blocks else np.empty((0, 3), np.int32),
        "scans": {"starts": scans.starts, "polar": scans.polar, "origins": scans.origins},
    }
    for array in (*state.values(), *state["scans"].values()):
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return state


def _snapshot(state: dict[str, Any]) -> Snapshot:
    tiles = {}
    for (row, col), revision, cells in zip(
        state["places"].tolist(), state["revisions"].tolist(), state["cells"], strict=True
    ):
        cells.flags.writeable = False
        tiles[row, col] = Tile(revision, cells)
    if box_cells(tiles) > MOST_CELLS:
        raise ValueError("a map is too wide")
    keyframes, scans = Keyframes(state["stamps_ns"], state["poses"] / SCALE), KeyScans(**state["scans"])
    blocks = tuple(
        replace(block, revision=revision)
        for block, revision in zip(to_blocks(keyframes, scans, (), 0), state["block_revisions"].tolist(), strict=True)
    )
    proof = None if state.get("proof") is None else Proof(*(bytes.fromhex(part) for part in state["proof"]))
    tiled = TiledMap(float(state["resolution_m"]), tiles, int(state["revision"]))
    return Snapshot(int(state["epoch"]), tiled, blocks, proof)
