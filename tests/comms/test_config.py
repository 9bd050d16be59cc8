from __future__ import annotations

import pytest

from mrslam.comms import CommsConfig
from mrslam.comms.zenoh.config import stays_here
from mrslam.spatial import InputError


@pytest.mark.parametrize(
    ("setting", "value", "words"),
    [
        ("exchange_timeout_s", -1, "comms.exchange_timeout_s must be >= 0 s, got -1"),
        ("link_threshold", 1.5, "comms.link_threshold must be in 0..1, got 1.5"),
        ("link_threshold", float("nan"), "comms.link_threshold must be in 0..1"),
        ("link_source", "guess", "one of measured, model, trace"),
        ("link_smoothing", 0, "in 0.001..1"),
        ("beacon_period_s", 0, "in 0.001..1e6 s"),
        ("backoff_max_s", 1, ">= comms.backoff_s"),
        ("chunk_bytes", 10, "in 1000..200000"),
        ("max_message_bytes", 1024, "chunk_bytes must be below"),
        ("exchange_budget_bytes", -1, r"in 0..2\^40 bytes"),
    ],
)
def test_values_out_of_range_say_the_bound(setting, value, words):
    with pytest.raises(InputError, match=words):
        CommsConfig(**{setting: value})


def test_zero_timeout_means_all_the_time():
    assert CommsConfig(exchange_timeout_s=0).exchange_timeout_s == 0


@pytest.mark.parametrize(
    ("endpoints", "here"),
    [
        ([], True),
        (["tcp/127.0.0.1:7447", "udp/localhost:7448", "tls/[::1]:7447"], True),
        (["tcp/127.0.0.1:7447", "tcp/0.0.0.0:7447"], False),
        (["tcp/10.0.0.2:7447"], False),
        (["tcp/[fe80::1%eth0]:7447"], False),
    ],
)
def test_endpoints_of_this_machine_are_told_from_others(endpoints, here):
    assert stays_here(endpoints) is here
