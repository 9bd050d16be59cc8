from __future__ import annotations

import socket

import pytest

from mrslam.comms import doctor
from mrslam.spatial import InputError
from tests.comms.processes import free_port


def test_a_free_port_and_one_in_use():
    number = free_port()
    assert doctor.port(f"tcp/127.0.0.1:{number}").level == "ok"
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", number))
        taken.listen()
        found = doctor.port(f"tcp/127.0.0.1:{number}")
        assert found.level == "error"
        assert "choose another" in found.words
        assert doctor.reachable(f"tcp/127.0.0.1:{number}").level == "ok"
    assert doctor.reachable(f"tcp/127.0.0.1:{number}").level == "error"


def test_all_topics_are_looked_at_in_words():
    findings = doctor.examine(listen=[f"tcp/127.0.0.1:{free_port()}"])
    assert [finding.topic for finding in findings] == ["interfaces", "port", "multicast", "clock", "throughput"]
    assert all(finding.words and finding.level in ("ok", "warning", "error") for finding in findings)
    assert "Mbit/s" in findings[-1].words


def test_multicast_claims_only_what_was_tried():
    found = doctor.multicast()
    assert ("to oneself" in found.words) == (found.level == "ok")


@pytest.mark.parametrize("endpoint", ["7447", "tcp/host", "tcp/host:99999"])
def test_nonsense_is_refused(endpoint):
    with pytest.raises(InputError, match="endpoint must look like"):
        doctor.port(endpoint)


@pytest.mark.parametrize("protocol", ["udp", "quic"])
def test_a_port_of_datagrams_is_looked_for_among_datagrams(protocol):
    number = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", number))
        assert doctor.port(f"{protocol}/127.0.0.1:{number}").level == "error"
        assert doctor.port(f"tcp/127.0.0.1:{number}").level == "ok"


@pytest.mark.parametrize("protocol", ["udp", "quic"])
def test_who_is_reached_by_datagrams_is_not_called_silent(protocol):
    found = doctor.reachable(f"{protocol}/127.0.0.1:{free_port()}")
    assert found.level == "ok" and "datagrams" in found.words


def test_endpoints_are_read_as_the_network_reads_them():
    number = free_port()
    assert doctor.port(f"tcp/127.0.0.1:{number}#so_sndbuf=32768").level == "ok"
    try:
        with socket.socket(socket.AF_INET6) as probe:
            probe.bind(("::1", 0))
    except OSError:
        pytest.skip("no IPv6 here")
    assert doctor.port(f"tcp/[::1]:{number}").level == "ok"


@pytest.mark.parametrize(("names", "level"), [(["lo"], "warning"), (["lo", "wlan0"], "ok")])
def test_loopback_alone_is_no_network(monkeypatch, names, level):
    monkeypatch.setattr(socket, "if_nameindex", lambda: list(enumerate(names, 1)))
    found = doctor.interfaces()
    assert found.level == level
    assert "1 beside loopback: wlan0" in found.words or level == "warning"


@pytest.mark.parametrize(
    ("tool", "answer", "level"),
    [
        ("timedatectl", "NTPSynchronized=yes\n", "ok"),
        ("timedatectl", "NTPSynchronized=no\n", "warning"),
        ("chronyc", "Stratum         : 3\nSystem time     : 0.000012 seconds fast of NTP time\n", "ok"),
        ("chronyc", "506 Cannot talk to daemon\n", "warning"),
    ],
)
def test_a_clock_that_nothing_keeps_is_reported(tmp_path, monkeypatch, tool, answer, level):
    script = tmp_path / tool
    script.write_text(f"#!/bin/sh\n/bin/cat <<'END'\n{answer}END\n")
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    found = doctor.clock()
    assert found.level == level
    assert level == "warning" or tool == "timedatectl" or found.words == "0.000012 seconds fast of NTP time"


def test_what_is_connected_to_is_looked_at_and_multicast_only_where_it_is_used():
    silent = f"tcp/127.0.0.1:{free_port()}"
    findings = doctor.examine(connect=[silent], with_multicast=False)
    assert [finding.topic for finding in findings] == ["interfaces", "peer", "clock", "throughput"]
    assert findings[1].level == "error" and silent in findings[1].words


def test_throughput_is_told_in_bits(monkeypatch):
    ticks = iter((10.0, 12.0))  # two seconds for 100 chunks of 20 kB
    monkeypatch.setattr(doctor.time, "perf_counter", lambda: next(ticks))
    assert doctor.throughput().words == "8 Mbit/s on loopback"
