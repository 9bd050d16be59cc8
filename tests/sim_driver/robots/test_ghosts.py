"""The same drive mapped three ways: as it is, with teammates masked, and as if nobody else had been there."""

import numpy as np
import pytest

from mrslam.mutual_detection import TeammateTracker, mask_teammates
from mrslam.sim_driver.drivers import Explorer
from mrslam.sim_driver.robots import LASERS, NOBODY, Fleet, SimulatedRobot
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import se2
from tests.sim_driver.rehearsal import STEP_NS, TrueMapper


@pytest.fixture(scope="module")
def drive():
    """Five robots explore arena 2; each half second: pose, scan, scan of the empty world, poses of the others."""
    world, rng = load_world("arena2"), np.random.default_rng(6)
    starts = {}
    for i in range(5):
        taken = np.array([T[:2] for T in starts.values()]).reshape(-1, 2)
        starts[f"r{i}"] = world.free_start(rng, 0.3, taken)
    robots = {name: SimulatedRobot(world, T, LASERS["lidar-360"], rng.spawn(1)[0]) for name, T in starts.items()}
    fleet, one = Fleet(robots), TrueMapper(world, starts["r0"])
    drivers = {name: Explorer(seed=i) for i, name in enumerate(robots)}
    moments, grid = [], None
    for step in range(600):
        seen = fleet.observe(step * STEP_NS)
        if step % 5 == 0:
            for o in seen:
                alone = robots[o.robot_id].scan(o.scan.stamp_ns, NOBODY)
                moments.append((o.robot_id, o.T_world_base, o.scan, alone, fleet.T_world_base()))
                one.update(o.T_world_base, o.scan)
        if step % 10 == 0:
            grid = one.grid()
        commands = {}
        for o in seen:
            poses = {name: se2.between(one.T_world_map, T) for name, T in fleet.T_world_base().items()}
            commands[o.robot_id] = drivers[o.robot_id].command(
                o.scan.stamp_ns, poses.pop(o.robot_id), grid, poses, o.scan
            )
        fleet.step(commands)
    return world, starts["r0"], moments


def test_masking_removes_ghosts_and_keeps_walls(drive):
    world, T_world_map, moments = drive
    maps = {kind: TrueMapper(world, T_world_map) for kind in ("as it is", "masked", "alone")}
    trackers, rng, masked_beams = {}, np.random.default_rng(0), 0
    for name, T_world_base, scan, alone, everyone in moments:
        T_map_base = se2.between(T_world_map, T_world_base)
        tracker = trackers.setdefault(name, TeammateTracker())
        centres, radii = tracker.predict(scan.stamp_ns)  # half a second after the last beacon
        masked, count = mask_teammates(scan, T_map_base, centres, radii)
        masked_beams += count
        for kind, seen in (("as it is", scan), ("masked", masked), ("alone", alone)):
            if len(centres) or kind == "alone":  # the first moment has no beacon before it
                maps[kind].update(T_world_base, seen)
        for other in sorted(everyone.keys() - {name}):
            place = se2.apply(se2.inverse(T_world_map), everyone[other][:2]) + rng.normal(0.0, 0.03, 2)
            tracker.observe(other, scan.stamp_ns, place, 0.03**2 * np.eye(2))
    hit = {kind: mapper.hits > 0 for kind, mapper in maps.items()}
    rows, cols = np.indices(hit["alone"].shape)
    centres = (np.stack([cols, rows], axis=-1) + 0.5 + maps["alone"].cell0) * maps["alone"].resolution_m
    off_walls = world.clearance_m(se2.apply(T_world_map, centres)) > 0.15
    ghosts = {kind: np.count_nonzero(cells & off_walls) for kind, cells in hit.items()}
    assert masked_beams > 1000
    assert ghosts["as it is"] > 200
    assert ghosts["masked"] <= 0.02 * ghosts["as it is"]
    # True walls: cells that were hit at least thrice where nobody stood in the way.
    wall = (maps["alone"].hits >= 3) & ~off_walls
    lost = np.count_nonzero(wall & hit["as it is"] & ~hit["masked"])
    assert lost <= 0.001 * np.count_nonzero(wall & hit["as it is"])
