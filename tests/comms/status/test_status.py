from __future__ import annotations

import math
from dataclasses import replace

from mrslam.comms import CommsNode, ExchangeDone, LinkConditions, team_status
from mrslam.comms.config import MODES
from mrslam.comms.status.report import MAX_ROWS, status_report
from mrslam.comms.wire.messages import Beacon, Status, decode, encode
from tests.comms.puppet import Puppet
from tests.comms.team import QUICK, Team


def told(node: CommsNode, now_ns: int, pairs: int = 0) -> Status:
    payload = status_report(node, now_ns, [(f"r{k}", "b", "aligned") for k in range(pairs)]).payload
    message = decode(payload, node.team_tag, 1 << 20)
    assert isinstance(message, Status)
    return message


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


def test_a_status_tells_each_link_as_it_is():
    team = Team("ab", config=replace(QUICK, exchange_timeout_s=20.0), modes={"a": "mapper"})
    team.publish("a")
    team.run(3)
    team.nodes["b"].set_link_quality("a", 0.85, team.now_ns)
    for robot, mode in (("a", "distributed"), ("b", "mapper")):
        (row,), (link,) = team_status(team.nodes[robot], team.now_ns), told(team.nodes[robot], team.now_ns).links
        costs = [done.costs for done in team.of(ExchangeDone, robot)]
        sent, received, whole = (
            sum(getattr(one, name) for one in costs) for name in ("bytes_sent", "bytes_received", "bytes_full_lz4")
        )
        assert (row.mode, row.bytes_sent, row.bytes_received, row.bytes_saved) == (mode, sent, received, whole - sent)
        assert (link.sent, link.received, link.saved) == (sent, received, whole - sent) and sent != received
        assert link.next_ms == round(1e3 * row.next_exchange_s) > 10_000
    assert (link.quality, link.lq, link.strong) == (85, round(100 * row.lq), True) and row.lq not in (0.0, 0.85)


def test_a_status_says_that_an_exchange_goes_on():
    node = CommsNode("a", "team", 1, QUICK)
    Puppet(node, "b").meet(("b", 5000, 1))
    assert [row.activity for row in team_status(node, 0)] == ["exchanging"]


def test_a_status_of_more_teammates_and_maps_than_it_holds_is_read():
    node = CommsNode("a", "team", 1, replace(QUICK, max_robots=128))
    for k in range(MAX_ROWS + 3):
        beacon = Beacon(f"r{k}", 5, 1, 0, 500, MODES.index("distributed"), [], 0, None)
        node.on_message(encode(beacon, node.team_tag), 0, f"r{k}")
    message = told(node, 0, pairs=MAX_ROWS + 3)
    assert len(message.links) == len(message.alignments) == MAX_ROWS
