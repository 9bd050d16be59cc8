"""Revocation: a list of names, signed by the team's authority, that agents read again while they run.

Names are revoked, not certificates: links name their robot, not the certificate it showed. A robot whose key was
stolen comes back under another name.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from mrslam.comms.security.certificates import read_authority
from mrslam.comms.wire.frames import check_name
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_text

log = logging.getLogger(__name__)

FILE = "revoked.json"
"""Name of the list in a key folder; the format is in docs/protocol.md."""
PURPOSE = b"mrslam revoked 1\n"
"""First bytes of what is signed: the authority's key signs certificates too, and no signature may mean two things."""
ALGORITHM = ec.ECDSA(hashes.SHA256())


def revoke(folder: Path, team: str, names: Iterable[str], members: Iterable[str]) -> list[Path]:
    """Add names to the team's list, and write it to the authority's folder and each member's; return the files.

    Raises ``InputError`` for a name that is no member's, and where the authority cannot be read.
    """
    known, members = read_list(folder / "ca", team), sorted(members)
    added = {check_name(name, "robot id") for name in names}
    if strangers := added - set(members):
        raise InputError(f"{folder}: has no keys of {', '.join(sorted(strangers))}; members are {', '.join(members)}")
    key, _ = read_authority(folder / "ca")
    number, revoked = known[0] + 1, sorted(known[1] | added)
    signature = key.sign(_statement(team, number, revoked), ALGORITHM).hex()
    text = json.dumps({"team": team, "number": number, "revoked": revoked, "signature": signature}, indent=1) + "\n"
    files = [folder / name / FILE for name in ("ca", *members) if (folder / name).is_dir()]
    for path in files:
        write_text(path, text)
    return files


def read_list(folder: Path, team: str) -> tuple[int, frozenset[str]]:
    """Return the number of a folder's list and the names on it; (0, none) without one.

    Raises ``InputError`` where it is damaged or not signed by the team's authority.
    """
    path, ca = folder / FILE, folder / ("certificate.pem" if folder.name == "ca" else "ca.pem")
    if not path.exists():
        return 0, frozenset()
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        number, names = int(content["number"]), [check_name(name, "robot id") for name in content["revoked"]]
        public_key = x509.load_pem_x509_certificate(ca.read_bytes()).public_key()
        if not isinstance(public_key, ec.EllipticCurvePublicKey):
            raise InputError(f"{ca}: not an elliptic curve key")
        public_key.verify(bytes.fromhex(content["signature"]), _statement(team, number, names), ALGORITHM)
    except InvalidSignature as error:
        raise InputError(f"{path}: not signed by the authority of team {team!r}") from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        raise InputError(f"{path}: not a list of revoked robots ({error})") from error
    return number, frozenset(names)


def _statement(team: str, number: int, names: list[str]) -> bytes:
    return PURPOSE + "\n".join([team, str(number), *names]).encode()


@dataclass
class Revocations:
    """The revoked names, kept up to date with a key folder's file. A name once on the list stays."""

    folder: Path
    team: str
    names: frozenset[str] = frozenset()
    _number: int = 0
    _seen: tuple[int, int] | None = field(default=None, repr=False)
    """Time and size of the file that was last read."""
    _trouble: str = field(default="", repr=False)
    """Why the file could not be read the last time; logged once, while it is tried again at every call."""

    def refresh(self) -> frozenset[str]:
        """Read the file if it has changed since it was read last; return the names added.

        A list that is older than the one known, damaged, or not signed by the authority changes nothing.
        """
        try:
            status = (self.folder / FILE).stat()
        except OSError:
            return frozenset()  # none yet, or taken away: who was revoked stays so
        seen = status.st_mtime_ns, status.st_size
        if seen == self._seen:
            return frozenset()
        try:
            number, names = read_list(self.folder, self.team)
        except InputError as error:
            if str(error) != self._trouble:
                log.warning("%s; it is not used", error)
            self._trouble = str(error)
            return frozenset()
        self._seen, self._trouble = seen, ""
        if number < self._number:
            log.warning("%s: older than the list known; it is not used", self.folder / FILE)
            return frozenset()
        new = names - self.names
        self._number, self.names = number, self.names | names
        if new:
            log.warning("revoked: %s", ", ".join(sorted(new)))
        return new
