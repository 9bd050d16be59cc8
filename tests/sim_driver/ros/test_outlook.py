"""What a node shows of its agent, and what it has the agent's thread do."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.agent import Agent, AgentConfig, Keeper, Settings, WallClock
from mrslam.agent.known_map import KnownMap
from mrslam.agent.shells.body import Sensed
from mrslam.rbpf import MapperConfig
from mrslam.sim_driver.missions.run_files import CHECKPOINT
from mrslam.sim_driver.ros.outlook import Onlooker, RosBody
from mrslam.sim_driver.ros.sessions import Sessions
from mrslam.spatial import InputError, Scan, se2


def ranges_in_room(x_m: float, angles: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return ranges in a room of 6 m x 4 m, taken ``x_m`` from its centre."""
    with np.errstate(divide="ignore"):
        to_x = (np.where(np.cos(angles) > 0, 3.0, -3.0) - x_m) / np.cos(angles)
        to_y = np.where(np.sin(angles) > 0, 2.0, -2.0) / np.sin(angles)
    return np.minimum(to_x, to_y).astype(np.float32)


def room(stamp_ns: int, x_m: float = 0.0) -> Scan:
    """A scan of that room."""
    angles = np.linspace(-3.0, 3.0, 300)
    ranges_m = ranges_in_room(x_m, angles)
    step_rad = float(angles[1] - angles[0])
    return Scan(
        stamp_ns=stamp_ns, ranges_m=ranges_m, angle_min_rad=-3.0, angle_increment_rad=step_rad, range_max_m=20.0
    )


def make_agent() -> Agent:
    return Agent("r1", Settings(rbpf=MapperConfig(particles=3)), team="team", seed=0, boot_id=1)


def drive(agent: Agent, body: RosBody, scans: int = 30, odom0: tuple[float, float, float] = (5.0, 1.0, 0.5)) -> None:
    """Let the agent map while it drives 0.9 m; its odometry begins anywhere."""
    for k in range(scans):
        x_m, now_ns = 0.9 * k / max(scans - 1, 1), k * 100_000_000
        T_odom_base = se2.compose(np.array(odom0), np.array([x_m, 0.0, 0.0]))
        body.take(room(now_ns, x_m), T_odom_base)
        sensed = body.sense(now_ns)
        assert sensed is not None
        agent.on_scan(sensed.scan, sensed.T_odom_base, now_ns)
        Onlooker(body).on_scan(agent, sensed, now_ns)
        body.act(agent, now_ns)


def test_map_to_odom_and_odom_to_base_give_the_pose_in_the_map() -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 7, period_s=2.0)
    heard = []
    body.on_located = heard.append
    drive(agent, body)
    located = body.located
    assert located is not None and len(heard) == 30 and heard[-1] is located
    assert (located.stamp_ns, located.arrived_ns) == (29 * 100_000_000, 7)
    T_odom_base = se2.compose(np.array([5.0, 1.0, 0.5]), np.array([0.9, 0.0, 0.0]))
    assert located.T_map_odom is not None
    np.testing.assert_allclose(se2.compose(located.T_map_odom, T_odom_base), located.T_map_base, atol=1e-9)
    np.testing.assert_allclose(located.T_map_base, [0.9, 0.0, 0.0], atol=0.03)
    assert located.covariance.shape == (3, 3) and (np.diag(located.covariance) > 0.0).all()


def test_the_maps_are_shown_when_they_changed_and_the_same_one_otherwise() -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=0.1)
    drive(agent, body)
    own, team = body.own_map, body.team_map
    assert own is not None and team is not None
    assert own.known_area_m2() == pytest.approx(24.0, abs=2.0) and team.known_area_m2() > 20.0
    body.look(agent, 10**12)
    assert body.own_map is own
    agent.team.take_map("r1", KnownMap((1, 99), agent.team.maps["r1"].local))
    body.look(agent, 2 * 10**12)
    assert body.own_map is not own and body.team_map is not team


def test_in_a_saved_maps_frame_nothing_is_shown_before_the_robot_is_localised() -> None:
    settings = Settings(rbpf=MapperConfig(particles=3, threads=1), agent=AgentConfig(frame="office@monday"))
    agent, body = Agent("r1", settings, team="team", seed=0, boot_id=1), RosBody(WallClock(), lambda: 0, period_s=0.1)
    drive(agent, body)
    assert body.located is None and body.own_map is None and body.waits_for == "office@monday"
    agent.frame.T_frame_map = np.array([10.0, 4.0, np.pi / 2])  # where it begins, as soon as it is localised
    body.on_mapped(agent, Sensed(3_000_000_000, room(3_000_000_000, 0.9), None))
    body.look(agent, 10**12)
    assert body.located is not None and body.own_map is not None and body.team_map is not None and not body.waits_for
    x_m, y_m, theta_rad = body.located.T_map_base
    assert (x_m, y_m, theta_rad) == pytest.approx((10.0, 4.9, np.pi / 2), abs=0.1)
    for grid in (body.own_map, body.team_map):  # the room is 6 m by 4 m, and stands upright there
        left_m, bottom_m = grid.cropped().origin_m
        assert (left_m, bottom_m) == pytest.approx((8.0, 1.0), abs=0.15)
    along, across = np.diag(agent.mapper.covariance)[:2]
    assert along != across and np.diag(body.located.covariance)[:2] == pytest.approx((across, along))
    assert body.team.T_team_map["r1"] == pytest.approx([10.0, 4.0, np.pi / 2])
    assert body.team.T_own_team == pytest.approx(np.zeros(3))  # both frames are the chosen one


def test_a_covariance_is_turned_with_its_pose() -> None:
    long_x = np.diag([4.0, 1.0, 0.1])
    np.testing.assert_allclose(se2.turned_covariance(long_x, np.pi / 2), np.diag([1.0, 4.0, 0.1]), atol=1e-12)


def test_a_team_map_that_nobody_wants_costs_nothing() -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=0.1)
    body.wants_team_map = lambda: False
    drive(agent, body)
    assert body.team_map is None and body.own_map is not None


def test_a_scan_without_odometry_leaves_the_transform_as_it_was() -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=2.0)
    drive(agent, body)
    assert body.located is not None
    before = body.located.T_map_odom
    scan = room(3_000_000_000, 0.9)
    agent.on_scan(scan, None, 3_000_000_000)
    body.on_mapped(agent, Sensed(3_000_000_000, scan, None))
    assert body.located.stamp_ns == 3_000_000_000 and body.located.T_map_odom is before


def test_what_services_ask_is_done_on_the_agents_thread_and_errors_come_back() -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=2.0)
    woken = []
    body.on_ready = lambda: woken.append(1)
    answer, failure = body.ask(lambda agent: agent.robot_id), body.ask(lambda agent: 1 // 0)
    assert not answer.done() and woken == [1, 1]
    body.act(agent, 0)
    assert answer.result(0) == "r1"
    with pytest.raises(ZeroDivisionError):
        failure.result(0)


def test_a_session_brings_the_map_back_and_what_ran_before_is_kept(tmp_path: Path) -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=2.0)
    sessions = Sessions(tmp_path, make_agent)
    with pytest.raises(InputError, match="holds no session"):
        sessions.newest()
    drive(agent, body)
    saved = sessions.save(agent)
    assert sessions.newest() == saved and not sessions.is_over
    sessions.reset()
    assert sessions.is_over
    Keeper(tmp_path / CHECKPOINT, 5.0).close(agent, 0)
    empty = sessions.take_next()
    assert empty is not None and empty.mapper.stats.scans == 0 and not sessions.is_over
    assert not (tmp_path / CHECKPOINT).exists() and len(list(sessions.folder.iterdir())) == 2
    assert sessions.load(saved).mapper.stats.scans == 30
    again = sessions.take_next()
    assert again is not None and again.mapper.stats.scans == 30
    np.testing.assert_array_equal(again.mapper.T_map_base, agent.mapper.T_map_base)
    held, loaded = agent.node.store.version("r1"), again.node.store.version("r1")
    assert loaded[0] > held[0]  # to teammates it is another map, however much the one that ran before has published


def test_the_newest_session_is_the_one_saved_last_whatever_its_name(tmp_path: Path) -> None:
    sessions = Sessions(tmp_path, make_agent)
    sessions.folder.mkdir()
    for name, saved_s in (("2026-11-21T10-00-00", 30), ("2026-11-21T10-00-00-10", 20), ("kept", 10)):
        (sessions.folder / f"{name}.session").touch()
        os.utime(sessions.folder / f"{name}.session", (saved_s, saved_s))
    assert sessions.newest().name == "2026-11-21T10-00-00.session"


def test_a_file_that_is_no_session_changes_nothing(tmp_path: Path) -> None:
    sessions = Sessions(tmp_path, make_agent)
    (tmp_path / "bad.session").write_bytes(b"no session")
    with pytest.raises(InputError, match=r"bad\.session"):
        sessions.load(tmp_path / "bad.session")
    assert not sessions.is_over and sessions.take_next() is None


def test_the_next_agent_is_shown_from_its_beginning() -> None:
    agent, body = make_agent(), RosBody(WallClock(), lambda: 0, period_s=2.0)
    drive(agent, body)
    body.begin()
    assert body.located is None and body.own_map is None and body.team_map is None
    drive(agent, body, 1)  # at the time of its first scan, which was long ago for the one before
    assert body.located is not None and body.own_map is not None and body.team_map is not None
