"""Authentication of a client by a folder with its certificate, as `tvist keys` makes one for each client.

authority.pem    certificate of the authority that signed the robot's
client.pem       the client's certificate, and
client.key       its private key
"""

import contextlib
import os
import socket
import ssl
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tvist_client.errors import NotConnectedError

AUTHORITY, CERTIFICATE, KEY = "authority.pem", "client.pem", "client.key"
OPEN_MS = 15_000
"""Longest time to open a session [ms]. A server accepts no client for 100 ms after each failed handshake, so a
hundred connections that are given up at once make the next client wait for 10 s.
"""
PROBE_S = 2.0
"""Longest time to find out why there is no connection [s]."""

Folder = str | os.PathLike[str]


def settings(endpoint: str, security: Folder | None) -> dict[str, Any]:
    """Return the settings of a Zenoh session with this certificate, by path.

    Args:
        endpoint: Endpoint of the server.
        security: The client's folder; None for a server without certificates.

    Raises:
        NotConnectedError: A file is missing, or folder and endpoint do not match.
    """
    encrypted = endpoint.startswith("tls/")
    if security is None:
        if encrypted:
            raise NotConnectedError(f"{endpoint} requires a certificate: give its folder as security")
        return {}
    if not encrypted:
        raise NotConnectedError(
            f"{endpoint} does not use certificates: with security, the endpoint must be tls/<host>:<port>"
        )
    folder = Path(security).absolute()
    for name in (AUTHORITY, CERTIFICATE, KEY):
        try:
            (folder / name).read_bytes()
        except OSError as error:
            why = f"{folder / name}: {error.strerror}; `tvist keys` creates a folder for each client"
            raise NotConnectedError(why) from error
    return {
        "transport/unicast/open_timeout": OPEN_MS,
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/root_ca_certificate": str(folder / AUTHORITY),
        "transport/link/tls/connect_certificate": str(folder / CERTIFICATE),
        "transport/link/tls/connect_private_key": str(folder / KEY),
    }


def why_refused(endpoint: str, security: Folder, whose: str = "robot") -> str | None:
    """Return why no session could be opened, judged by a handshake of our own, since Zenoh does not report it.

    This blocks for at most twice `PROBE_S`.

    Args:
        endpoint: Endpoint of the server.
        security: The client's folder.
        whose: What listens there, for the sentence.

    Returns:
        A reason; None if the handshake succeeds or no server listens.
    """
    folder = Path(security)
    where = urlsplit("//" + endpoint.partition("/")[2].partition("#")[0].partition("?")[0])
    try:
        context = ssl.create_default_context(cafile=folder / AUTHORITY)
        context.load_cert_chain(folder / CERTIFICATE, folder / KEY)
    except ssl.SSLError as error:
        return f"{folder} does not contain a certificate and its key ({error.reason or error})"
    try:
        with (
            socket.create_connection((where.hostname or "", where.port or 0), PROBE_S) as plain,
            context.wrap_socket(plain, server_hostname=where.hostname) as encrypted,
            contextlib.suppress(TimeoutError),
        ):
            # In TLS 1.3 a server judges the client's certificate after the handshake, so its verdict has to be read.
            encrypted.recv(1)
    except ssl.SSLCertVerificationError as error:
        return f"the {whose}'s certificate is not trusted: {error.verify_message.rstrip('.')}"
    except ssl.SSLError as error:
        return (
            f"the {whose} rejects this certificate: {(error.reason or str(error)).replace('_', ' ').lower()}"
        )
    except (OSError, ValueError):
        return None
    return None
