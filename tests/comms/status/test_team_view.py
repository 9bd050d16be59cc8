from __future__ import annotations

import json

import msgspec
import pytest

from mrslam.comms import Sighting, TeamView, status_report
from mrslam.comms.status.team_view import MAX_SHOWN
from mrslam.comms.wire import messages as m
from tests.comms.team import Team


@pytest.fixture(scope="module")
def team():
    made = Team("ab")
    made.publish("a")
    assert made.run_until_agreed(10)
    made.run(0.5)
    return made


def report(team: Team, robot: str) -> bytes:
    words = [("a", "b", "not merged: overlap 6 % < 15 %" + "x" * 200)]
    return status_report(team.nodes[robot], team.now_ns, words).payload


def test_a_status_comes_back_as_plain_values(team):
    view = TeamView()
    view.take([Sighting("team", "a", None), Sighting("team", "b", None)], 0.0)
    assert not view.is_complete()
    view.take([Sighting("team", robot, report(team, robot)) for robot in "ab"], 1.0)
    assert view.is_complete()
    rows = json.loads(json.dumps(view.snapshot(3.5)))
    assert [(row["team"], row["robot"], row["here"]) for row in rows] == [("team", "a", True), ("team", "b", True)]
    status = rows[1]["status"]
    assert status["age_s"] == 2.5
    assert status["up_s"] == pytest.approx(team.now_ns / 1e9, abs=0.5)
    assert status["mode"] == "distributed"
    assert status["beacon_bytes"] == team.nodes["b"].bytes_sent["beacon"] > 0
    assert status["exchange_bytes"] > 0
    epoch, revision = team.nodes["a"].store.version("a")
    assert status["maps"] == {"a": {"epoch": epoch, "revision": revision}}
    link = status["links"][0]
    assert (link["peer"], link["state"], link["quality"]) == ("a", "strong", 1.0)
    assert link["activity"].startswith("next exchange in")
    assert 0 <= link["next_exchange_s"] <= 2
    assert link["bytes_received"] > 0
    assert status["alignments"][0]["words"].startswith("not merged: overlap 6 % < 15 %")


def test_every_number_of_a_link_is_told_as_it_was_sent(team):
    view = TeamView()
    links = (m.LinkRow("b", 91, 42, False, "idle", 0, 11, 22, 33), m.LinkRow("c", 0, 7, True, "idle", None, 4, 5, 6))
    status = msgspec.structs.replace(m.decode(report(team, "a"), team.nodes["a"].team_tag, 65_536), links=links)
    view.take([Sighting("team", "a", m.encode(status, team.nodes["a"].team_tag))], 0.0)
    one, other = view.snapshot(0.0)[0]["status"]["links"]
    assert (one["quality"], one["lq"], one["state"], one["next_exchange_s"]) == (0.91, 0.42, "weak", 0.0)
    assert (one["bytes_sent"], one["bytes_received"], one["bytes_saved"]) == (11, 22, 33)
    assert (other["quality"], other["lq"], other["state"], other["next_exchange_s"]) == (0.0, 0.07, "strong", None)


def test_what_is_not_a_status_of_its_sender_is_counted(team):
    view = TeamView()
    good = report(team, "a")
    bye = m.encode(m.Bye("a", 1), team.nodes["a"].team_tag)
    view.take(
        [
            Sighting("team", "b", good),
            Sighting("rivals", "a", good),
            Sighting("team", "a", good[:-1]),
            Sighting("team", "a", bye),
            Sighting("team", "a", b"x" * 100_000),
        ],
        0.0,
    )
    assert view.dropped == {"misattributed": 2, "foreign team": 1, "corrupt": 1, "oversized": 1}
    assert view.snapshot(0.0) == []


def test_robots_remembered_are_bounded_and_those_known_are_followed(team):
    view, good = TeamView(), report(team, "a")
    view.take([Sighting("team", "a", None)], 0.0)
    view.take([Sighting("team", f"x{k}", None) for k in range(3 * MAX_SHOWN)], 0.0)
    assert len(view.snapshot(0.0)) == MAX_SHOWN
    view.take([Sighting("team", "a", good)], 1.0)
    assert view.snapshot(1.0)[0]["status"] is not None


def test_robots_that_are_gone_make_room_who_left_first_before_others_and_those_here_do_not(team):
    view, good = TeamView(), report(team, "a")
    view.take([Sighting("team", f"x{k:03}", None) for k in range(MAX_SHOWN - 1)], 5.0)
    view.take([Sighting("team", "a", good)], 6.0)
    view.take([Sighting("team", name, None, False) for name in ("a", "x007", "x003")], 7.0)
    view.take([Sighting("team", "y0", good), Sighting("team", "a", good)], 8.0)
    view.take([Sighting("team", "y1", None)], 9.0)  # a is here again, and y0 was none
    shown = {row["robot"] for row in view.snapshot(9.0)}
    assert len(shown) == MAX_SHOWN and {"a", "y1", "x003"} <= shown and not {"x007", "y0"} & shown
    view.take([Sighting("team", "y2", None), Sighting("team", "y3", None)], 10.0)
    shown = {row["robot"] for row in view.snapshot(10.0)}
    assert len(shown) == MAX_SHOWN and {"a", "y2"} <= shown and not {"x003", "y3"} & shown
    assert view.dropped == {"misattributed": 1, "too many robots": 1}


def test_who_left_is_told_as_gone(team):
    view = TeamView()
    view.take([Sighting("team", "a", report(team, "a")), Sighting("team", "a", None, False)], 0.0)
    assert [row["here"] for row in view.snapshot(1.0)] == [False]


def test_robots_do_not_listen_to_statuses(team):
    node = team.nodes["b"]
    assert node.on_message(report(team, "a"), team.now_ns, "a") == []
    team.ends["a"].send(status_report(team.nodes["a"], team.now_ns))
    team.network.advance(team.now_ns + 10**9)
    assert "status" not in {arrival.lane for arrival in team.ends["b"].inbox}
