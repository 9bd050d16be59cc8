"""A robot of the team, with a valid certificate, that lies about another's map: real processes, over TLS."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrslam.comms import CommsConfig, Dropped, ExchangeDone, ExchangeFailed, ExchangeStarted, MapUpdated, Send
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.store import LAST_EPOCH, NOTHING, MapStore
from mrslam.comms.wire.frames import team_tag
from mrslam.comms.wire.messages import Message, Open, SignedManifest, encode
from tests.comms.processes import Robot, free_port, robot_keys
from tests.comms.sealed import seal, team_keys
from tests.comms.team import big_map

EAGER = CommsConfig(exchange_timeout_s=2.0, beacon_period_s=0.1, beacon_window=20)
NEVER = replace(EAGER, exchange_timeout_s=1e6)
"""For the liar: after its first exchange it opens none by itself."""


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    return team_keys(tmp_path_factory.mktemp("keys"), "abc")


class Trio:
    """Robots a and b that listen, and c that connects to both."""

    def __init__(self, keys) -> None:
        self.keys = keys
        self.addresses = {robot: f"tls/127.0.0.1:{free_port()}" for robot in "ab"}
        self.robots: list[Robot] = []

    def start(self, robot: str, boot: int, local_map=None, config=EAGER) -> Robot:
        listen = [self.addresses[robot]] if robot in self.addresses else []
        connect = [address for other, address in self.addresses.items() if other != robot]
        mine = robot_keys(self.keys, robot)
        started = Robot(
            robot, boot=boot, config=config, listen=listen, connect=connect, keys=mine, local_map=local_map
        ).up()
        self.robots.append(started)
        return started

    def stop(self) -> None:
        for robot in self.robots:
            robot.stop()


def say(liar: Robot, to: str, message: Message) -> None:
    liar.tell("send", Send(to, encode(message, team_tag("team")), "control"))


def test_an_insiders_claim_silences_nobody_and_a_restart_from_nothing_is_followed(keys):
    trio = Trio(keys)
    try:
        a = trio.start("a", 1000, big_map(200))
        b = trio.start("b", 2000)
        b.effect(MapUpdated, robot_id="a", epoch=1000)
        liar = trio.start("c", 3000, config=NEVER)
        a.effect(ExchangeDone, peer="c")
        say(liar, "a", Open("c", 3000, 77, [("a", LAST_EPOCH, 5)], []))
        a.effect(ExchangeFailed, peer="c")  # it has no proof to give
        a.stop()
        again = trio.start("a", 7, big_map(200, seed=1))
        b.effect(MapUpdated, robot_id="a", epoch=1001)  # above its last life, which b proved to it, and no further
        again.wait(lambda report: report[0] == "digest" and report[2]["a"] == (1001, 1), "epoch 1001")
    finally:
        trio.stop()


def test_replayed_and_relabelled_signed_maps_are_not_taken(keys):
    trio = Trio(keys)
    try:
        a = trio.start("a", 1000, big_map(200))
        b = trio.start("b", 2000)
        b.effect(MapUpdated, robot_id="a", revision=1)
        liar = trio.start("c", 3000, config=NEVER)
        b.effect(ExchangeDone, peer="c")
        a.tell("publish", big_map(200, seed=1, revision=2))
        b.effect(MapUpdated, robot_id="a", revision=2)
        store = MapStore("a", 1000, EAGER)
        store.use_seal(seal(keys, "a"))
        store.publish(big_map(200))
        old = make_manifest(store, "c", 78, "a", NOTHING, None)
        assert isinstance(old, SignedManifest)
        say(liar, "b", Open("c", 3000, 78, [("a", 1000, 3)], []))
        b.effect(ExchangeStarted, peer="c", opened_by_me=False)
        say(liar, "b", old)  # a true signature, of a version that b is past
        fields = {name: getattr(old, name) for name in SignedManifest.__struct_fields__}
        say(liar, "b", SignedManifest(**fields | {"target": 3}))  # the same as if it were newer
        b.wait(lambda r: r[0] == "effect" and isinstance(r[2], Dropped) and r[2].kind == "forged", "a forgery dropped")
        digests = [report[2] for report in b.heard if report[0] == "digest"]
        assert digests[-1]["a"] == (1000, 2)
    finally:
        trio.stop()
