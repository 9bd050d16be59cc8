from __future__ import annotations

import datetime
import json
import stat

import pytest
from cryptography import x509

from mrslam.comms import CommsConfig, ExchangeDone, MapUpdated, PeerSeen, Send, load_keys, make_team_keys
from mrslam.comms.security.access import access_rules
from mrslam.comms.zenoh import ZenohTransport
from mrslam.spatial import InputError
from tests.comms.processes import Robot, free_port, robot_keys
from tests.comms.team import big_map

EAGER = CommsConfig(exchange_timeout_s=2.0, beacon_period_s=0.1, beacon_window=20)


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    make_team_keys(folder, "team", ["a", "b", "c"])
    return folder


def test_a_folder_a_robot_and_private_keys_stay_private(keys):
    for robot in "abc":
        files = sorted(path.name for path in (keys / robot).iterdir())
        assert files == ["ca.pem", "certificate.pem", "key.pem", "roster.json"]
        assert stat.S_IMODE((keys / robot / "key.pem").stat().st_mode) == 0o600
    assert stat.S_IMODE((keys / "ca" / "key.pem").stat().st_mode) == 0o600
    certificate = x509.load_pem_x509_certificate((keys / "a" / "certificate.pem").read_bytes())
    authority = x509.load_pem_x509_certificate((keys / "a" / "ca.pem").read_bytes())
    certificate.verify_directly_issued_by(authority)
    assert certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca is False


def test_a_later_robot_joins_the_same_team_and_old_keys_stay(tmp_path):
    make_team_keys(tmp_path, "team", ["a"])
    old = (tmp_path / "a" / "key.pem").read_bytes(), (tmp_path / "ca" / "key.pem").read_bytes()
    made = make_team_keys(tmp_path, "team", ["a", "b"], routers=["hub"])
    assert [folder.name for folder in made] == ["b", "hub"]
    assert ((tmp_path / "a" / "key.pem").read_bytes(), (tmp_path / "ca" / "key.pem").read_bytes()) == old
    assert load_keys(tmp_path / "a", "a", "team").roster == {"a": "robot", "b": "robot", "hub": "router"}


def test_wrong_folders_say_what_is_wrong(tmp_path, keys):
    with pytest.raises(InputError, match="no such file"):
        load_keys(tmp_path, "a", "team")
    with pytest.raises(InputError, match="keys of 'a', not of 'b'"):
        load_keys(keys / "a", "b", "team")
    with pytest.raises(InputError, match="keys of team 'team', not of 'other'"):
        load_keys(keys / "a", "a", "other")
    with pytest.raises(InputError, match="another folder"):
        make_team_keys(keys, "other", ["a"])
    with pytest.raises(InputError, match="at least one"):
        make_team_keys(tmp_path, "team", [])
    with pytest.raises(InputError, match="robot id"):
        make_team_keys(tmp_path, "team", ["a/b"])
    make_team_keys(tmp_path / "broken", "team", ["a"])
    (tmp_path / "broken" / "a" / "roster.json").write_text(json.dumps({"team": 3}))
    with pytest.raises(InputError, match="not a robot's key folder"):
        load_keys(tmp_path / "broken" / "a", "a", "team")


def test_expired_certificates_are_refused(tmp_path):
    make_team_keys(tmp_path, "team", ["a"], valid_days=-1 + 1)
    with pytest.raises(InputError, match="expired"):
        load_keys(tmp_path / "a", "a", "team")


def test_rules_let_a_robot_write_only_under_its_own_name():
    rules = access_rules("team", {"a": "robot", "hub": "router"})
    assert rules["default_permission"] == "deny"
    by_name = {rule["id"]: rule for rule in rules["rules"]}
    assert by_name["write-a"]["key_exprs"] == ["mrslam/team/a/**"]
    assert by_name["write-a"]["flows"] == ["ingress"]
    of = {policy["subjects"][0]: policy["rules"] for policy in rules["policies"]}
    assert of == {"cn-a": ["listen", "send", "write-a"], "cn-hub": ["listen", "send", "pass-on"]}


def test_with_keys_only_tls_will_do(keys):
    with pytest.raises(InputError, match="tls/ or quic/"):
        ZenohTransport("a", "team", listen=["tcp/127.0.0.1:7447"], keys=robot_keys(keys, "a"))


def messages_from(robot: Robot, names: set[str]) -> list:
    return [r for r in robot.heard if r[0] == "effect" and getattr(r[2], "peer", None) in names]


def test_certified_robots_exchange_over_tls_and_others_are_kept_out(keys, tmp_path):
    make_team_keys(tmp_path, "team", ["b", "x"])  # the same team's name, another authority
    port = free_port()
    listen = [f"tls/127.0.0.1:{port}"]
    a = Robot("a", config=EAGER, listen=listen, keys=robot_keys(keys, "a"), local_map=big_map(300)).up()
    robots = [a]
    try:
        foreign = Robot(
            "x", config=EAGER, connect=listen, keys=load_keys(tmp_path / "x", "x", "team"), local_map=big_map(200)
        )
        plain = Robot("y", config=EAGER, connect=[f"tcp/127.0.0.1:{port}"], local_map=big_map(200))
        # A certified robot that speaks under another's name: c's certificate, b's name.
        liar = Robot("b", config=EAGER, connect=listen, keys=robot_keys(keys, "c"), local_map=big_map(200))
        robots += [foreign.up(), plain.up(), liar.up()]
        a.drain(2.0)
        assert not messages_from(a, {"x", "y", "b"})
        liar.stop()
        honest = Robot("c", config=EAGER, connect=listen, keys=robot_keys(keys, "c"), local_map=big_map(200))
        robots.append(honest)
        honest.effect(ExchangeDone, peer="a")
        a.effect(MapUpdated, robot_id="c")
        assert not messages_from(a, {"x", "y", "b"})
        for outsider in (foreign, plain):
            assert not [r for r in outsider.drain(0.1) if r[0] == "effect" and isinstance(r[2], PeerSeen)]
    finally:
        for robot in robots:
            robot.stop()


def test_routers_pass_on_for_all(tmp_path):
    make_team_keys(tmp_path, "team", ["a", "b"], routers=["hub"])
    endpoint = f"tls/127.0.0.1:{free_port()}"
    loaded = {name: load_keys(tmp_path / name, name, "team") for name in ("a", "b", "hub")}
    ends = [ZenohTransport("hub", "team", listen=[endpoint], mode="router", keys=loaded["hub"])]
    ends += [ZenohTransport(n, "team", connect=[endpoint], mode="client", keys=loaded[n]) for n in "ab"]
    try:
        from tests.comms.zenoh.test_zenoh_transport import collect

        assert {i.peer for i in collect(ends[2], 2)} == {"hub", "a"}
        ends[1].send(Send("b", b"hello", "control"))
        assert [i.payload for i in collect(ends[2], 1)] == [b"hello"]
    finally:
        for end in ends:
            end.close()


def test_a_new_certificate_is_good_on_a_robot_whose_clock_is_behind(keys):
    certificate = x509.load_pem_x509_certificate((keys / "a" / "certificate.pem").read_bytes())
    authority = x509.load_pem_x509_certificate((keys / "a" / "ca.pem").read_bytes())
    hours_ago = datetime.datetime.now(datetime.UTC) - datetime.timedelta(hours=12)
    assert max(certificate.not_valid_before_utc, authority.not_valid_before_utc) < hours_ago
