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
