"""A team's keys as folders of files: one of the authority that signs, one for each robot, and who is in the team."""

from __future__ import annotations

import datetime
import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.x509.oid import NameOID

from mrslam.comms.security.access import ROBOT, ROUTER
from mrslam.comms.security.certificates import (
    member_certificate,
    new_key,
    pem,
    read_private_key,
    team_authority,
    write_private_key,
)
from mrslam.comms.security.revocation import FILE as REVOKED
from mrslam.comms.security.revocation import Revocations, read_list, revoke
from mrslam.comms.wire.frames import check_name
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import held, write_bytes, write_text

VALID_DAYS = 3650.0
"""Lifetime of certificates, days, where none is chosen, and of the authority's own at least."""
WARN_DAYS = 30.0
"""A certificate that ends within this is reported, days: time to renew it and copy it to the robot."""
ROSTER = "roster.json"
"""Name of the file with the team and its members, in each key folder."""
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RobotKeys:
    """What one robot needs to take part in a closed team: paths of PEM files, the roster, and who is revoked."""

    ca: Path
    certificate: Path
    key: Path
    roster: Mapping[str, str]
    """All members with a certificate and not revoked: name -> "robot" or "router"."""
    revocations: Revocations
    """Members that were revoked."""
    ends_s: float
    """When the certificate ends, seconds since 1970."""


def make_team_keys(
    folder: Path,
    team: str,
    robots: Sequence[str],
    routers: Sequence[str] = (),
    *,
    valid_days: float = VALID_DAYS,
    renew: bool = False,
) -> list[Path]:
    """Make a team's CA and a folder of keys for each robot and router; return the folders with new certificates.

    ``folder/ca`` holds the CA's own key: it stays with the owner. ``folder/<robot>`` is what is copied to that robot.
    Called again with more names, it signs those with the same CA and brings every roster up to date; old keys stay, and
    so do their certificates unless ``renew``: then they are signed again, for ``valid_days`` from now on.
    Raises ``InputError`` for bad or revoked names, without any name, where the folder holds another team, and where
    another process makes keys there.
    """
    check_name(team, "team name")
    names = {check_name(name, "robot id"): ROBOT for name in robots}
    names |= {check_name(name, "router name"): ROUTER for name in routers}
    if not names:
        raise InputError("name at least one robot to make keys for")
    if "ca" in names:
        raise InputError("'ca' is the folder of the team's authority and cannot be a robot's name")
    with held(folder):
        return _make_held(folder, team, names, valid_days, renew)


def _make_held(folder: Path, team: str, names: dict[str, str], valid_days: float, renew: bool) -> list[Path]:
    """Make keys in a folder in which nobody else does; ``names`` : name -> "robot" or "router"."""
    ca_folder = folder / "ca"
    roster = _known_roster(ca_folder, team) | names
    _, revoked = read_list(ca_folder, team)
    if gone := sorted(revoked & names.keys()):
        raise InputError(f"{folder}: {', '.join(gone)} was revoked; give the robot another name")
    is_new = not any((ca_folder / name).exists() for name in ("key.pem", "certificate.pem"))
    if is_new and (others := sorted(path.parent.name for path in folder.glob("*/ca.pem"))):
        raise InputError(f"{ca_folder}: is not there, but signed the keys of {', '.join(others)}; put it back")
    ca_key, ca_certificate = team_authority(ca_folder, team, max(valid_days, VALID_DAYS))
    made = []
    for name in names:
        target = folder / name
        if (target / "key.pem").exists():
            if not renew and (target / "certificate.pem").exists():
                continue
            key = read_private_key(target / "key.pem")
        else:
            key = new_key()
            write_private_key(target / "key.pem", key)
        write_bytes(target / "certificate.pem", pem(member_certificate(name, key, ca_key, ca_certificate, valid_days)))
        made.append(target)
    text = json.dumps({"team": team, "members": dict(sorted(roster.items()))}, indent=1) + "\n"
    write_text(ca_folder / ROSTER, text)
    for name in roster:
        write_bytes(folder / name / "ca.pem", pem(ca_certificate))
        write_text(folder / name / ROSTER, text)
        if revoked:
            write_bytes(folder / name / REVOKED, (ca_folder / REVOKED).read_bytes())
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
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(f"{folder}: not a robot's key folder ({error})") from error
    if its_team != team:
        raise InputError(f"{folder}: holds keys of team {its_team!r}, not of {team!r}")
    if common_name != robot_id:
        raise InputError(f"{folder}: holds the keys of {common_name!r}, not of {robot_id!r}")
    ends = certificate.not_valid_after_utc
    left_days = (ends - datetime.datetime.now(datetime.UTC)) / datetime.timedelta(days=1)
    if left_days < 0.0:
        raise InputError(f"{folder}: the certificate expired on {ends:%Y-%m-%d}; renew it (mrslam keys --renew)")
    if left_days < WARN_DAYS:
        log.warning("%s: the certificate ends in %.1f days; renew it (mrslam keys --renew)", folder, left_days)
    revocations = Revocations(folder, team)
    revocations.refresh()
    if robot_id in revocations.names:
        raise InputError(f"{folder}: {robot_id} was revoked; make keys for another name")
    roster = {name: role for name, role in roster.items() if name not in revocations.names}
    return RobotKeys(paths["ca.pem"], paths["certificate.pem"], paths["key.pem"], roster, revocations, ends.timestamp())


def revoke_robots(folder: Path, team: str, names: Sequence[str]) -> list[Path]:
    """Revoke members of a team; return the lists to copy to the robots. Raises ``InputError`` for others."""
    return revoke(folder, team, names, _known_roster(folder / "ca", team))


def own_keys(folder: Path) -> tuple[str, RobotKeys]:
    """Return the team of a robot's key folder and the keys, whoever the robot is; raises as :func:`load_keys` does."""
    try:
        team = str(json.loads((folder / ROSTER).read_text(encoding="utf-8"))["team"])
        certificate = x509.load_pem_x509_certificate((folder / "certificate.pem").read_bytes())
        robot_id = str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(f"{folder}: not a robot's key folder ({error})") from error
    return team, load_keys(folder, robot_id, team)


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
