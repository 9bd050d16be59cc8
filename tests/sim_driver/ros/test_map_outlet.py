"""A map topic: whoever comes late has the newest map, and an unchanged one is repeated."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: .ci/ros-env FOLDER makes an environment with it")

from nav_msgs.msg import OccupancyGrid as GridMessage

from mrslam.sim_driver.ros.node.messages import grid_of, pose_with_covariance, transform_of
from mrslam.sim_driver.ros.node.outlets import MapOutlet
from mrslam.spatial import OccupancyGrid
from tests.sim_driver.ros.processes import LATCHED, PLAIN, Listener, domain, wait_for


def checkered(rows: int, cols: int) -> OccupancyGrid:
    cells = np.full((rows, cols), -1, dtype=np.int8)
    cells[::3, ::2], cells[1::3, ::2] = 0, 100
    return OccupancyGrid(cells, 0.05, (-1.0, 2.0))


def test_a_map_is_the_grid_cell_by_cell() -> None:
    grid = checkered(4, 7)
    message = grid_of(grid, "map", 1_500_000_000)
    assert (message.info.height, message.info.width, message.header.frame_id) == (4, 7, "map")
    assert list(message.data) == grid.cells.ravel().tolist()
    assert (message.info.origin.position.x, message.info.origin.position.y) == (-1.0, 2.0)
    assert message.info.origin.orientation.w == 1.0
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)


def test_covariance_and_transforms_are_where_ros_has_them() -> None:
    full = np.array(pose_with_covariance("map", 0, np.zeros(3), np.arange(9.0).reshape(3, 3)).pose.covariance)
    np.testing.assert_array_equal(full.reshape(6, 6)[np.ix_((0, 1, 5), (0, 1, 5))], np.arange(9.0).reshape(3, 3))
    assert full.sum() == 36.0
    moved = transform_of("map", "odom", grid_of(checkered(1, 1), "", 7).header.stamp, np.array([1.0, 2.0, np.pi]))
    assert (moved.header.frame_id, moved.child_frame_id) == ("map", "odom")
    assert moved.transform.rotation.z == pytest.approx(1.0) and moved.transform.translation.y == 2.0


def test_whoever_comes_late_has_a_large_map_soon(tmp_path: Any, record_property: Any) -> None:
    with domain(tmp_path, 101) as (_, listener):
        outlet = MapOutlet(listener.node, "map", "map", 10.0, "map_metadata")
        grid = checkered(1000, 1000)
        outlet.show(grid, 0, 0.0)
        late = Listener(101)
        try:
            begin_s = time.monotonic()
            late.listen(GridMessage, "/map", LATCHED)
            wait_for(lambda: late.newest("/map"), "the latched map", 20.0)
            record_property("latched_map_s", round(time.monotonic() - begin_s, 3))
            assert np.array_equal(np.frombuffer(late.newest("/map").data, dtype=np.int8), grid.cells.ravel())
        finally:
            late.close()


def test_it_is_published_when_it_changed_and_repeated_now_and_then(tmp_path: Any) -> None:
    with domain(tmp_path, 101) as (_, listener):
        listener.listen(GridMessage, "/map", PLAIN)
        outlet = MapOutlet(listener.node, "map", "map", 10.0)
        wait_for(lambda: outlet.is_heard, "the subscription", 20.0)
        grid, other = checkered(5, 5), checkered(6, 6)
        for shown, now_s in ((None, 0.0), (grid, 1.0), (grid, 5.0), (None, 10.9), (grid, 11.1), (other, 11.2)):
            outlet.show(shown, round(now_s * 1e9), now_s)
        wait_for(lambda: len(listener.heard["/map"]) >= 3, "the maps", 20.0)
        heard = [(one.info.height, one.header.stamp.sec) for one in listener.heard["/map"]]
        assert heard == [(5, 1), (5, 1), (6, 11)]
