"""Certificate authority and its certificates for mutual TLS, with P-256: many small devices lack Ed25519."""

import ipaddress
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal, Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

AUTHORITY_DAYS = 7300
"""Validity of an authority's own certificate [days]; the certificates it signs expire earlier."""
SLACK = timedelta(hours=1)  # largest lag of the clock of a client or robot
USAGES = {"robot": ExtendedKeyUsageOID.SERVER_AUTH, "client": ExtendedKeyUsageOID.CLIENT_AUTH}
"""Extended key usage of each kind, so a client's certificate cannot pass as a robot's, or the reverse."""

LABEL = re.compile(r"(?!-)(?=.*[A-Za-z0-9])[A-Za-z0-9_-]{1,63}")  # part of a host name between dots

Host = x509.DNSName | x509.IPAddress


class CertificateError(ValueError):
    """A file contains no suitable certificate or key; the message names the file."""


def host_of(text: str) -> Host:
    """Parse a host name or IP address under which clients reach a robot."""
    try:
        return x509.IPAddress(ipaddress.ip_address(text))
    except ValueError:
        labels = text.split(".")
        if len(text) > 253 or not all(map(LABEL.fullmatch, labels)) or labels[-1].isdigit():
            raise ValueError(
                f"host is {text!r:.80}: must be a name such as robot.lab, or an IP address"
            ) from None
        return x509.DNSName(text)


@dataclass(frozen=True)
class KeyPair:
    """A certificate and its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @property
    def until(self) -> datetime:
        """Time at which the certificate expires."""
        return self.certificate.not_valid_after_utc

    def write(self, certificate: Path, key: Path) -> None:
        """Write certificate and key as new PEM files; only the owner can read the key's file."""
        form = serialization.PrivateFormat.PKCS8
        secret = self.key.private_bytes(serialization.Encoding.PEM, form, serialization.NoEncryption())
        write_new(key, secret, 0o600)
        write_new(certificate, self.certificate.public_bytes(serialization.Encoding.PEM), 0o644)


class CertificateAuthority(KeyPair):
    """An authority that signs certificates."""

    @classmethod
    def make(cls) -> Self:
        """Create a new authority."""
        key = ec.generate_private_key(ec.SECP256R1())
        # A unique name, so that a client with certificates of two authorities can tell them apart.
        name = f"tvist authority {x509.random_serial_number():x}"[:40]
        builder = (
            _builder(name, key, days=AUTHORITY_DAYS)
            .issuer_name(_name(name))
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(_key_usage(signs_certificates=True), critical=True)
        )
        return cls(builder.sign(key, hashes.SHA256()), key)

    @classmethod
    def read(cls, certificate: Path, key: Path) -> Self:
        """Read an existing authority; raise CertificateError if the key does not belong to the certificate."""
        pair = cls(read_certificate(certificate), _read_key(key))
        if pair.certificate.public_key() != pair.key.public_key():
            raise CertificateError(
                f"{key} is not the key of {certificate}: put the key of that certificate there"
            )
        return pair

    def issue(
        self, name: str, usage: Literal["robot", "client"], *, days: int, hosts: tuple[Host, ...] = ()
    ) -> KeyPair:
        """Create a key pair whose certificate is valid for `days`; a robot's certificate names its hosts."""
        key = ec.generate_private_key(ec.SECP256R1())
        mine = x509.SubjectKeyIdentifier.from_public_key(self.key.public_key())
        builder = (
            _builder(name, key, days=days)
            .issuer_name(self.certificate.subject)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_key_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage([USAGES[usage]]), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(mine), critical=False
            )
        )
        if hosts:
            builder = builder.add_extension(x509.SubjectAlternativeName(hosts), critical=False)
        pair = KeyPair(builder.sign(self.key, hashes.SHA256()), key)
        if pair.until > self.until:
            raise CertificateError(
                f"days is {days}: must end before the authority does, on {self.until:%Y-%m-%d}"
            )
        return pair


def common_name(certificate: x509.Certificate) -> str:
    """Return the common name of a certificate's owner."""
    return str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)


def hosts_of(certificate: x509.Certificate) -> set[Host]:
    """Return the host names and addresses for which a certificate is valid."""
    found = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    return {name for name in found.value if isinstance(name, Host)}


def read_certificate(path: Path) -> x509.Certificate:
    """Read a PEM certificate; raise CertificateError if there is none."""
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        raise CertificateError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise CertificateError(f"{path} is not a PEM certificate") from error


def write_new(path: Path, content: bytes, mode: int) -> None:
    """Write a new file with its final permissions from the start."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with open(descriptor, "wb") as file:  # noqa: PTH123  a descriptor, not a path
        file.write(content)


def _read_key(path: Path) -> ec.EllipticCurvePrivateKey:
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), password=None)
    except OSError as error:
        raise CertificateError(f"{path}: {error.strerror}") from error
    except (ValueError, TypeError) as error:
        raise CertificateError(f"{path} is not a PEM private key without a password") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise CertificateError(f"{path} is not an ECDSA key")
    return key


def _builder(name: str, key: ec.EllipticCurvePrivateKey, *, days: int) -> x509.CertificateBuilder:
    now = datetime.now(UTC).replace(microsecond=0)  # noqa: TID251  a date is meant
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SLACK)
        .not_valid_after(now + timedelta(days=days))
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )


def _name(common: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _key_usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )
