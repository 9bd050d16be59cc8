"""Folders of keys: what is made, signed again, left alone and refused."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest
from cryptography import x509

from mrslam.comms import load_keys, make_team_keys
from mrslam.comms.security.team_keys import VALID_DAYS, WARN_DAYS, own_keys, revoke_robots
from mrslam.spatial import InputError


def ends_in_days(path: Path) -> float:
    left = x509.load_pem_x509_certificate(path.read_bytes()).not_valid_after_utc - datetime.datetime.now(datetime.UTC)
    return left / datetime.timedelta(days=1)


def test_the_authoritys_folder_is_no_robots(tmp_path):
    with pytest.raises(InputError, match="authority"):
        make_team_keys(tmp_path, "team", ["a", "ca"])


def test_the_authority_outlives_certificates_of_a_day(tmp_path):
    make_team_keys(tmp_path, "team", ["a"], valid_days=1.0)
    assert ends_in_days(tmp_path / "a" / "certificate.pem") < 1.1
    assert ends_in_days(tmp_path / "a" / "ca.pem") > VALID_DAYS - 1.0


def test_certificates_stay_as_they_are_unless_they_are_renewed(tmp_path):
    make_team_keys(tmp_path, "team", ["a"], valid_days=50.0)
    paths = [tmp_path / "a" / name for name in ("certificate.pem", "key.pem")]
    before = [path.read_bytes() for path in paths]
    assert make_team_keys(tmp_path, "team", ["a"], valid_days=90.0) == []
    assert [path.read_bytes() for path in paths] == before
    assert make_team_keys(tmp_path, "team", ["a"], valid_days=90.0, renew=True) == [tmp_path / "a"]
    assert paths[0].read_bytes() != before[0] and paths[1].read_bytes() == before[1]
    assert ends_in_days(paths[0]) > 89.0


@pytest.mark.parametrize(("left_days", "is_told"), [(WARN_DAYS - 1.0, True), (WARN_DAYS + 1.0, False)])
def test_a_certificate_is_reported_a_month_before_it_ends(tmp_path, caplog, left_days, is_told):
    make_team_keys(tmp_path, "team", ["a"], valid_days=left_days)
    load_keys(tmp_path / "a", "a", "team")
    assert ("renew" in caplog.text) is is_told


def test_who_is_revoked_gets_no_keys_and_starts_no_more(tmp_path):
    make_team_keys(tmp_path, "team", ["a", "b"])
    revoke_robots(tmp_path, "team", ["b"])
    with pytest.raises(InputError, match="revoked"):
        make_team_keys(tmp_path, "team", ["b"], renew=True)
    with pytest.raises(InputError, match="revoked"):
        load_keys(tmp_path / "b", "b", "team")
    assert load_keys(tmp_path / "a", "a", "team").roster == {"a": "robot"}


def test_a_robot_that_joins_later_knows_who_is_revoked(tmp_path):
    make_team_keys(tmp_path, "team", ["a", "b"])
    revoke_robots(tmp_path, "team", ["b"])
    make_team_keys(tmp_path, "team", ["c"])
    keys = load_keys(tmp_path / "c", "c", "team")
    assert keys.revocations.names == {"b"} and keys.roster == {"a": "robot", "c": "robot"}


def test_a_robots_folder_says_whose_it_is(tmp_path):
    make_team_keys(tmp_path, "team", ["a", "b"])
    team, keys = own_keys(tmp_path / "b")
    assert team == "team" and keys.certificate == tmp_path / "b" / "certificate.pem"
    with pytest.raises(InputError, match="not a robot's key folder"):
        own_keys(tmp_path)
