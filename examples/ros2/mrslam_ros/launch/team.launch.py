"""One mrslam node a robot, each in its own namespace.

    ros2 launch mrslam_ros team.launch.py robots:="r1 r2"                          several on one machine
    ros2 launch mrslam_ros team.launch.py robots:=r1 connect:=tcp/10.0.0.2:7447    one robot, on itself

With tf:=own, the default, every robot's tf is in its namespace, as Nav2 has it; with tf:=shared all are on /tf, and the
frames of a robot begin with its name.
"""

from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PARAMETERS = str(Path(__file__).parents[1] / "config" / "mrslam.yaml")
ARGUMENTS = {
    "robots": ("r1", "names of the robots, separated by blanks"),
    "team": ("team", "the team's name"),
    "listen": ("", "addresses where teammates reach the robot"),
    "connect": ("", "addresses of teammates or a router; empty, with no listen: found by multicast"),
    "params": (PARAMETERS, "file of parameters"),
    "tf": ("own", "own: tf in the robot's namespace; shared: on /tf, with the robot's name before its frames"),
    "use_sim_time": ("false", "time from /clock"),
}


def nodes(context: LaunchContext) -> list[Any]:
    """Return one node for each robot."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    return [robot_node(robot, given) for robot in given["robots"].split()]


def robot_node(robot: str, given: dict[str, str]) -> Node:
    """Return the node of one robot."""
    is_shared = given["tf"] == "shared"
    own = {
        "robot": robot,
        "team": given["team"],
        "listen": given["listen"],
        "connect": given["connect"],
        "frame_prefix": f"{robot}/" if is_shared else "",
        "use_sim_time": given["use_sim_time"].lower() == "true",
    }
    own_tf = [("/tf", "tf"), ("/tf_static", "tf_static")]
    return Node(
        package="mrslam_ros",
        executable="mrslam_node",
        name="mrslam",
        namespace=robot,
        output="screen",
        parameters=[given["params"], own],
        remappings=[("diagnostics", "/diagnostics"), *([] if is_shared else own_tf)],
        respawn=True,
        respawn_delay=2.0,
    )


def generate_launch_description() -> LaunchDescription:
    """Return what ros2 launch runs."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
