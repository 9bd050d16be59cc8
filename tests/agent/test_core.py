"""The loop of one robot: teammates are masked, maps go out and come in, and doubt keeps a map at home."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent import Agent, AgentConfig
from mrslam.agent.core import SEEN_BEFORE_NS
from mrslam.agent.effects import Effect, Event
from mrslam.spatial import Scan
from tests.agent.duo import SETTINGS, TURN_RAD, S, live, merge, odometry, robot, scan, talk

AHEAD_M = 2.0
DOUBT = ("doubtful", "recovered", "given_up")


def pair() -> tuple[Agent, Agent]:
    """Return two robots that have met; r2 stands two metres ahead of r1, as r1 knows."""
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 60)
    merge(one, [AHEAD_M, 0.0, 0.0])
    live([one, two], 60, 70)
    return one, two


def with_body(k: int) -> tuple[Scan, np.ndarray]:
    """Return a scan in which a body stands ahead of where the robot looked at first, and the beams that end at it."""
    clear = scan(k)
    direction = clear.angles_rad + TURN_RAD * k
    at_body = np.abs(np.arctan2(np.sin(direction), np.cos(direction))) < 0.08
    assert at_body.sum() >= 3
    return replace(clear, ranges_m=np.where(at_body, np.float32(AHEAD_M - 0.1), clear.ranges_m)), at_body


def kinds(effects: list[Effect]) -> list[str]:
    return [effect.kind for effect in effects if isinstance(effect, Event)]


def test_beams_that_end_at_a_teammate_are_left_out() -> None:
    one, _ = pair()
    seen, at_body = with_body(70)
    effects = one.on_scan(seen, odometry(70), 7 * S)
    assert one.scan is not None
    np.testing.assert_array_equal(np.isnan(one.scan.ranges_m), at_body)
    assert "masked" in kinds(effects) and one.masked_beams == at_body.sum()


def test_a_robot_that_turned_a_lot_since_its_last_scan_masks_in_the_right_direction() -> None:
    one, _ = pair()
    seen, at_body = with_body(90)  # 0.4 rad in one step
    one.on_scan(seen, odometry(90), 7 * S + S // 10)
    assert one.scan is not None
    np.testing.assert_array_equal(np.isnan(one.scan.ranges_m), at_body)


def test_a_teammate_whose_map_is_placed_no_more_is_not_masked() -> None:
    one, _ = pair()
    one.team.displace("r2")
    one.on_scan(with_body(70)[0], odometry(70), 7 * S)
    assert one.masked_beams == 0


def test_teammates_are_where_their_reports_say_in_the_own_map_and_for_a_while_only() -> None:
    one, two = pair()
    T_own_two = one.teammates(7 * S)["r2"]
    np.testing.assert_allclose(T_own_two[:2], two.mapper.T_map_base[:2] + np.array([AHEAD_M, 0.0]), atol=0.02)
    assert one.teammates(30 * S) == {}


def test_a_place_on_a_map_that_is_not_known_yet_says_nothing() -> None:
    one, two = pair()
    before = one.teammates(7 * S)["r2"]
    two.node.begin_map()
    two.node.set_own_pose(np.array([5.0, 5.0, 0.0]), 7 * S)
    for k in range(70, 90):
        talk([one, two], k, quality=0.0)  # beacons only
    np.testing.assert_array_equal(one.teammates(9 * S)["r2"], before)


def test_maps_are_published_as_they_grow() -> None:
    one = robot("r1", 1)
    live([one], 0, 30)
    first = one.node.store.version("r1")
    live([one], 30, 60)
    assert one.node.store.version("r1") > first > (0, 0)


def test_a_large_map_is_published_less_often_in_proportion(monkeypatch: pytest.MonkeyPatch) -> None:
    def revisions(small: int) -> tuple[int, int]:
        """Return how often a robot published in six seconds, and its keyframes then."""
        monkeypatch.setattr("mrslam.agent.core.SMALL_KEYFRAMES", small)
        one, times = robot("r1", 1), []
        publish = one.publish
        monkeypatch.setattr(one, "publish", lambda now_ns: (times.append(now_ns), publish(now_ns)))
        live([one], 0, 60)
        return len(times), one.mapper.stats.processed

    often, keyframes = revisions(1000)
    seldom, _ = revisions(max(1, keyframes // 8))
    assert often >= 3 and 1 <= seldom < often


def test_what_was_seen_before_is_published_less_often(monkeypatch: pytest.MonkeyPatch) -> None:
    one, times = robot("r1", 1), []
    monkeypatch.setattr(one, "publish", lambda now_ns: (times.append(now_ns), Agent.publish(one, now_ns)))
    live([one], 0, 60)
    monkeypatch.setattr("mrslam.rbpf.filter.history.is_known", lambda *_: True)  # from here on
    begun = len(times)
    live([one], 60, 680)
    known = one.mapper.stats.seen_before
    assert known > 10 and len(one.mapper.snapshot().key_scans.shown) + known == one.mapper.stats.processed
    assert len(times) - begun <= 2 and times[-1] - times[-2] >= SEEN_BEFORE_NS
    monkeypatch.setattr("mrslam.rbpf.filter.history.is_known", lambda *_: False)
    begun = len(times)
    live([one], 680, 760)
    assert len(times) - begun >= 2


def test_a_robot_without_a_map_has_no_trajectory_and_one_without_news_publishes_nothing() -> None:
    one = robot("r1", 1)
    assert list(one.T_team_map) == ["r1"] and one.corrected_trajectories() == one.team.layout.keyframes() == {}
    live([one], 0, 60)
    one.publish(6 * S)
    version = one.node.store.version("r1")
    one.publish(7 * S)
    assert one.node.store.version("r1") == version


def test_a_robot_says_how_much_it_knows_and_whose_maps_it_has_placed() -> None:
    one = robot("r1", 1)
    live([one], 0, 60)
    (known,) = [e for e in one.on_tick(70 * S) if isinstance(e, Event) and e.kind == "known"]
    assert known.fields["placed"] == ["r1"]
    assert known.fields["own_m2"] == pytest.approx(one.known_area_m2(), abs=0.01)
    assert known.fields["team_m2"] == pytest.approx(one.team_map().grid.known_area_m2(), abs=0.01)
    assert known.fields["team_m2"] > 10.0 < known.fields["own_m2"]


def test_a_robot_that_has_placed_another_says_how_much_both_know_together() -> None:
    one, _ = pair()
    (known,) = [e for e in one.on_tick(80 * S) if isinstance(e, Event) and e.kind == "known"]
    assert known.fields["placed"] == ["r1", "r2"]
    assert known.fields["team_m2"] == pytest.approx(one.team_map().grid.known_area_m2(), abs=0.01)
    assert known.fields["team_m2"] > known.fields["own_m2"] + 1.0


def test_the_last_keyframes_of_a_robot_that_stops_are_published_once() -> None:
    one = Agent("r1", replace(SETTINGS, agent=AgentConfig(publish_interval_s=6.0)), boot_id=1)
    live([one], 0, 60)
    keys, before = one.mapper.stats.processed, one.node.store.version("r1")
    assert len(one.team.maps["r1"].trail) < keys  # the newest came within an interval of the last map
    after = []
    for k in range(60, 200):  # no more scans
        one.on_tick(k * S // 10)
        after.append(one.node.store.version("r1"))
    assert after[0] == before < after[-1]
    assert len(set(after)) == 2 and len(one.team.maps["r1"].trail) == keys


def elsewhere(k: int) -> Scan:
    """Return what a robot sees that was carried into a smaller room."""
    return replace(scan(k), ranges_m=(0.3 * scan(k).ranges_m + 0.4).astype(np.float32))


@pytest.mark.parametrize("has_wheels", [True, False])
def test_a_view_that_changes_where_the_robot_turned_since_its_last_scan_is_not_doubted(has_wheels: bool) -> None:
    def opened(k: int) -> Scan:
        """Return what is seen once most of the walls have given way to what nobody knows."""
        away = np.arange(181) < 98
        return replace(scan(k), ranges_m=np.where(away, 2.5 * scan(k).ranges_m, scan(k).ranges_m).astype(np.float32))

    def told(turned: int) -> list[str]:
        one, said = robot("r1", 1), list[str]()
        for k in range(100):
            seen, at = (scan(k), k) if k < 70 else (opened(k + turned), k + turned)
            effects = one.on_scan(seen, odometry(at) if has_wheels else None, k * S // 10)
            said += [kind for kind in kinds(effects) if kind in DOUBT]
        return said

    assert told(20) == []  # 0.4 rad in one step
    assert told(0)[:1] == ["doubtful"]


def test_a_doubtful_robot_publishes_neither_map_nor_place_and_begins_a_new_map_at_last() -> None:
    one, two = pair()
    version, place = one.node.store.version("r1"), two.team.maps["r1"].version
    told: list[str] = []
    for k in range(70, 110):
        told += [kind for kind in kinds(one.on_scan(elsewhere(k), odometry(k), k * S // 10)) if kind in DOUBT]
        if "given_up" in told:
            break
        assert one.node.store.version("r1") == version, "a doubtful robot has published"
    assert told == ["doubtful", "given_up"]
    assert place[0] == version[0]
    assert list(one.T_team_map) == ["r1"]  # its frame was everyone's
    for _ in range(100):  # whoever looks at the map counts its revisions up: these say nothing of whether it is another
        one.local_map()
    live([one, two], k + 1, k + 40)
    assert one.node.store.version("r1")[0] > version[0]  # another map, not the old one grown
    assert two.team.maps["r1"].epoch == one.node.store.version("r1")[0]


def test_what_a_doubtful_robot_sees_speaks_for_and_against_no_place() -> None:
    one, two = pair()
    (place,) = one.team.beliefs["r1", "r2"].places
    counts = []
    for k in range(70, 95):
        beyond = replace(scan(k), ranges_m=2.0 * scan(k).ranges_m)  # r2 would stand on free floor
        one.on_scan(beyond, odometry(k), k * S // 10)
        two.node.set_own_pose(np.array([0.1 * (k - 70), 0.0, 0.0]), k * S // 10)
        talk([one, two], k)
        assert place.own is not None and (k < 75 or one.self_doubt.doubtful)
        counts.append((place.own.seen, place.own.not_there))
    assert counts[-1] == counts[10]  # all seen before was weighed by then


def test_what_was_seen_and_where_the_map_lay_is_forgotten_with_a_map_that_is_given_up() -> None:
    settings = replace(SETTINGS, agent=AgentConfig(frame="office@monday"))
    one = Agent("r1", settings, boot_id=1)
    live([one], 0, 30)
    one.frame.T_frame_map = np.array([10.0, 4.0, 1.5])  # it was localised
    assert one._witness._encounters._scans
    one._begin_map()
    assert one.frame.T_frame_map is None and not one._witness._encounters._scans


def test_a_robot_relies_on_the_searches_of_those_in_sight_alone() -> None:
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 20)
    relied_on: list[set[str]] = []
    two.team.next_job = lambda _, searching=(): relied_on.append(set(searching))  # type: ignore[method-assign]
    two.next_job(3 * S)
    two.on_peer_left("r1", 3 * S)
    two.next_job(4 * S)
    assert relied_on == [{"r1"}, set()]


def test_a_robot_that_searches_for_nothing_is_not_relied_on_by_its_token_or_after_a_restart() -> None:
    two = robot("r2", 1)
    for boot in (1, 2):
        two.on_peer_joined("r1", 0)
        assert boot == 2 or two.node.searching == set()  # a token alone says nothing
        live([Agent("r1", SETTINGS, mode="mapper", boot_id=boot), two], 20 * boot, 20 * boot + 20)
        assert "r1" in two.node.peers and two.node.searching == set()


def test_a_robot_plans_on_the_teams_map_once_a_teammate_is_placed() -> None:
    one, _ = pair()
    assert one.planning_grid().known_area_m2() > 1.2 * one.own_map().known_area_m2()
    one.team.displace("r2")
    assert one.planning_grid().known_area_m2() == pytest.approx(one.own_map().known_area_m2())


def test_the_trajectory_is_the_lasers() -> None:
    one = robot("r1", 1)
    for k in range(10):
        one.on_scan(replace(scan(k), T_base_laser=np.array([0.2, 0.0, 0.0])), odometry(k), k * S // 10)
    base, laser = one.mapper.trajectory(), one.trajectory_laser()
    np.testing.assert_allclose(np.hypot(*(laser.T_map_base - base.T_map_base)[:, :2].T), 0.2)
