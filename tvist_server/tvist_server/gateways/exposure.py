"""What a server that others can reach needs: certificates and roles, or somebody who says that it does not.

The folder named by `--security` holds, as `tvist keys` makes it,

    authority.pem    certificate of the authority that signs all others
    robot.pem        the robot's certificate, and
    robot.key        its private key
    clients.toml     role by name: "anna" = "operator"; who is left out is nobody

Both sides show a certificate (mutual TLS); the common name of the client's decides what it may do.
"""

import contextlib
import ipaddress
import ssl
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tvist_plant.user_file import read_bytes, read_toml
from tvist_protocol.codec import MAX_BYTES
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_server.gateways.access import Role, access_control, open_access
from tvist_server.gateways.endpoints import is_local, options, protocol

AUTHORITY, CERTIFICATE, KEY, CLIENTS = "authority.pem", "robot.pem", "robot.key", "clients.toml"
_LINE = 'a line is "NAME" = "operator" or "NAME" = "viewer"'

HANDSHAKE_MS = 60_000
"""How long a TLS handshake may take [ms]. Zenoh accepts nobody for 100 ms after each that fails (its issue 2685),
so a hundred given up at once keep the next client waiting for 10 s: a handshake must outlast that. Ten a second
is also all that can fail, so no more than 600 are under way."""

LIMITS: Mapping[str, Any] = {
    # What a client may make the server put together of fragments; the gateway refuses what is above MAX_BYTES.
    "transport/link/rx/max_message_size": 2 * MAX_BYTES,
}
"""Of a session that others can reach: path to value."""


class ExposureError(ValueError):
    """The robot would be reachable in a way nobody asked for; the sentence says what to do."""


def guarded(
    listen: Sequence[str], robots: Sequence[str], *, security: str | None, insecure: bool
) -> tuple[list[str], dict[str, Any]]:
    """Endpoints to listen on and the settings that guard them.

    Args:
        listen: Endpoints asked for.
        robots: Names of the robots served there.
        security: Folder with certificates and roles.
        insecure: Whether anybody may do anything.

    Raises:
        ExposureError: Others could reach an endpoint and nothing guards it, or the folder is not complete.
    """
    if security is not None:
        if insecure:
            raise ExposureError("security and insecure exclude each other: leave one out")
        return [_secured(endpoint) for endpoint in listen], {**LIMITS, **_settings(security, robots)}
    for endpoint in listen:
        if protocol(endpoint) in {"tls", "quic"} and not options(endpoint):
            raise ExposureError(
                f"listen is {endpoint}, which needs certificates: add --security DIR (`tvist keys`)"
            )
    exposed = [endpoint for endpoint in listen if not is_local(endpoint)]
    if exposed and not insecure:
        raise ExposureError(
            f"listen is {exposed[0]}, which others than this machine can reach: add --security DIR (made by "
            "`tvist keys`) and listen on tls/…, or --insecure to let anybody there move the robot"
        )
    return list(listen), {**(LIMITS if exposed else {}), "access_control": open_access(robots)}


def guarded_doors(address: str, *, insecure: bool) -> None:
    """Refuse to open UR's interfaces, which know no certificates, where others reach them unasked.

    Args:
        address: IP address they listen at.
        insecure: Whether anybody may do anything.

    Raises:
        ExposureError: Others could.
    """
    if not insecure and not ipaddress.ip_address(address).is_loopback:
        raise ExposureError(
            f"ur_address is {address}, which others than this machine can reach, and UR's interfaces ask nobody who "
            "he is: add --insecure to let anybody there move the robot"
        )


def roles_in(folder: Path) -> dict[str, Role]:
    """Role by name, from `clients.toml`.

    Raises:
        ExposureError: It cannot be read, or a role is none.
        UserFileError: It is no file with a text of that size, or is nested too deeply.
    """
    path = folder / CLIENTS
    try:
        return checked(read_toml(path, "file of roles"), dict[str, Role])
    except OSError as error:
        raise ExposureError(f"{path}: {error.strerror}; `tvist keys` makes it") from error
    except tomllib.TOMLDecodeError as error:
        raise ExposureError(f"{path}: it is no TOML: {error}; {_LINE}") from error
    except ProtocolError as error:
        raise ExposureError(f"{path}: {error.why}; {_LINE}") from error


def _secured(endpoint: str) -> str:
    """An endpoint under `--security`.

    Another protocol is refused, not turned into TLS: what the server says and what clients type would then
    not be what was asked for, and a client of tcp/ would meet a silence that explains nothing.
    """
    if protocol(endpoint) != "tls":
        address = endpoint.partition("/")[2] or "<address>:<port>"
        raise ExposureError(f"listen is {endpoint}: with --security every endpoint is tls/, as tls/{address}")
    if options(endpoint):
        raise ExposureError(
            f"listen is {endpoint}: with --security nothing may stand behind #, it would go before it"
        )
    return f"{endpoint}#tls_handshake_timeout_ms={HANDSHAKE_MS}"


def _settings(security: str, robots: Sequence[str]) -> dict[str, Any]:
    folder = Path(security).absolute()
    roles = roles_in(folder)
    if not roles:
        raise ExposureError(f"{folder / CLIENTS} names nobody: `tvist keys {security} --operator NAME` does")
    _check_pair(folder)
    return {
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/root_ca_certificate": str(folder / AUTHORITY),
        "transport/link/tls/listen_certificate": str(folder / CERTIFICATE),
        "transport/link/tls/listen_private_key": str(folder / KEY),
        "transport/link/tls/close_link_on_expiration": True,
        "access_control": access_control(robots, roles),
    }


def _check_pair(folder: Path) -> None:
    """Shake hands with oneself, as a client will: Zenoh would say what is wrong in its own words, or to nobody."""
    for name in (AUTHORITY, CERTIFICATE, KEY):
        try:
            read_bytes(folder / name, "certificate or key")
        except OSError as error:
            raise ExposureError(f"{folder / name}: {error.strerror}; `tvist keys` makes it") from error
    try:
        server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        server.load_cert_chain(folder / CERTIFICATE, folder / KEY)
        client = ssl.create_default_context(cafile=folder / AUTHORITY)
        client.check_hostname = False  # clients do that: they know by which name they came
        _shake_hands(server, client)
    except ssl.SSLCertVerificationError as error:
        why = f"no client would trust {CERTIFICATE}: {error.verify_message}"
        raise ExposureError(
            f"{folder}: {why}; `tvist keys` makes another one once it is moved away"
        ) from error
    except ssl.SSLError as error:
        why = f"{AUTHORITY}, {CERTIFICATE} and {KEY} are no certificates and key that belong together"
        raise ExposureError(f"{folder}: {why} ({error.reason or error})") from error


def _shake_hands(server: ssl.SSLContext, client: ssl.SSLContext) -> None:
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    sides = (client.wrap_bio(to_client, to_server), server.wrap_bio(to_server, to_client, server_side=True))
    for side in (*sides, sides[0]):
        with contextlib.suppress(ssl.SSLWantReadError):
            side.do_handshake()
