from __future__ import annotations

import math
from dataclasses import replace

from mrslam.comms import CommsNode, LinkConditions, team_status
from mrslam.comms.status.report import status_report
from mrslam.comms.wire.messages import Status, decode
from tests.comms.team import QUICK, Team


def test_rows_say_in_words_what_goes_on():
    team = Team("ab", config=replace(QUICK, exchange_timeout_s=20.0))
    team.publish("a")
    assert team.run_until_agreed(5)
    team.run(1)
    row = team_status(team.nodes["b"], team.now_ns)[0]
    assert (row.peer, row.mode, row.state) == ("a", "distributed", "strong")
    assert row.activity == f"next exchange in {row.next_exchange_s:.0f} s"
    assert 15 < row.next_exchange_s < 20
    assert row.bytes_received > 0
    assert row.version == team.nodes["a"].store.version("a")
    team.groups = {"b": 1}
    team.step()
    row = team_status(team.nodes["b"], team.now_ns)[0]
    assert row.activity == "link too weak (0.00 < 0.80)"
    assert math.isinf(row.next_exchange_s)


def test_a_failing_link_is_told():
    team = Team("ab", config=replace(QUICK, stall_timeout_s=1.0))
    team.run(2)
    team.link = LinkConditions(loss=1.0)  # the radio model still promises a link
    team.run(3)
    row = team_status(team.nodes["a"], team.now_ns)[0]
    assert row.failures >= 1
    assert row.activity.startswith(("exchange failed", "exchanging"))


def test_a_status_that_names_a_saved_map_is_read():
    node = CommsNode("a", "team", 1, QUICK)
    report = status_report(node, 0, [("office@r1", "b", "aligned")])
    message = decode(report.payload, node.team_tag, 1 << 20)
    assert isinstance(message, Status) and message.alignments == [("office@r1", "b", "aligned")]
