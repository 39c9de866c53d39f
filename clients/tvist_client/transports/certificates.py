"""Authentication of a client by a folder with its certificate, made by `tvist keys`.

authority.pem    certificate of the authority that signed the robot's certificate
client.pem       the client's certificate, and
client.key       its private key
"""

import contextlib
import os
import re
import socket
import ssl
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tvist_client.errors import NotConnectedError

AUTHORITY, CERTIFICATE, KEY = "authority.pem", "client.pem", "client.key"
OPEN_MS = 15_000
"""Longest time to open a session [ms]; if 100 connections fail at once, a server delays the next by 10 s."""
PROBE_S = 4.0
"""Longest wait in a probe [s]: twice the time that a robot without TLS waits for the rest of a message."""

Folder = str | os.PathLike[str]


def settings(endpoint: str, security: Folder | None) -> dict[str, Any]:
    """Return the settings of a Zenoh session with the certificate in a client's folder; empty without a folder."""
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
            raise NotConnectedError(
                f"{folder / name}: {error.strerror}: give a folder that `tvist keys` made for a client"
            ) from error
    return {
        "transport/unicast/open_timeout": OPEN_MS,
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/root_ca_certificate": str(folder / AUTHORITY),
        "transport/link/tls/connect_certificate": str(folder / CERTIFICATE),
        "transport/link/tls/connect_private_key": str(folder / KEY),
    }


def why_refused(endpoint: str, security: Folder | None, whose: str = "robot") -> str | None:
    """Return why no session could be opened.

    Zenoh does not report this, so a separate handshake finds it out. Blocks for at most three times
    `PROBE_S`. None: another cause, such as that no server listens. `whose` is for messages.
    """
    protocol, _, address = re.split("[?#]", endpoint)[0].partition("/")
    if protocol not in {"tcp", "tls"}:
        return None
    try:
        encrypted, failure = _handshake(address, security)
    except ssl.SSLError as error:
        return f"{security} does not contain a certificate and its key ({error.reason or error})"
    except (OSError, ValueError):  # nothing listens or answers there
        return None
    if encrypted != (security is not None):
        return (
            f"the {whose} there demands certificates: give tls/{address}, and as security the folder that "
            "`tvist keys` made for this client"
            if encrypted
            else f"the {whose} there has no certificates: give tcp/{address} without security"
        )
    if isinstance(failure, ssl.SSLCertVerificationError):
        return (
            f"the {whose}'s certificate is not trusted: {failure.verify_message.rstrip('.')}: take the folder that "
            f"`tvist keys` made beside that {whose}'s, and an address given to it as --host"
        )
    reason = (
        str(getattr(failure, "reason", None) or failure).rpartition("ALERT_")[2].replace("_", " ").lower()
    )
    rejected = f"the {whose} rejects this certificate ({reason}): make another one with `tvist keys`"
    return rejected if encrypted and failure is not None else None


def _handshake(address: str, security: Folder | None) -> tuple[bool, OSError | None]:
    """Return whether the peer uses TLS, and the error that ended the handshake; may raise ssl.SSLError or OSError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    if security is None:  # no secrets are sent, so any peer is acceptable
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    else:
        context.load_verify_locations(Path(security) / AUTHORITY)
        context.load_cert_chain(Path(security) / CERTIFICATE, Path(security) / KEY)
    where, encrypted = urlsplit(f"//{address}"), False
    with socket.create_connection((where.hostname or "", where.port or 0), PROBE_S) as plain:
        # Not `wrap_socket`: it leaves the socket open if the peer has already reset the connection.
        received, to_send = ssl.MemoryBIO(), ssl.MemoryBIO()
        link = context.wrap_bio(received, to_send, server_hostname=where.hostname)
        try:
            _carry(link.do_handshake, plain, received, to_send)
            encrypted = True
            # In TLS 1.3 a server checks the client's certificate after the handshake: read its answer.
            with contextlib.suppress(ssl.SSLEOFError, ssl.SSLZeroReturnError):
                _carry(lambda: link.read(1), plain, received, to_send)
        except TimeoutError:
            if not encrypted:
                raise
        except OSError as error:
            alert = "ALERT" in (getattr(error, "reason", None) or "")  # only TLS peers send an alert
            return encrypted or alert or isinstance(error, ssl.SSLCertVerificationError), error
    return encrypted, None


def _carry(
    step: Callable[[], object], plain: socket.socket, received: ssl.MemoryBIO, to_send: ssl.MemoryBIO
) -> None:
    """Carry bytes between a socket and a TLS object until `step` of the object succeeds."""
    while True:
        with contextlib.suppress(ssl.SSLWantReadError):
            step()
            return
        plain.sendall(to_send.read())
        heard = plain.recv(65536)
        received.write(heard)
        if not heard:
            received.write_eof()
