"""A team's keys: a certificate authority, one certificate a robot, and who may write under which name."""

from __future__ import annotations

import datetime
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from comms.frames import check_name
from spatial import InputError
from spatial.files import write_bytes, write_text

ROBOT, ROUTER = "robot", "router"
VALID_DAYS = 3650
ROSTER = "roster.json"


@dataclass(frozen=True)
class RobotKeys:
    """What one robot needs to speak in a closed team: paths of PEM files, and who else has a certificate."""

    ca: Path
    certificate: Path
    key: Path
    roster: Mapping[str, str]
    """Everyone with a certificate: name -> "robot" or "router"."""


def make_team_keys(
    folder: Path, team: str, robots: Sequence[str], routers: Sequence[str] = (), *, valid_days: int = VALID_DAYS
) -> list[Path]:
    """Make a team's CA and a folder of keys for each robot and router; return the new folders.

    ``folder/ca`` holds the CA's own key: it stays with the owner. ``folder/<robot>`` is what is copied to that robot.
    Called again with more names, it signs those with the same CA and brings every roster up to date; old keys stay.
    Raises ``InputError`` for bad names, for no names, and where the folder holds another team.
    """
    check_name(team, "team name")
    names = {check_name(name, "robot id"): ROBOT for name in robots}
    names |= {check_name(name, "router name"): ROUTER for name in routers}
    if not names:
        raise InputError("name at least one robot to make keys for")
    if "ca" in names:
        raise InputError("'ca' is the folder of the team's authority and cannot be a robot's name")
    ca_folder = folder / "ca"
    roster = _known_roster(ca_folder, team) | names
    ca_key, ca_certificate = _authority(ca_folder, team, valid_days)
    made = []
    for name in names:
        target = folder / name
        if (target / "key.pem").exists():
            continue
        key = ec.generate_private_key(ec.SECP256R1())
        _write_private(target / "key.pem", key)
        write_bytes(target / "certificate.pem", _pem(_certificate(name, key, ca_key, ca_certificate, valid_days)))
        made.append(target)
    text = json.dumps({"team": team, "members": dict(sorted(roster.items()))}, indent=1) + "\n"
    write_text(ca_folder / ROSTER, text)
    for name in roster:
        write_bytes(folder / name / "ca.pem", _pem(ca_certificate))
        write_text(folder / name / ROSTER, text)
    return made


def load_keys(folder: Path, robot_id: str, team: str) -> RobotKeys:
    """Return a robot's keys from its folder; raise ``InputError`` where a file is missing or another robot's."""
    paths = {name: folder / name for name in ("ca.pem", "certificate.pem", "key.pem", ROSTER)}
    for path in paths.values():
        if not path.is_file():
            raise InputError(f"{path}: no such file; a robot's key folder holds {', '.join(paths)}")
    try:
        content: Any = json.loads(paths[ROSTER].read_text(encoding="utf-8"))
        its_team, members = content["team"], content["members"]
        roster = {check_name(name, "robot id"): str(role) for name, role in members.items()}
        certificate = x509.load_pem_x509_certificate(paths["certificate.pem"].read_bytes())
        common_name = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, UnicodeDecodeError) as error:
        raise InputError(f"{folder}: not a robot's key folder ({error})") from error
    if its_team != team:
        raise InputError(f"{folder}: holds keys of team {its_team!r}, not of {team!r}")
    if common_name != robot_id:
        raise InputError(f"{folder}: holds the keys of {common_name!r}, not of {robot_id!r}")
    if certificate.not_valid_after_utc < datetime.datetime.now(datetime.UTC):
        raise InputError(
            f"{folder}: the certificate expired on {certificate.not_valid_after_utc:%Y-%m-%d}; make new keys"
        )
    return RobotKeys(paths["ca.pem"], paths["certificate.pem"], paths["key.pem"], roster)


def own_keys(folder: Path) -> tuple[str, RobotKeys]:
    """Return the team of a robot's key folder and the keys, whoever the robot is; ``InputError`` as above."""
    try:
        team = str(json.loads((folder / ROSTER).read_text(encoding="utf-8"))["team"])
        certificate = x509.load_pem_x509_certificate((folder / "certificate.pem").read_bytes())
        robot_id = str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(f"{folder}: not a robot's key folder ({error})") from error
    return team, load_keys(folder, robot_id, team)


def access_rules(team: str, roster: Mapping[str, str]) -> dict[str, Any]:
    """Return Zenoh access rules: a robot writes only under its own name, a router passes on for all, others nothing."""
    everything = f"mrslam/{team}/**"
    listening = ["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"]
    writing = ["put", "delete", "liveliness_token", "reply"]
    rules = [
        _rule("listen", [everything], listening, ["ingress", "egress"]),
        _rule("tell", [everything], writing, ["egress"]),
        _rule("pass-on", [everything], writing, ["ingress"]),
    ]
    policies = []
    for name, role in sorted(roster.items()):
        mine = "pass-on"
        if role != ROUTER:
            mine = f"write-{name}"
            rules.append(_rule(mine, [f"mrslam/{team}/{name}/**"], writing, ["ingress"]))
        policies.append({"id": f"policy-{name}", "rules": ["listen", "tell", mine], "subjects": [f"cn-{name}"]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": f"cn-{name}", "cert_common_names": [name]} for name in sorted(roster)],
        "policies": policies,
    }


def _rule(name: str, keys: list[str], messages: list[str], flows: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": flows, "messages": messages, "key_exprs": keys}


def _known_roster(ca_folder: Path, team: str) -> dict[str, str]:
    path = ca_folder / ROSTER
    if not path.exists():
        return {}
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        its_team, members = str(content["team"]), dict(content["members"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not a team's roster ({error})") from error
    if its_team != team:
        raise InputError(f"{ca_folder.parent}: holds keys of team {its_team!r} already; choose another folder")
    return members


def _authority(folder: Path, team: str, valid_days: int) -> tuple[ec.EllipticCurvePrivateKey, x509.Certificate]:
    """Return the team's CA, made now if there is none."""
    key_path, certificate_path = folder / "key.pem", folder / "certificate.pem"
    if key_path.exists() and certificate_path.exists():
        try:
            key = serialization.load_pem_private_key(key_path.read_bytes(), password=None)
            certificate = x509.load_pem_x509_certificate(certificate_path.read_bytes())
        except (ValueError, TypeError) as error:
            raise InputError(f"{folder}: the team's CA cannot be read ({error})") from error
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise InputError(f"{key_path}: not an elliptic curve key")
        return key, certificate
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"{team} CA"[:64])])
    certificate = (
        _builder(name, name, key, valid_days)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    _write_private(key_path, key)
    write_bytes(certificate_path, _pem(certificate))
    return key, certificate


def _certificate(
    name: str,
    key: ec.EllipticCurvePrivateKey,
    ca_key: ec.EllipticCurvePrivateKey,
    ca_certificate: x509.Certificate,
    valid_days: int,
) -> x509.Certificate:
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    both_ends = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    authority = x509.AuthorityKeyIdentifier.from_issuer_public_key(ca_key.public_key())
    return (
        _builder(subject, ca_certificate.subject, key, valid_days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(both_ends), critical=False)
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(_dns(name))]), critical=False)
        .add_extension(authority, critical=False)
        .sign(ca_key, hashes.SHA256())
    )


def _dns(name: str) -> str:
    """Return a name as a valid host label: certificates without an alternative name are refused by modern TLS."""
    return name.replace("_", "-").replace(".", "-").strip("-").lower()[:63] or "robot"


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, valid_days: int
) -> x509.CertificateBuilder:
    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))  # robots' clocks are off
        .not_valid_after(now + datetime.timedelta(days=valid_days))
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _write_private(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    pem = key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    # Opened with its final mode: the key is never readable by others, not even for a moment.
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(pem)
