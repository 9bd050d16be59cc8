"""``mrslam keys`` and ``mrslam doctor``, called as a user does."""

from __future__ import annotations

import datetime
import json
import socket
from pathlib import Path

import pytest
from cryptography import x509
from typer.testing import CliRunner

from mrslam.comms import load_keys
from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.cli.live.network import MAX_DAYS
from mrslam.spatial import InputError


def keys(out: Path, *arguments: str) -> list[str]:
    """Call the command for the team "depot"; return the lines it said, without the folder of the keys."""
    result = CliRunner().invoke(app, ["keys", "depot", *arguments, "--out", str(out)])
    if result.exception is not None:
        raise result.exception
    return [line.replace(f"{out}/", "") for line in result.output.splitlines()]


def days_left(folder: Path) -> float:
    ends = x509.load_pem_x509_certificate((folder / "certificate.pem").read_bytes()).not_valid_after_utc
    return (ends - datetime.datetime.now(datetime.UTC)) / datetime.timedelta(days=1)


def test_keys_are_made_for_robots_and_routers_for_as_long_as_asked(tmp_path: Path) -> None:
    said = keys(tmp_path, "a", "b", "--router", "hub", "--days", "50")
    copies = [f"{name}: copy this folder to {name}" for name in ("a", "b", "hub")]
    assert sorted(said) == sorted([*copies, "ca: the team's authority; keep it, and keep it to yourself"])
    assert load_keys(tmp_path / "a", "a", "depot").roster == {"a": "robot", "b": "robot", "hub": "router"}
    assert 49.0 < days_left(tmp_path / "hub") < 51.0


def test_keys_that_are_there_stay_unless_they_are_renewed(tmp_path: Path) -> None:
    keys(tmp_path, "a", "--days", "50")
    assert keys(tmp_path, "a", "--days", "90")[0] == "all of them have keys already"
    assert days_left(tmp_path / "a") < 51.0
    assert keys(tmp_path, "a", "--days", "90", "--renew")[0] == "a: copy this folder to a"
    assert days_left(tmp_path / "a") > 89.0


def test_the_list_of_who_is_revoked_is_to_be_copied_to_those_who_stay(tmp_path: Path) -> None:
    keys(tmp_path, "a", "b", "c")
    said = keys(tmp_path, "--revoke", "b")
    assert [line.partition(": ")[2] for line in said] == [
        f"copy this file to {name}'s key folder; a running agent reads it within a second" for name in ("a", "c")
    ]
    assert all((tmp_path / line.partition(": ")[0]).exists() for line in said)
    with pytest.raises(InputError, match="revoked"):
        load_keys(tmp_path / "b", "b", "depot")
    assert "d: copy this folder to d" in keys(tmp_path, "d", "--revoke", "c")


@pytest.mark.parametrize("days", ["0", "-1", str(MAX_DAYS + 1.0)])
def test_certificates_that_end_at_once_or_never_are_refused(tmp_path: Path, days: str) -> None:
    with pytest.raises(InputError, match="--days"):
        keys(tmp_path, "a", "--days", days)
    assert not (tmp_path / "a").exists()


def test_what_is_wrong_with_the_network_is_marked() -> None:
    with socket.socket() as taken, socket.socket() as free:
        for one in (taken, free):
            one.bind(("127.0.0.1", 0))
        taken.listen()
        there, nowhere = (f"tcp/127.0.0.1:{one.getsockname()[1]}" for one in (taken, free))
        free.close()
        arguments = ["doctor", "--no-multicast", "--listen", there, "--connect", nowhere, "--connect", there]
        lines = CliRunner().invoke(app, arguments).output.splitlines()
        found = json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)
    assert [one["topic"] for one in found] == ["interfaces", "port", "peer", "peer", "clock", "throughput"]
    assert [one["level"] for one in found[1:4]] == ["error", "error", "ok"]
    assert lines[1] == f" BAD  port: {found[1]['words']}" and lines[3].startswith(f"  ok  peer: {there}")
