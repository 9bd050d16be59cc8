"""X.509 for a team: its own certificate authority, and the certificates that it signs."""

from __future__ import annotations

import datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_bytes


def team_authority(folder: Path, team: str, valid_days: float) -> tuple[ec.EllipticCurvePrivateKey, x509.Certificate]:
    """Return the team's CA from its folder, made now if there is none; raises as :func:`read_authority` does.

    A key without a certificate, as an interrupted call leaves it, gets one.
    """
    key_path, certificate_path = folder / "key.pem", folder / "certificate.pem"
    if certificate_path.exists():
        return read_authority(folder)
    if key_path.exists():
        key = read_private_key(key_path)
    else:
        key = new_key()
        write_private_key(key_path, key)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"{team} CA"[:64])])
    certificate = (
        _builder(name, name, key, valid_days)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    write_bytes(certificate_path, pem(certificate))
    return key, certificate


def read_authority(folder: Path) -> tuple[ec.EllipticCurvePrivateKey, x509.Certificate]:
    """Return the team's CA from its folder; raise ``InputError`` where the key or the certificate cannot be read.

    A new key in place of a missing one would be another authority, which no robot of the team knows.
    """
    certificate_path = folder / "certificate.pem"
    try:
        return read_private_key(folder / "key.pem"), x509.load_pem_x509_certificate(certificate_path.read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: the team's CA cannot be read ({error})") from error


def member_certificate(
    name: str,
    key: ec.EllipticCurvePrivateKey,
    ca_key: ec.EllipticCurvePrivateKey,
    ca_certificate: x509.Certificate,
    valid_days: float,
) -> x509.Certificate:
    """Return a member's certificate, good for both ends of a mutual TLS connection, signed by the team's CA."""
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
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, valid_days: float
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


def pem(certificate: x509.Certificate) -> bytes:
    """Return a certificate as the bytes of a PEM file."""
    return certificate.public_bytes(serialization.Encoding.PEM)


def new_key() -> ec.EllipticCurvePrivateKey:
    """Return a new key on the curve P-256, as all certificates have."""
    return ec.generate_private_key(ec.SECP256R1())


def read_private_key(path: Path) -> ec.EllipticCurvePrivateKey:
    """Return the key of a file; raise ``InputError`` where it is not an elliptic curve key."""
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), password=None)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{path}: not a private key ({error})") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise InputError(f"{path}: not an elliptic curve key; make new ones with mrslam keys")
    return key


def write_private_key(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    """Write a new key's file, which only its owner can read; it is whole or not there."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    text = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    write_bytes(path, text, mode=0o600)
