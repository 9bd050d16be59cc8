"""Folders of keys: what is made, signed again, left alone and refused."""

from __future__ import annotations

import datetime
import re
import resource
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import NameOID

from mrslam.comms import load_keys, make_team_keys
from mrslam.comms.security.team_keys import VALID_DAYS, WARN_DAYS, own_keys, revoke_robots
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import held


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


@pytest.mark.parametrize("name", ["r1", "a_b", "Robot.7", "-", "_._", "x" * 64])
def test_a_certificate_names_its_robot_and_a_valid_host_whatever_its_name(tmp_path, name):
    make_team_keys(tmp_path, "t" * 64, [name])
    certificate = x509.load_pem_x509_certificate((tmp_path / name / "certificate.pem").read_bytes())
    assert certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value == name
    (host,) = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert re.fullmatch(r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?", host.value)
    assert load_keys(tmp_path / name, name, "t" * 64).roster == {name: "robot"}


@pytest.mark.parametrize("team", ["", "a/b", "..", "x" * 65])
def test_a_team_cannot_be_called_anything(tmp_path, team):
    with pytest.raises(InputError, match="team name must be"):
        make_team_keys(tmp_path, team, ["a"])
    assert not list(tmp_path.iterdir())


def test_a_key_of_another_kind_is_refused(tmp_path):
    make_team_keys(tmp_path, "team", ["a"])
    key = rsa.generate_private_key(65537, 2048)
    text = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    (tmp_path / "a" / "key.pem").write_bytes(text)
    with pytest.raises(InputError, match="not an elliptic curve key"):
        make_team_keys(tmp_path, "team", ["a"], renew=True)
    (tmp_path / "ca" / "key.pem").write_bytes(text)
    with pytest.raises(InputError, match="CA cannot be read"):
        make_team_keys(tmp_path, "team", ["b"])


def signed_by_the_same(folder: Path, *names: str) -> bool:
    for name in names:
        certificate = x509.load_pem_x509_certificate((folder / name / "certificate.pem").read_bytes())
        certificate.verify_directly_issued_by(
            x509.load_pem_x509_certificate((folder / names[0] / "ca.pem").read_bytes())
        )
    return True


def test_an_authority_whose_key_is_kept_elsewhere_is_not_replaced(tmp_path):
    make_team_keys(tmp_path, "team", ["a", "b"])
    kept = tmp_path / "elsewhere.pem"
    (tmp_path / "ca" / "key.pem").rename(kept)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for refused in (
        lambda: make_team_keys(tmp_path, "team", ["c"]),
        lambda: make_team_keys(tmp_path, "team", ["a"], renew=True),
        lambda: revoke_robots(tmp_path, "team", ["b"]),
    ):
        with pytest.raises(InputError, match="CA cannot be read"):
            refused()
        assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
    kept.rename(tmp_path / "ca" / "key.pem")
    make_team_keys(tmp_path, "team", ["c"])
    assert signed_by_the_same(tmp_path, "a", "b", "c")


def test_keys_are_not_signed_by_another_authority_where_the_teams_own_was_moved_away(tmp_path):
    make_team_keys(tmp_path / "keys", "team", ["a"])
    (tmp_path / "keys" / "ca").rename(tmp_path / "ca")
    with pytest.raises(InputError, match="signed the keys of a; put it back"):
        make_team_keys(tmp_path / "keys", "team", ["b"])
    (tmp_path / "ca").rename(tmp_path / "keys" / "ca")
    for name in ("key.pem", "certificate.pem"):
        (tmp_path / "keys" / "ca" / name).rename(tmp_path / name)
    with pytest.raises(InputError, match="put it back"):
        make_team_keys(tmp_path / "keys", "team", ["b"])
    with pytest.raises(InputError, match="CA cannot be read"):
        revoke_robots(tmp_path / "keys", "team", ["a"])
    for name in ("key.pem", "certificate.pem"):
        (tmp_path / name).rename(tmp_path / "keys" / "ca" / name)
    make_team_keys(tmp_path / "keys", "team", ["b"])
    assert signed_by_the_same(tmp_path / "keys", "a", "b")


@pytest.mark.parametrize("missing", ["ca/certificate.pem", "a/certificate.pem"])
def test_a_call_that_was_cut_off_after_a_key_is_finished_by_the_next(tmp_path, missing):
    make_team_keys(tmp_path, "team", ["a"])
    (tmp_path / missing).unlink()
    key = (tmp_path / "a" / "key.pem").read_bytes()
    make_team_keys(tmp_path, "team", ["a", "b"])
    assert signed_by_the_same(tmp_path, "b", "a")
    assert (tmp_path / "a" / "key.pem").read_bytes() == key
    load_keys(tmp_path / "a", "a", "team")


@pytest.mark.parametrize("name", ["roster.json", "certificate.pem"])
def test_files_that_cannot_be_read_are_a_line_and_no_traceback(tmp_path, name):
    make_team_keys(tmp_path, "team", ["a"])
    (tmp_path / "a" / name).unlink()
    (tmp_path / "a" / name).symlink_to("/proc/self/mem")  # a file that is there, and whose first byte nobody may read
    with pytest.raises(InputError, match="not a robot's key folder"):
        load_keys(tmp_path / "a", "a", "team")


def test_a_key_that_a_full_disk_cuts_off_leaves_nothing_and_a_second_call_makes_all(tmp_path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (30, limits[1]))  # a key takes some 240 bytes
    try:
        with pytest.raises(OSError, match="File too large"):
            make_team_keys(tmp_path, "team", ["a"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
    assert make_team_keys(tmp_path, "team", ["a"]) == [tmp_path / "a"]
    assert load_keys(tmp_path / "a", "a", "team")


def test_a_folder_where_another_process_makes_keys_is_refused(tmp_path):
    with held(tmp_path), pytest.raises(InputError, match="another process writes there"):
        make_team_keys(tmp_path, "team", ["a"])
    assert list(tmp_path.iterdir()) == []
