"""The ROS package: its parameters exist, its launch file starts a node a robot, its views show topics of ours."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml

from mrslam.agent import Settings
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.sim_driver.ros.parameters import check_known, parameters, resolve

PACKAGE = Path(__file__).parents[3] / "examples" / "ros2" / "mrslam_ros"


def test_the_parameters_file_names_parameters_and_keeps_the_defaults() -> None:
    values = yaml.safe_load((PACKAGE / "config" / "mrslam.yaml").read_text())["/**"]["ros__parameters"]
    check_known(values)
    options, settings = resolve({one.name: one.default for one in parameters()} | values, "/r1")
    assert options == RosOptions(robot="r1") and settings == Settings()


class Launch:
    """Stands in for the launch library, which has no wheel: keeps what it is given."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **given: str) -> None:
        self.nodes: list[dict[str, Any]] = []
        self.given = given
        self.defaults: dict[str, str] = {}
        names = {
            "launch": {"LaunchContext": object, "LaunchDescription": list},
            "launch.actions": {"DeclareLaunchArgument": self.declare, "OpaqueFunction": lambda function: function},
            "launch.substitutions": {"LaunchConfiguration": self.configuration},
            "launch_ros": {},
            "launch_ros.actions": {"Node": lambda **fields: self.nodes.append(fields)},
        }
        for name, content in names.items():
            module = ModuleType(name)
            vars(module).update(content)
            monkeypatch.setitem(sys.modules, name, module)
        *_, function = runpy.run_path(str(PACKAGE / "launch" / "team.launch.py"))["generate_launch_description"]()
        function(None)

    def declare(self, name: str, *, default_value: str, description: str) -> None:
        self.defaults[name] = default_value

    def configuration(self, name: str) -> Any:
        return SimpleNamespace(perform=lambda context: self.given.get(name, self.defaults[name]))


def test_the_launch_file_starts_a_node_a_robot_in_its_namespace(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = Launch(monkeypatch, robots="r1 r2", team="depot").nodes
    assert (first["namespace"], second["namespace"]) == ("r1", "r2")
    file, own = second["parameters"]
    assert Path(file).exists()
    check_known(own)
    assert (own["robot"], own["team"], own["frame_prefix"], own["use_sim_time"]) == ("r2", "depot", "", False)
    assert ("/tf", "tf") in second["remappings"] and ("diagnostics", "/diagnostics") in second["remappings"]
    setup = (PACKAGE / "setup.py").read_text()
    assert f"{second['executable']} = " in setup and f'NAME = "{second["package"]}"' in setup


def test_robots_that_share_tf_have_their_names_before_their_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    (node,) = Launch(monkeypatch, tf="shared").nodes
    assert node["parameters"][1]["frame_prefix"] == "r1/" and ("/tf", "tf") not in node["remappings"]


def test_the_view_shows_relative_topics() -> None:
    view = yaml.safe_load((PACKAGE / "rviz" / "mrslam.rviz").read_text())["Visualization Manager"]
    topics = {one["Name"]: one["Topic"]["Value"] for one in view["Displays"] if "Topic" in one}
    assert set(topics.values()) == {"team_map", "map", "scan", "pose", "team_links", "team_graph"}
    assert view["Global Options"]["Fixed Frame"] == RosOptions().team_map_frame
