"""A robot that only localises: it maps until it knows its place in a saved map, and again where it has lost it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, KnownMap, checkpoint, resume, write_robot
from mrslam.agent.effects import AlignJob, Effect, Event
from mrslam.agent.tracking import Tracking
from mrslam.alignment import Alignment, Evidence, WallEvidence
from mrslam.comms import TeammatePose
from mrslam.rbpf import Mapper
from mrslam.spatial import LocalMap, OccupancyGrid, Scan, TiledMap, read_tum, se2
from tests.agent.duo import SETTINGS, S, odometry, scan
from tests.agent.test_core import AHEAD_M, with_body

MONDAY = "office@monday"
T_OWN_SAVED = np.array([0.4, -0.3, 0.5])
"""Where the saved map lies in the map of a robot that begins at the same place."""


def saved_map() -> KnownMap:
    """The room of :mod:`tests.agent.duo`, in a frame of its own."""
    angles = np.linspace(-np.pi, np.pi, 2000)
    walls = np.stack([4.0 / np.abs(np.cos(angles)), 3.0 / np.abs(np.sin(angles) + 1e-9)]).min(axis=0)
    cells = np.full((300, 300), -1, dtype=np.int8)
    floor = np.linspace(0.0, 1.0, 400)[:, None] * (walls - 0.08)
    for reach, value in ((floor, 0), (walls[None], 100)):
        points = np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=-1).reshape(-1, 2)
        col, row = np.floor(se2.apply(se2.inverse(T_OWN_SAVED), points) / 0.05).astype(int).T + 150
        cells[row, col] = value
    grid = OccupancyGrid(cells, 0.05, (-7.5, -7.5))
    return KnownMap((7, 1), LocalMap(TiledMap.from_grid(grid)))


def robot(boot_id: int = 1, *, localise: bool = True) -> Agent:
    settings = replace(SETTINGS, agent=replace(SETTINGS.agent, localise=localise))
    agent = Agent("a", settings, boot_id=boot_id)
    agent.take_saved_map(MONDAY, saved_map())
    return agent


def localise(agent: Agent, t_ns: int) -> None:
    """Let the saved map be aligned twice with the robot's own."""
    merge_with(agent, MONDAY, T_OWN_SAVED, t_ns)


def merge_with(agent: Agent, other: str, T_own_other: np.ndarray, t_ns: int) -> None:
    """Let a map be aligned twice with the robot's own."""
    found = Alignment(
        T_a_b=T_own_other, confidence=0.9, evidence=Evidence(WallEvidence(50.0), WallEvidence(50.0)),
        covariance=1e-4 * np.eye(3), method="orb",
    )  # fmt: skip
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    versions = (agent.team.maps["a"].version, agent.team.maps[other].version)
    for n in range(2):
        agent.on_done(AlignJob("a", other, nothing, nothing, None, versions, (40.0, 40.0), n), found, t_ns + n)


def live(agent: Agent, scans: Iterable[int], look: Scan | None = None) -> list[Effect]:
    out: list[Effect] = []
    for k in scans:
        seen = scan(k) if look is None else shimmering(look, k)
        out += agent.on_scan(seen, odometry(k), k * S // 10)
        out += agent.on_tick(k * S // 10)
    return out


def shimmering(look: Scan, k: int) -> Scan:
    """Return a scan with a millimetre of noise: a laser that repeats itself to the bit is stuck."""
    noise = 1e-3 * np.sin(1.7 * k + np.arange(look.ranges_m.size))
    return replace(look, stamp_ns=k * S // 10, ranges_m=(look.ranges_m + noise).astype(np.float32))


def tracking_robot() -> Agent:
    agent = robot()
    live(agent, range(60))
    localise(agent, 6 * S)
    live(agent, range(60, 80))
    return agent


def kinds(effects: list[Effect]) -> list[str]:
    return [effect.kind for effect in effects if isinstance(effect, Event)]


def test_it_maps_until_it_is_localised_and_tracks_then() -> None:
    agent = robot()
    assert "mapped" in kinds(live(agent, range(60))) and not agent.tracking.is_on
    localise(agent, 6 * S)
    begun = live(agent, range(60, 63))
    assert kinds(begun).count("tracking") == 1 and agent.tracking.is_on
    keys, revision = agent.mapper.stats.processed, agent.team.maps["a"].version
    effects = live(agent, range(63, 160))
    assert agent.mapper.stats.processed == keys and agent.team.maps["a"].version == revision
    assert not {"mapped", "localised", "not_localised"} & set(kinds(effects))
    expected = se2.compose(se2.inverse(T_OWN_SAVED), odometry(159))
    (at,) = agent.whereabouts()
    assert at.state == "localised" and at.T_map_base == pytest.approx(expected, abs=0.06)
    assert agent.T_frame_base == pytest.approx(at.T_map_base)  # the saved map's frame is the chosen one
    assert se2.between(agent.T_map_base, odometry(159)) == pytest.approx(
        np.zeros(3), abs=0.06
    )  # and its own map's frame holds
    assert agent.scans == 160
    sigma = np.sqrt(np.diag(agent.covariance))
    assert agent.is_settled and (sigma > 0.0).all() and (sigma < 0.1).all()


def test_a_robot_that_is_to_map_does_not_track() -> None:
    agent = robot(localise=False)
    live(agent, range(60))
    localise(agent, 6 * S)
    live(agent, range(60, 80))
    assert not agent.tracking.is_on and agent.frame.saved_map == ""


def test_teammates_hear_where_it_is_in_its_own_map(monkeypatch: pytest.MonkeyPatch) -> None:
    agent = tracking_robot()
    told: list[np.ndarray] = []
    monkeypatch.setattr(agent.node, "set_own_pose", lambda T_map_base, *_: told.append(T_map_base))
    live(agent, range(80, 90))
    assert se2.between(told[-1], odometry(89)) == pytest.approx(np.zeros(3), abs=0.06)


def test_teammates_are_masked_in_the_right_direction_while_it_turns_and_tracks() -> None:
    agent = tracking_robot()
    agent.team.take_map("b", agent.team.maps["a"])
    merge_with(agent, "b", np.zeros(3), 8 * S)
    report = TeammatePose("b", 8 * S, np.array([AHEAD_M, 0.0, 0.0]), agent.team.maps["b"].epoch)
    agent._follow([report], 8 * S)
    seen, at_body = with_body(80)
    agent.on_scan(seen, odometry(80), 8 * S)
    assert agent.tracking.is_on and agent.scan is not None
    np.testing.assert_array_equal(np.isnan(agent.scan.ranges_m), at_body)


def test_the_covariance_is_along_the_axes_of_its_own_map() -> None:
    agent = tracking_robot()
    turn = se2.matrix(T_OWN_SAVED)[:2, :2]
    saved_m2 = agent.tracking.localiser.covariance[:2, :2]
    assert abs(saved_m2[0, 0] - saved_m2[1, 1]) + abs(saved_m2[0, 1]) > 0.05 * saved_m2[0, 0]
    np.testing.assert_allclose(agent.covariance[:2, :2], turn @ saved_m2 @ turn.T, rtol=0.1)


def test_no_map_is_aligned_again_while_it_tracks() -> None:
    agent = tracking_robot()
    agent.next_job(10 * S)
    live(agent, range(100, 140))
    assert agent.next_job(200 * S) is None and agent.next_job(400 * S) is None


def elsewhere() -> Scan:
    """A room of 1.5 x 8 m."""
    angles = np.linspace(-2.0, 2.0, 181)
    walls = np.stack([8.0 / np.abs(np.cos(angles)), 0.75 / np.abs(np.sin(angles) + 1e-9)]).min(axis=0)
    return replace(scan(0), ranges_m=walls.astype(np.float32))


def test_who_is_lost_says_so_and_maps_and_looks_again() -> None:
    agent = tracking_robot()
    before, number = agent.mapper, agent.map_number
    effects = live(agent, range(80, 500), elsewhere())
    lost = [effect for effect in effects if isinstance(effect, Event) and effect.kind == "lost"]
    assert len(lost) == 1 and lost[0].fields["map"] == MONDAY and "given_up" not in kinds(effects)
    assert "does not fit the saved map" in lost[0].fields["reason"] and "not_localised" in kinds(effects)
    assert not agent.tracking.is_on and agent.mapper is not before and agent.map_number == number + 1
    assert agent.T_frame_base is None
    (at,) = agent.whereabouts()
    assert at.state == "not yet" and "since then" in at.reason
    assert agent.next_job(100 * S) is not None
    agent = tracking_again(agent)
    assert len(agent.tracked_laser().stamps_ns) > 20
    assert agent.trajectory_laser().stamps_ns.min() >= 50 * S  # in the present own map
    assert agent.whereabouts()[0].state == "localised" and not agent.tracking.lost


def test_who_was_carried_off_while_it_saw_nothing_is_lost_at_the_first_scan_there() -> None:
    agent = tracking_robot()
    effects = agent.on_scan(shimmering(elsewhere(), 200), odometry(79), 20 * S)  # after 12 s, and no wheel turned
    lost = [effect for effect in effects if isinstance(effect, Event) and effect.kind == "lost"]
    assert [one.fields["reason"] for one in lost] == ["it was carried off"] and not agent.tracking.is_on


def tracking_again(agent: Agent) -> Agent:
    """Let a lost robot come back to the room, and find its place."""
    agent._begin_map()
    live(agent, range(500, 560))
    T_own_room = se2.inverse(odometry(500))
    found = se2.compose(T_own_room, T_OWN_SAVED)
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    alignment = Alignment(
        T_a_b=found, confidence=0.9, evidence=Evidence(WallEvidence(50.0), WallEvidence(50.0)),
        covariance=1e-4 * np.eye(3), method="orb",
    )  # fmt: skip
    version = agent.team.maps["a"].version
    for n in range(2):
        job = AlignJob("a", MONDAY, nothing, nothing, None, (version, (7, 1)), (40.0, 40.0), n)
        agent.on_done(job, alignment, 56 * S + n)
    live(agent, range(560, 580))
    return agent


def test_a_scan_that_does_not_fit_the_place_found_begins_nothing() -> None:
    agent = robot()
    live(agent, range(60))
    agent.team.take_map(MONDAY, KnownMap((7, 2), LocalMap(TiledMap.from_grid(turned_away()))))
    localise(agent, 6 * S)
    assert MONDAY in agent.T_team_map and "tracking" not in kinds(live(agent, range(60, 80)))


def turned_away() -> OccupancyGrid:
    """A saved map of other walls."""
    cells = np.zeros((300, 300), dtype=np.int8)
    cells[::20] = 100
    return OccupancyGrid(cells, 0.05, (-7.5, -7.5))


def test_a_restart_tracks_on_where_the_first_scan_fits(tmp_path: Path) -> None:
    agent = tracking_robot()
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = robot(2)
    resume(again, tmp_path / "a.state")
    assert "tracking" in kinds(live(again, range(85, 86)))
    live(again, range(86, 120))
    expected = se2.compose(se2.inverse(T_OWN_SAVED), odometry(119))
    assert again.T_frame_base == pytest.approx(expected, abs=0.06)


def test_a_restart_tracks_on_where_the_map_shows_the_robot_though_its_wheels_slipped_meanwhile(tmp_path: Path) -> None:
    agent = tracking_robot()
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = robot(2)
    resume(again, tmp_path / "a.state")
    slipped = se2.compose(odometry(85), np.array([0.9, 0.5, 0.2]))
    assert "tracking" in kinds(again.on_scan(scan(85), slipped, 85 * S // 10))
    expected = se2.compose(se2.inverse(T_OWN_SAVED), odometry(85))
    assert again.T_frame_base == pytest.approx(expected, abs=0.06)


def test_a_restart_elsewhere_begins_a_new_map(tmp_path: Path) -> None:
    agent = tracking_robot()
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = robot(2)
    resume(again, tmp_path / "a.state")
    held = again.mapper
    live(again, range(85, 90), elsewhere())
    assert not again.tracking.is_on and isinstance(again.mapper, Mapper) and again.mapper is not held


def test_poses_in_the_saved_maps_frame_are_written(tmp_path: Path) -> None:
    agent = tracking_robot()
    live(agent, range(80, 100))
    write_robot(agent, tmp_path, {})
    stamps_ns, T_saved_laser = read_tum(tmp_path / "tracked.tum")
    assert stamps_ns[-1] == 99 * S // 10
    assert T_saved_laser[-1] == pytest.approx(se2.compose(se2.inverse(T_OWN_SAVED), odometry(99)), abs=0.06)
    assert len(read_tum(tmp_path / "trajectory.tum")[0]) == 100  # in the own map's, mapped and tracked
    row = json.loads((tmp_path / "robot.json").read_text())
    assert row["scans"] == 100 and row["chosen_frame"]["T_frame_base"] == pytest.approx(
        list(T_saved_laser[-1]), abs=1e-3
    )


def test_a_scan_of_nothing_is_no_place() -> None:
    agent = tracking_robot()
    agent.on_scan(replace(scan(80), ranges_m=np.full_like(scan(80).ranges_m, np.nan)), odometry(80), 8 * S)
    live(agent, range(81, 84))
    assert (agent.tracked_laser().stamps_ns[-4:] / (S // 10)).tolist() == [79, 81, 82, 83]


def test_a_restart_after_it_drove_on_unseen_tracks_on_from_where_the_wheels_say(tmp_path: Path) -> None:
    agent = tracking_robot()
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = robot(2)
    resume(again, tmp_path / "a.state")
    live(again, range(140, 145))
    assert again.tracking.is_on
    assert again.T_frame_base == pytest.approx(se2.compose(se2.inverse(T_OWN_SAVED), odometry(144)), abs=0.06)


def test_a_restart_before_the_first_scan_after_a_restart_loses_no_place(tmp_path: Path) -> None:
    agent = tracking_robot()
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    for boot_id in (2, 3):
        again = robot(boot_id)
        resume(again, tmp_path / "a.state")
        assert again.tracking.was_left
    again.tracking.stop()  # the own map begins anew
    assert not again.tracking.was_left


def test_a_place_in_another_saved_map_is_not_gone_on_with() -> None:
    state = tracking_robot().tracking.state()
    for map_id, is_left in ((MONDAY, True), ("office@tuesday", False)):
        tracking = Tracking(SETTINGS.rbpf)
        tracking.map_id = map_id
        tracking.restore(state)
        assert tracking.was_left == is_left


def test_a_beginning_is_tried_once_a_second() -> None:
    tracking = Tracking(SETTINGS.rbpf)
    tracking.map_id = MONDAY
    assert [tracking.is_due(t_ns) for t_ns in (0, S // 10, S - 1, S, S + 1)] == [True, False, False, True, False]
