"""Signatures of maps: each robot signs every version of its own map with the key of its certificate.

A map may come through third parties. With team keys they can pass it on, but not change it or make one up: the
signature is over the robot, the version, and a hash of everything in the map.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from hashlib import blake2b

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from mrslam.comms.maps.snapshots import Proof, Snapshot
from mrslam.comms.security.certificates import read_private_key
from mrslam.comms.security.revocation import Revocations
from mrslam.comms.security.team_keys import RobotKeys
from mrslam.comms.wire.fields import is_saved
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.messages import Version
from mrslam.spatial import InputError, Tile
from mrslam.spatial.tiles import TileIndex

PURPOSE = b"mrslam map 2\n"
"""First bytes of what is signed: the key serves TLS too, and no signature may mean two things. 2: scans are
signed, as of protocol version 2."""
HASH_BYTES = 16
"""Size of the root and of each leaf, bytes: BLAKE2b-128 (the format)."""
MAX_SIGNERS = 4096
"""Certificates whose keys are remembered; bounds memory alone."""
ALGORITHM = ec.ECDSA(hashes.SHA256())


@dataclass
class MapSeal:
    """Signs the own map's versions and checks those of others. Holds keys in memory; does no I/O."""

    team: str
    own_id: str
    key: ec.EllipticCurvePrivateKey
    certificate: bytes
    """The own one, DER."""
    authority: x509.Certificate
    revocations: Revocations
    ends_s: float
    """When the own certificate ends, seconds since 1970."""
    _signers: dict[bytes, tuple[str, ec.EllipticCurvePublicKey]] = field(
        default_factory=dict
    )  # certificate -> name, key
    _leaves: dict[str, dict[TileIndex, tuple[Tile, bytes]]] = field(
        default_factory=dict
    )  # robot -> hashes of its tiles

    @classmethod
    def load(cls, keys: RobotKeys, team: str, own_id: str) -> MapSeal:
        """Read a robot's keys; raises ``InputError`` where they are of another kind than ``mrslam keys`` makes."""
        key = read_private_key(keys.key)
        try:
            certificate = x509.load_pem_x509_certificate(keys.certificate.read_bytes())
            authority = x509.load_pem_x509_certificate(keys.ca.read_bytes())
        except (OSError, ValueError, TypeError) as error:
            raise InputError(f"{keys.key.parent}: the keys cannot be read ({error})") from error
        der = certificate.public_bytes(serialization.Encoding.DER)
        return cls(team, own_id, key, der, authority, keys.revocations, keys.ends_s)

    def sign(self, robot: str, snapshot: Snapshot) -> Proof:
        """Return the proof that the own map, or a saved one, is this snapshot at this version."""
        root = self.root_of(robot, snapshot)
        return Proof(root, self.key.sign(self._statement(robot, snapshot.version, root), ALGORITHM), self.certificate)

    def check(self, robot: str, version: Version, proof: Proof) -> None:
        """Raise :class:`WireError` unless the robot itself has signed that its map at this version has this root.

        A saved map is no robot's: any robot of the team that was given it may have signed.
        """
        name, public_key = self._signer(proof.certificate)
        if {robot, name} & set(self.revocations.names):
            raise WireError("revoked", f"a map of {robot!r}, signed by {name!r}")
        if name != robot and not is_saved(robot):
            raise WireError("forged", f"a map of {robot!r} signed by {name!r}")
        try:
            public_key.verify(proof.signature, self._statement(robot, version, proof.root), ALGORITHM)
        except InvalidSignature as error:
            raise WireError("forged", f"a map of {robot!r} with a wrong signature") from error

    def _signer(self, certificate: bytes) -> tuple[str, ec.EllipticCurvePublicKey]:
        """Return whom a certificate of this team names, and its key; checked once for each certificate."""
        known = self._signers.get(certificate)
        if known is None:
            try:
                parsed = x509.load_der_x509_certificate(certificate)
                parsed.verify_directly_issued_by(self.authority)
                name = str(parsed.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
                public_key = parsed.public_key()
            except (ValueError, TypeError, IndexError, InvalidSignature, UnsupportedAlgorithm) as error:
                raise WireError("forged", "a map signed by a stranger") from error
            if not isinstance(public_key, ec.EllipticCurvePublicKey):
                raise WireError("forged", "a map signed with another kind of key")
            if len(self._signers) >= MAX_SIGNERS:
                self._signers.clear()
            known = self._signers[certificate] = (name, public_key)
        return known

    def _statement(self, robot: str, version: Version, root: bytes) -> bytes:
        """Return the bytes that are signed (the format)."""
        return PURPOSE + f"{self.team}\n{robot}\n".encode() + struct.pack("<QQ", *version) + root

    def root_of(self, robot: str, snapshot: Snapshot) -> bytes:
        """Return a hash of all that a snapshot holds; tiles hashed before are not hashed again."""
        before, leaves = self._leaves.get(robot, {}), {}
        root = blake2b(digest_size=HASH_BYTES)
        root.update(struct.pack("<dqq", snapshot.map.resolution_m, len(snapshot.map.tiles), len(snapshot.blocks)))
        for index in sorted(snapshot.map.tiles):
            tile = snapshot.map.tiles[index]
            known = before.get(index)
            leaf = known[1] if known is not None and known[0] is tile else _hash(tile.cells.tobytes())
            leaves[index] = (tile, leaf)
            root.update(struct.pack("<qqq", *index, tile.revision) + leaf)
        for block in snapshot.blocks:
            root.update(struct.pack("<q", block.revision) + _hash(block.content))
        self._leaves[robot] = leaves
        return root.digest()


def _hash(content: bytes) -> bytes:
    return blake2b(content, digest_size=HASH_BYTES).digest()
