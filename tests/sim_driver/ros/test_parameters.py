"""Parameters of the node: every option and setting, with its description; wrong ones are named."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from mrslam.agent import Settings
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.sim_driver.ros.parameters import check_known, parameter_of, parameters, resolve
from mrslam.spatial import InputError

DEFAULTS = {one.name: one.default for one in parameters()}


def given(**changed: Any) -> dict[str, Any]:
    return DEFAULTS | {name.replace("__", "."): value for name, value in changed.items()}


def test_every_setting_is_a_parameter_with_its_description() -> None:
    settings = Settings()
    names = [
        f"{one.name}.{setting.name}" for one in fields(Settings) for setting in fields(getattr(settings, one.name))
    ]
    assert set(names) | {one.name for one in fields(RosOptions)} == DEFAULTS.keys()
    assert all(one.text for one in parameters())
    assert all(isinstance(one.default, float | int | str | None) for one in parameters())  # what ROS can declare
    assert DEFAULTS["comms.exchange_timeout_s"] == settings.comms.exchange_timeout_s


def test_defaults_are_the_settings_own_and_the_namespace_names_the_robot() -> None:
    options, settings = resolve(given(), "/depot/r7")
    assert options == RosOptions(robot="r7") and settings == Settings()


def test_values_reach_options_and_settings() -> None:
    values = given(robot="a", listen="tcp/a:1 tcp/b:2", connect=["tcp/c:3", ""], rbpf__particles=7, scan_topics="l r")
    options, settings = resolve(values, "/")
    assert options.listen == ("tcp/a:1", "tcp/b:2") and options.connect == ("tcp/c:3",)
    assert options.scan_topics == ("l", "r") and settings.rbpf.particles == 7
    assert not options.multicasts and resolve(given(robot="a"), "/")[0].multicasts


def test_a_table_is_text_in_toml() -> None:
    _, settings = resolve(given(robot="a", agent__starts="{r1 = [1.0, 2.0, 0.5], r2 = [0, 0, 0]}"), "/")
    assert [float(value) for value in settings.agent.starts["r1"]] == [1.0, 2.0, 0.5]
    with pytest.raises(InputError, match=r"agent\.starts"):
        resolve(given(robot="a", agent__starts="r1"), "/")


def test_a_file_of_settings_counts_where_no_parameter_does(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text("[rbpf]\nparticles = 9\n[comms]\nlink_threshold = 0.5\n")
    _, settings = resolve(given(robot="a", config=str(path), rbpf__particles=7), "/")
    assert (settings.rbpf.particles, settings.comms.link_threshold) == (7, 0.5)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, "the robot needs a name"),
        ({"robot": "a", "odometry": "wheels"}, "odometry must be one of auto, tf, topic, none"),
        ({"robot": "a", "transform_period_s": 0.0}, "transform_period_s must be"),
        ({"robot": "a", "map_frame": ""}, "map_frame must be"),
        ({"robot": "a", "rbpf__particles": -1}, "rbpf.particles"),
        ({"robot": "a", "rbpf__particles": "many"}, "rbpf.particles"),
        ({"robot": "a", "seed": -1}, "seed must be"),
        ({"robot": "a", "transform_timeout_s": -1.0}, "transform_timeout_s must be"),
    ],
)
def test_what_makes_no_sense_is_named(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        resolve(given(**changed), "/")


def test_a_misspelt_parameter_is_named_with_the_nearest() -> None:
    check_known(["rbpf.particles", "use_sim_time", "qos_overrides./tf.publisher.depth"])
    with pytest.raises(InputError, match=r"'rbpf.particels'; did you mean 'rbpf.particles'"):
        check_known(["rbpf.particels"])


@pytest.mark.parametrize(
    ("option", "name"),
    [("--keys", "keys"), ("--map=office.mrslam", "maps"), ("--no-multicast", "multicast"), ("--save", None)],
)
def test_an_option_of_an_agent_is_named_as_the_parameter_that_says_the_same(option: str, name: str | None) -> None:
    assert parameter_of(option) == name


def test_frames_have_the_prefix() -> None:
    options = RosOptions(robot="r1", frame_prefix="r1/", teammate_base_frame="")
    assert options.frame("map") == "r1/map"
    assert options.teammate_frames("r2") == ("r1/teammates/r2/map", "")
