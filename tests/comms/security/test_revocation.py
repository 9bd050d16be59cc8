"""Certificates that are revoked, renewed, or about to end."""

from __future__ import annotations

import json
import logging
import time
from collections import Counter

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from mrslam.comms import (
    CommsConfig,
    CommsNode,
    ExchangeDone,
    MapUpdated,
    PeerGone,
    TeamView,
    load_keys,
    make_team_keys,
    own_keys,
)
from mrslam.comms import revoke_robots as revoke
from mrslam.comms.maps.chunks import make_chunks
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.snapshots import published
from mrslam.comms.maps.store import NOTHING, MapStore
from mrslam.comms.security.revocation import FILE, Revocations
from mrslam.comms.transport.base import Incoming, PeerJoined, TransportEvent
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.messages import Get
from mrslam.comms.zenoh import ZenohWatcher
from mrslam.comms.zenoh.transport import without
from mrslam.sim_driver.cli.live.top_tables import _certificate_lines
from mrslam.spatial import InputError
from tests.comms.processes import Robot, free_port, robot_keys
from tests.comms.puppet import Puppet
from tests.comms.sealed import SealedTeam, seal, team_keys
from tests.comms.team import QUICK, big_map

EAGER = CommsConfig(exchange_timeout_s=1.0, beacon_period_s=0.1, beacon_window=20)
DAY_S = 86_400


def ends_s(folder) -> float:
    return x509.load_pem_x509_certificate((folder / "certificate.pem").read_bytes()).not_valid_after_utc.timestamp()


def test_lifetimes_are_chosen_and_renewed_with_the_same_key(tmp_path, caplog):
    make_team_keys(tmp_path, "team", ["a", "b"], valid_days=2.0)
    assert ends_s(tmp_path / "a") - time.time() == pytest.approx(2 * DAY_S, abs=60)
    assert (
        ends_s(tmp_path / "a")
        < x509.load_pem_x509_certificate((tmp_path / "a" / "ca.pem").read_bytes()).not_valid_after_utc.timestamp()
    )
    with caplog.at_level(logging.WARNING):
        load_keys(tmp_path / "a", "a", "team")
    assert "the certificate ends in 2.0 days" in caplog.text
    before = (tmp_path / "a" / "key.pem").read_bytes(), seal(tmp_path, "a")
    (made,) = make_team_keys(tmp_path, "team", ["a"], valid_days=90.0, renew=True)
    assert made == tmp_path / "a"
    assert (tmp_path / "a" / "key.pem").read_bytes() == before[0]
    assert ends_s(tmp_path / "a") - time.time() == pytest.approx(90 * DAY_S, abs=60)
    assert ends_s(tmp_path / "b") - time.time() == pytest.approx(2 * DAY_S, abs=60)
    caplog.clear()
    load_keys(tmp_path / "a", "a", "team")
    assert not caplog.text
    assert before[1].certificate != seal(tmp_path, "a").certificate


def test_a_list_counts_only_with_the_authoritys_signature_and_never_goes_back(tmp_path, caplog):
    team_keys(tmp_path, "abcd")
    mine = Revocations(tmp_path / "a", "team")
    assert mine.refresh() == frozenset()
    revoke(tmp_path, "team", ["c"])
    first = (tmp_path / "a" / FILE).read_text()
    assert mine.refresh() == {"c"}
    assert mine.refresh() == frozenset()
    revoke(tmp_path, "team", ["d"])
    assert mine.refresh() == {"d"} and mine.names == {"c", "d"}
    assert json.loads((tmp_path / "a" / FILE).read_text())["revoked"] == ["c", "d"]
    (tmp_path / "a" / FILE).write_text(first)  # an older one, put back
    assert mine.refresh() == frozenset() and mine.names == {"c", "d"}
    assert "older" in caplog.text
    later = {"number": 99, "revoked": ["b", "c"]}  # newer than what is known, and nobody's word
    for damage in (later, {"number": 99}, later | {"signature": "00"}, later | {"signature": None}, {"team": 5}):
        content = json.loads(first) | damage
        (tmp_path / "a" / FILE).write_text(json.dumps(content) + " " * len(str(damage)))
        assert mine.refresh() == frozenset()
    (tmp_path / "a" / FILE).write_text("{")
    assert mine.refresh() == frozenset() and mine.names == {"c", "d"}
    (tmp_path / "a" / FILE).unlink()
    assert mine.refresh() == frozenset() and mine.names == {"c", "d"}


def test_a_list_that_could_not_be_read_is_tried_again_and_that_is_logged_once(tmp_path, caplog, monkeypatch):
    team_keys(tmp_path, "ab")
    mine = Revocations(tmp_path / "a", "team")
    revoke(tmp_path, "team", ["b"])

    def denied(*_, **__):
        raise PermissionError(13, "Permission denied")

    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.read_text", denied)
        assert [mine.refresh() for _ in range(3)] == 3 * [frozenset()]
    assert caplog.text.count("Permission denied") == 1
    assert mine.refresh() == {"b"}  # neither its time nor its size has changed
    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.read_text", denied)
        mine.refresh()
    assert caplog.text.count("Permission denied") == 1  # it was read, and is not read again
    (tmp_path / "a" / FILE).write_text("{")
    for _ in range(3):
        mine.refresh()
    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.read_text", denied)
        mine.refresh()
    assert caplog.text.count("not a list of revoked robots") == 3 and mine.names == {"b"}


def test_who_was_revoked_once_stays_so_though_a_later_list_leaves_it_out(tmp_path):
    team_keys(tmp_path, "abcd")
    mine = Revocations(tmp_path / "a", "team")
    revoke(tmp_path, "team", ["c"])
    assert mine.refresh() == {"c"}
    (tmp_path / "ca" / FILE).unlink()
    for _ in range(2):  # the authority's own list was lost, and is made anew
        revoke(tmp_path, "team", ["d"])
    assert json.loads((tmp_path / "a" / FILE).read_text())["number"] == 2
    assert mine.refresh() == {"d"} and mine.names == {"c", "d"}


def test_who_is_revoked_cannot_start_nor_get_new_keys_and_is_of_no_roster(tmp_path):
    team_keys(tmp_path, "abc")
    revoke(tmp_path, "team", ["c"])
    with pytest.raises(InputError, match="c was revoked"):
        load_keys(tmp_path / "c", "c", "team")
    with pytest.raises(InputError, match="c was revoked"):
        make_team_keys(tmp_path, "team", ["c"], renew=True)
    with pytest.raises(InputError, match="no keys of x"):
        revoke(tmp_path, "team", ["x"])
    assert sorted(load_keys(tmp_path / "a", "a", "team").roster) == ["a", "b"]
    make_team_keys(tmp_path, "team", ["d"])
    assert load_keys(tmp_path / "d", "d", "team").revocations.names == {"c"}


def test_maps_signed_by_a_revoked_robot_are_refused_also_through_others(tmp_path):
    team = SealedTeam(team_keys(tmp_path, "abc"), "abc")
    team.publish("a")
    team.groups = {"c": 1}
    team.run(6)
    assert "a" in team.nodes["b"].store.maps
    revoke(tmp_path, "team", ["a"])
    honest = team.nodes["c"].store.seal
    assert honest.revocations.refresh() == {"a"}
    team.groups = {"a": 2}
    team.run(6)
    assert "a" not in team.nodes["c"].store.maps
    assert team.nodes["c"].dropped["revoked"] >= 1
    with pytest.raises(WireError, match="revoked"):
        honest.check("a", (1, 1), team.nodes["b"].store.newest("a").proof)


def test_a_robot_revoked_while_all_run_is_heard_no_more(tmp_path):
    """Real processes: the list is put into the others' folders, and they act on it without a restart."""
    team_keys(tmp_path, "abc")
    listen = [f"tls/127.0.0.1:{free_port()}"]
    a = Robot("a", config=EAGER, listen=listen, keys=robot_keys(tmp_path, "a"), local_map=big_map(200)).up()
    c = Robot("c", config=EAGER, connect=listen, keys=robot_keys(tmp_path, "c"), local_map=big_map(200)).up()
    b = None
    try:
        a.effect(MapUpdated, robot_id="c", revision=1)
        revoke(tmp_path, "team", ["c"])
        a.effect(PeerGone, peer="c")
        heard = len(a.heard)
        c.tell("publish", big_map(200, seed=1, revision=2))
        b = Robot("b", config=EAGER, connect=listen, keys=robot_keys(tmp_path, "b"), local_map=big_map(200)).up()
        a.effect(MapUpdated, robot_id="b")
        b.effect(ExchangeDone, peer="a")
        assert not [r for r in a.heard[heard:] if r[0] == "effect" and getattr(r[2], "peer", None) == "c"]
        assert all(report[2].get("c", (0, 1))[1] == 1 for report in a.heard if report[0] == "digest")
        assert not [r for r in b.heard if r[0] == "effect" and getattr(r[2], "peer", None) == "c"]
    finally:
        for robot in (a, b, c):
            if robot is not None:
                robot.stop()


def has_met(robot: Robot, peer: str) -> bool:
    robot.drain(0.1)
    return any(r[0] == "effect" and isinstance(r[2], ExchangeDone) and r[2].peer == peer for r in robot.heard)


def ends_shown(view: TeamView, watcher: ZenohWatcher) -> dict[str, int]:
    """By robot: when its certificate ends, by the newest status that the watcher heard."""
    view.take(watcher.poll(), time.monotonic())
    rows = view.snapshot(time.monotonic())
    return {row["robot"]: row["status"]["certificate_ends_s"] for row in rows if row["status"]}


def test_a_certificate_about_to_end_shows_in_the_status_and_its_end_cuts_the_links(tmp_path):
    """Real processes; where a busy machine starts one only after its certificate ended, a longer life is tried."""
    make_team_keys(tmp_path, "team", ["a", "c", "d", "e", "watch"])
    listen = [f"tls/127.0.0.1:{free_port()}"]
    a = Robot("a", config=EAGER, listen=listen, keys=robot_keys(tmp_path, "a"), local_map=big_map(200)).up()
    try:
        met = any(meets_until_its_end(tmp_path, a, listen, peer, life_s) for peer, life_s in LIVES_S.items())
        assert met, "nobody met a and was shown in time"
    finally:
        a.stop()


LIVES_S = {"c": 15.0, "d": 60.0, "e": 240.0}
"""How long the certificates of robots that are tried one after the other live, seconds."""


def meets_until_its_end(folder, a: Robot, listen: list[str], peer: str, life_s: float) -> bool:
    """Return whether a robot met ``a`` before its certificate ended; if so check that it was shown and cut off."""
    make_team_keys(folder, "team", [peer], valid_days=life_s / DAY_S, renew=True)
    end = ends_s(folder / peer)
    mine = [f"tls/127.0.0.1:{free_port()}"]
    robot = Robot(peer, config=EAGER, listen=mine, connect=listen, keys=robot_keys(folder, peer))
    watcher = ZenohWatcher("team", connect=[*listen, *mine], keys=own_keys(folder / "watch")[1])
    try:
        view, shown = TeamView(), {}
        while not ({"a", peer} <= shown.keys() and has_met(a, peer)):
            if time.time() > end:
                return False
            shown = ends_shown(view, watcher)
        assert {name: shown[name] for name in ("a", peer)} == {
            name: round(ends_s(folder / name)) for name in ("a", peer)
        }
        lines = "\n".join(str(line) for line in _certificate_lines(view.snapshot(time.monotonic())))
        assert f"{peer}: its certificate ends in 0.0 days" in lines
        a.effect(PeerGone, peer=peer)
        assert time.time() >= end - 1
        return True
    finally:
        watcher.close()
        robot.stop()


def test_a_saved_map_signed_by_a_revoked_robot_is_refused(tmp_path):
    team_keys(tmp_path, "ab")
    snapshot = published(big_map(200), None, 5)
    proof = seal(tmp_path, "a").sign("map@office", snapshot)
    judge = seal(tmp_path, "b")
    judge.check("map@office", snapshot.version, proof)
    revoke(tmp_path, "team", ["a"])
    judge.revocations.refresh()
    with pytest.raises(WireError, match="revoked"):
        judge.check("map@office", snapshot.version, proof)


def test_a_map_whose_signer_is_revoked_while_it_arrives_is_refused(tmp_path):
    team_keys(tmp_path, "abc")
    node, theirs = CommsNode("a", "team", 1, QUICK), MapStore("c", 50, QUICK)
    own = seal(tmp_path, "a")
    node.seal_maps(own)
    theirs.use_seal(seal(tmp_path, "c"))
    theirs.publish(big_map(200))
    bringer = Puppet(node, "b")
    bringer.meet(("c", 50, 1))
    manifest = make_manifest(theirs, "b", bringer.xid, "c", NOTHING, None)
    assert any(isinstance(one, Get) for one in bringer.say(manifest))
    revoke(tmp_path, "team", ["c"])
    own.revocations.refresh()
    for chunk in make_chunks(theirs, manifest, list(range(len(manifest.rows) + len(manifest.blocks))), QUICK):
        bringer.say(chunk)
    assert node.store.version("c") == NOTHING and node.dropped["revoked"] == 1


def test_folders_that_were_moved_to_their_robots_need_not_be_here_to_revoke(tmp_path):
    team_keys(tmp_path, "abc")
    (tmp_path / "b").rename(tmp_path / "moved")
    files = revoke(tmp_path, "team", ["c"])
    assert sorted(path.parent.name for path in files) == ["a", "c", "ca"]
    assert not (tmp_path / "b").exists()


def test_lists_are_signed_as_documented(tmp_path):
    team_keys(tmp_path, "abc")
    revoke(tmp_path, "team", ["c", "b"])
    content = json.loads((tmp_path / "a" / FILE).read_text())
    authority = x509.load_pem_x509_certificate((tmp_path / "a" / "ca.pem").read_bytes()).public_key()
    words = b"mrslam revoked 1\nteam\n1\nb\nc"
    authority.verify(bytes.fromhex(content["signature"]), words, ec.ECDSA(hashes.SHA256()))


@pytest.mark.parametrize("damage", ['{"number": 1e999, "revoked": [], "signature": "00"}', "[" * 100_000, "\\x00", "5"])
def test_a_damaged_list_is_a_warning_and_no_end(tmp_path, caplog, damage):
    team_keys(tmp_path, "ab")
    (tmp_path / "a" / FILE).write_text(damage)
    mine = Revocations(tmp_path / "a", "team")
    assert mine.refresh() == frozenset()
    assert "not a list of revoked robots" in caplog.text


def test_what_revoked_robots_send_is_counted_and_told_and_the_rest_arrives(caplog: pytest.LogCaptureFixture) -> None:
    arrivals: list[TransportEvent] = [Incoming(b"x", name, "control") for name in ("r2", "r3", "r2", "r2")]
    refused: Counter[str] = Counter()
    assert without([*arrivals, PeerJoined("r2")], {"r2"}, refused) == [arrivals[1]]
    assert refused == {"r2": 4}
    assert [message.split()[0] for message in caplog.messages] == ["1", "2", "4"]
    assert "4 messages of r2 were not taken: it is revoked" in caplog.text
