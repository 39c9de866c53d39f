"""Keys made by `tvist keys`, and invalid certificates."""

from datetime import UTC, datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID as Usage
from cryptography.x509.oid import NameOID
from tests.places import free_endpoint
from tests.system.shell import tvist

TLS = "transport/link/tls/"


def free_tls_endpoint():
    return free_endpoint().replace("tcp/", "tls/")


def made(folder, *options):
    """Make keys for a robot of this machine; return their folder."""
    robot = ("--robot", "ur5e", "--host", "127.0.0.1", "--host", "localhost")
    tvist("keys", folder, *robot, *options).assert_done()
    return folder


def shown(folder, authority=None, certificate=None, key=None):
    """Return settings of a Zenoh session with a client's certificate; each file can be replaced."""
    return {
        f"{TLS}enable_mtls": True,
        f"{TLS}root_ca_certificate": str(authority or folder / "authority.pem"),
        f"{TLS}connect_certificate": str(certificate or folder / "client.pem"),
        f"{TLS}connect_private_key": str(key or folder / "client.key"),
    }


def forge(folder, name, *, issuer=None, key=None, days=1.0, usage=Usage.CLIENT_AUTH, chain=False):
    """Make a folder with a certificate of a client's common name, and return the folder.

    `issuer` has the files of certificate and key that sign it, else it signs itself; `key` is the file of its
    own key, else it is new; `chain` appends the issuer's certificate.
    """
    folder.mkdir()
    own = read_key(key) if key else ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    signing, by, behind = own, subject, b""
    if issuer is not None:
        parent = x509.load_pem_x509_certificate(issuer[0].read_bytes())
        signing, by = read_key(issuer[1]), parent.subject
        behind = issuer[0].read_bytes() if chain else b""
    now = datetime.now(UTC)  # noqa: TID251  a date is meant
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(by)
        .public_key(own.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=30))
        .not_valid_after(now + timedelta(days=days))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([usage]), critical=False)
        .sign(signing, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    (folder / "client.pem").write_bytes(certificate.public_bytes(pem) + behind)
    form = serialization.PrivateFormat.PKCS8
    (folder / "client.key").write_bytes(own.private_bytes(pem, form, serialization.NoEncryption()))
    return folder


def read_key(path):
    return serialization.load_pem_private_key(path.read_bytes(), password=None)
