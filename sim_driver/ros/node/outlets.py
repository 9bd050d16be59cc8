"""What the node publishes: transforms, poses, maps, the team, diagnostics."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as GridMessage
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from mrslam.sim_driver.ros.complaints import Complaints
from mrslam.sim_driver.ros.node import markers, qos
from mrslam.sim_driver.ros.node.messages import (
    grid_of,
    pose_with_covariance,
    stamped_pose,
    status_of,
    time_of,
    transform_of,
)
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.sim_driver.ros.outlook import Located, RosBody
from mrslam.spatial import OccupancyGrid, se2

NS = 1_000_000_000
BACKWARD_NS = NS
"""Transforms are stamped ever later, unless time itself ran backward by more than this, nanoseconds."""
SILENT_S = 2.0
"""Without a scan for this long the diagnostics report an error, seconds."""


class MapOutlet:
    """A map topic: published when it has changed, and now and then although it has not."""

    def __init__(self, node: Node, topic: str, frame: str, repeat_s: float, metadata: str | None = None) -> None:
        """Make the publishers; ``metadata`` : topic of the map's metadata, if any."""
        self.message: GridMessage | None = None
        """What was published last."""
        self._publisher = node.create_publisher(GridMessage, topic, qos.LATCHED)
        self._metadata = None if metadata is None else node.create_publisher(MapMetaData, metadata, qos.LATCHED)
        self._frame, self._repeat_s = frame, repeat_s
        self._shown: OccupancyGrid | None = None
        self._published_s = 0.0

    @property
    def is_heard(self) -> bool:
        """Whether anybody subscribes."""
        return bool(self._publisher.get_subscription_count() > 0)

    def show(self, grid: OccupancyGrid | None, stamp_ns: int, now_s: float) -> None:
        """Publish a map where it is another than before, or the last one again when it is time to."""
        if grid is not None and grid is not self._shown and grid.cells.size:
            self._shown, self.message = grid, grid_of(grid, self._frame, stamp_ns)
        elif self.message is None or now_s - self._published_s < self._repeat_s:
            return
        self._published_s = now_s
        self._publisher.publish(self.message)
        if self._metadata is not None and self.message is not None:
            self._metadata.publish(self.message.info)


class Outlets:
    """All publishers of a node; :attr:`counts` says how often each published."""

    def __init__(self, node: Node, options: RosOptions, body: RosBody, complaints: Complaints) -> None:
        """Make the publishers; the frames are those of the options."""
        self._node, self._options, self._body, self._complaints = node, options, body, complaints
        self._map_frame, self._team_frame = options.frame(options.map_frame), options.frame(options.team_map_frame)
        self._tf = node.create_publisher(TFMessage, "/tf", qos.TF) if options.publish_tf else None
        self._pose = node.create_publisher(PoseWithCovarianceStamped, "pose", qos.PLAIN)
        self._mates: dict[str, Any] = {}
        self._graph = node.create_publisher(MarkerArray, "team_graph", qos.PLAIN)
        self._links = node.create_publisher(MarkerArray, "team_links", qos.PLAIN)
        self._diagnostics = node.create_publisher(DiagnosticArray, "diagnostics", qos.PLAIN)
        self.map = MapOutlet(node, "map", self._map_frame, options.map_repeat_s, "map_metadata")
        self.team_map = MapOutlet(node, "team_map", self._team_frame, options.map_repeat_s)
        self._stamped_ns = 0
        self._team_due_s = 0.0
        self._counted: Counter[str] = Counter()
        body.on_located = self.publish_pose
        body.wants_team_map = self._wants_team_map

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _stamp_ns(self) -> int:
        """Return the time of the scans now: the newest one's stamp, and what passed since it came."""
        located, now_ns = self._body.located, self._now_ns()
        return now_ns if located is None else located.stamp_ns + max(now_ns - located.arrived_ns, 0)

    def _wants_team_map(self) -> bool:
        now_s = self._now_ns() / NS
        if not self.team_map.is_heard and 0.0 <= now_s - self._team_due_s < self._options.map_repeat_s:
            return False
        self._team_due_s = now_s
        return True

    @property
    def _has_map(self) -> bool:
        return self._body.located is not None or self._body.own_map is not None

    # -- transforms and poses ------------------------------------------------------------------------------------------

    def publish_transforms(self) -> None:
        """Publish map -> odom and the team's frames, stamped ahead; nothing before there is a map to show.

        A node that was started again has one at once, and map -> odom with its first scan.
        """
        if self._tf is None or not (self._has_map or self._options.mode == "central"):
            return
        stamp_ns = self._stamp_ns() + round(self._options.transform_timeout_s * NS)
        if self._stamped_ns - BACKWARD_NS < stamp_ns <= self._stamped_ns:
            return
        self._stamped_ns = stamp_ns
        transforms = self._own_transforms(stamp_ns) + self._team_transforms(stamp_ns)
        if transforms:
            self._tf.publish(TFMessage(transforms=transforms))

    def _own_transforms(self, stamp_ns: int) -> list[TransformStamped]:
        located, stamp, options = self._body.located, time_of(stamp_ns), self._options
        if not self._has_map:
            return []
        out = [transform_of(self._map_frame, self._team_frame, stamp, self._body.team.T_own_team)]
        if located is None:
            return out
        if options.odometry == "none":
            out.append(transform_of(self._map_frame, options.frame(options.base_frame), stamp, located.T_map_base))
        elif located.T_map_odom is not None:
            out.append(transform_of(self._map_frame, options.frame(options.odom_frame), stamp, located.T_map_odom))
        return out

    def _team_transforms(self, stamp_ns: int) -> list[TransformStamped]:
        team, stamp, out = self._body.team, time_of(stamp_ns), []
        for robot_id, T_team_map in team.T_team_map.items():
            if robot_id == self._options.robot:
                continue
            map_frame, base_frame = self._options.teammate_frames(robot_id)
            if map_frame:
                out.append(transform_of(self._team_frame, map_frame, stamp, T_team_map))
            if base_frame and robot_id in team.T_team_base:
                T_team_base = team.T_team_base[robot_id]
                if map_frame:
                    out.append(transform_of(map_frame, base_frame, stamp, se2.between(T_team_map, T_team_base)))
                else:
                    out.append(transform_of(self._team_frame, base_frame, stamp, T_team_base))
        return out

    def publish_pose(self, located: Located) -> None:
        """Publish where the robot was at a scan; called on the agent's thread."""
        self._pose.publish(
            pose_with_covariance(self._map_frame, located.stamp_ns, located.T_map_base, located.covariance)
        )

    # -- maps and team -------------------------------------------------------------------------------------------------

    def publish_maps(self) -> None:
        """Publish the maps that changed, or are due."""
        stamp_ns, now_s = self._stamp_ns(), self._now_ns() / NS
        self.map.show(self._body.own_map, stamp_ns, now_s)
        self.team_map.show(self._body.team_map, stamp_ns, now_s)

    def publish_team(self) -> None:
        """Publish where teammates are, and markers where somebody looks at them."""
        team, located, stamp_ns, own = self._body.team, self._body.located, self._stamp_ns(), self._options.robot
        for robot_id, T_team_base in team.T_team_base.items():
            if robot_id not in self._mates:
                topic = f"teammates/{re.sub('[^a-zA-Z0-9_]', '_', robot_id)}/pose"
                self._mates[robot_id] = self._node.create_publisher(PoseStamped, topic, qos.PLAIN)
            self._mates[robot_id].publish(stamped_pose(self._team_frame, stamp_ns, T_team_base))
        if self._graph.get_subscription_count():
            self._graph.publish(markers.team_graph(team, own, self._team_frame, stamp_ns))
        if self._links.get_subscription_count():
            T_team_own = None
            if located is not None:
                T_team_own = se2.compose(se2.inverse(team.T_own_team), located.T_map_base)
            self._links.publish(markers.team_links(team, own, T_team_own, self._team_frame, stamp_ns))

    # -- diagnostics ---------------------------------------------------------------------------------------------------

    def publish_diagnostics(self, scans: int, odometry: int, scan_age_s: float | None) -> None:
        """Publish how the robot fares: ``scans`` and ``odometry`` that came so far, and how long ago the last scan."""
        array = DiagnosticArray()
        array.header.stamp = time_of(self._now_ns())
        array.status = [self._input_status(scans, odometry, scan_age_s), self._team_status()]
        self._diagnostics.publish(array)

    def _input_status(self, scans: int, odometry: int, scan_age_s: float | None) -> Any:
        new = self._complaints.counts - self._counted
        self._counted = Counter(self._complaints.counts)
        level, words = 0, "mapping"
        if self._options.mode == "central":
            words = "without a laser, for it only merges"
        elif scan_age_s is None or scan_age_s > SILENT_S:
            level, words = 2, "no scans"
        elif self._body.waits_for:
            level, words = 1, f"not localised in {self._body.waits_for} yet"
        elif self._body.located is None:
            level, words = 1, "no scan was mapped yet"
        elif new:
            level, words = 1, ", ".join(sorted(new))
        values = {"scans": scans, "odometry": odometry, "scans lost": self._body.scans_lost}
        values |= {f"trouble: {kind}": count for kind, count in sorted(self._complaints.counts.items())}
        return status_of(f"{self._name}: scans", self._options.robot, level, words, values)

    def _team_status(self) -> Any:
        team = self._body.team
        placed = sorted(team.T_team_map.keys() - {self._options.robot})
        words = f"merged with {', '.join(placed)}" if placed else "merged with nobody"
        values: dict[str, object] = {f"link to {one.peer}": f"{one.quality:.2f}, {one.activity}" for one in team.links}
        values |= {f"maps {a}-{b}": f"{words} ({c})" for a, b, c, words in team.edges}
        return status_of(f"{self._name}: team", self._options.robot, 0, words, values)

    @property
    def _name(self) -> str:
        return str(self._node.get_fully_qualified_name()).lstrip("/")
