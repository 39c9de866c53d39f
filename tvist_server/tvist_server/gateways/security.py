"""Access protection of a server that other machines can reach: certificates and roles, or `--insecure`.

`tvist keys` fills the folder given as `--security`; on a router, roles may also be "robot" and "router":

    authority.pem    certificate of the authority that signs all others
    robot.pem        the robot's certificate, and
    robot.key        its private key
    clients.toml     role by a certificate's common name: "anna" = "operator"; others have no access
"""

import contextlib
import ipaddress
import socket
import ssl
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tvist_plant.user_file import read_bytes
from tvist_protocol.codec import MAX_BYTES
from tvist_server.gateways.access import Role, access_control, open_access, router_access
from tvist_server.option_values import StartError, read_start_file

AUTHORITY, CERTIFICATE, KEY, CLIENTS = "authority.pem", "robot.pem", "robot.key", "clients.toml"
_LINE = 'a line is "NAME" = "operator", "viewer", "robot" or "router"'

HANDSHAKE_MS = 60_000
"""Longest TLS handshake [ms]. After a failed handshake Zenoh accepts no client for 100 ms (its issue 2685),
so a hundred failures at once delay the next client by 10 s, which a handshake must outlast. At most ten
handshakes fail per second, so at most 600 are in progress."""

IP_PROTOCOLS = frozenset({"tcp", "udp", "ws", "tls", "quic"})

LIMITS: Mapping[str, Any] = {
    # Largest message assembled from fragments; the gateway refuses messages above MAX_BYTES.
    "transport/link/rx/max_message_size": 2 * MAX_BYTES
}
"""Zenoh settings, by path, of a session that other machines can reach."""


def server_security(
    listen: Sequence[str],
    robots: Sequence[str],
    *,
    security: str | None,
    insecure: bool,
    namespace: str = "",
    ros2: bool = False,
) -> tuple[list[str], dict[str, Any]]:
    """Return the endpoints to listen on and the settings that protect them; StartError if one is unprotected."""
    secured, settings, roles = _security(listen, security, insecure=insecure)
    everyone = open_access(robots, namespace, ros2=ros2)
    access = everyone if roles is None else access_control(robots, roles, namespace)
    return secured, {**settings, "access_control": access}


def router_security(
    listen: Sequence[str], *, security: str | None, insecure: bool
) -> tuple[list[str], dict[str, Any]]:
    """Return router endpoints and settings; without certificates, anyone may connect as robot or client."""
    secured, settings, roles = _security(listen, security, insecure=insecure)
    return secured, settings if roles is None else {**settings, "access_control": router_access(roles)}


def check_endpoints(what: str, endpoints: Sequence[str]) -> None:
    """Raise StartError if an endpoint is malformed."""
    for endpoint in endpoints:
        word, slash, address = endpoint.partition("/")
        if not (slash and address and word.replace("-", "").isalnum()):
            raise StartError(
                f"{what} is {endpoint!r}: must have the form tcp/ADDRESS:PORT, such as tcp/127.0.0.1:7447"
            )


def _security(
    listen: Sequence[str], security: str | None, *, insecure: bool
) -> tuple[list[str], dict[str, Any], dict[str, Role] | None]:
    """Return endpoints, transport settings, and each client's role (None without certificates)."""
    check_endpoints("listen", listen)
    if security is not None:
        if insecure:
            raise StartError("security and insecure exclude each other: leave one out")
        secured, folder = [_tls_endpoint(endpoint) for endpoint in listen], Path(security).absolute()
        roles = roles_in(folder)
        if not roles:
            raise StartError(
                f"{folder / CLIENTS} lists no clients: add one with `tvist keys {security} --operator NAME`"
            )
        _check_pair(folder)
        settings = {
            "enable_mtls": True,
            "root_ca_certificate": str(folder / AUTHORITY),
            "listen_certificate": str(folder / CERTIFICATE),
            "listen_private_key": str(folder / KEY),
            "close_link_on_expiration": True,
        }
        return (
            secured,
            {**LIMITS, **{f"transport/link/tls/{key}": value for key, value in settings.items()}},
            roles,
        )
    for endpoint in listen:
        if protocol(endpoint) in {"tls", "quic"} and not options(endpoint):
            raise StartError(
                f"listen is {endpoint}, which needs certificates: add --security DIR (made by `tvist keys`)"
            )
    exposed = [endpoint for endpoint in listen if not is_local(endpoint)]
    if exposed and not insecure:
        raise StartError(
            f"listen is {exposed[0]}, which other machines can reach: add --security DIR (made by `tvist keys`) and "
            "listen on tls/…, or add --insecure to let anyone move the robot"
        )
    return list(listen), dict(LIMITS) if exposed else {}, None


def check_ur_address(address: str, *, insecure: bool) -> None:
    """Raise StartError if other machines could reach UR's interfaces, which cannot authenticate clients."""
    if not insecure and not ipaddress.ip_address(address).is_loopback:
        raise StartError(
            f"ur_address is {address}, which other machines can reach, and UR's interfaces do not authenticate "
            "clients: add --insecure to let anyone move the robot"
        )


def roles_in(folder: Path) -> dict[str, Role]:
    """Read the role of each client from `clients.toml`; StartError or UserFileError if it is invalid."""
    path = folder / CLIENTS
    try:
        return read_start_file(path, "file of roles", dict[str, Role])
    except StartError as error:
        hint = _LINE if path.exists() else "`tvist keys` makes it"
        raise StartError(f"{error}; {hint}") from error


def _tls_endpoint(endpoint: str) -> str:
    """Return an endpoint with handshake timeout, for `--security`; StartError unless its protocol is TLS."""
    if protocol(endpoint) != "tls":
        address = endpoint.partition("/")[2] or "<address>:<port>"
        raise StartError(
            f"listen is {endpoint}: with --security every endpoint must be tls/, such as tls/{address}"
        )
    if options(endpoint):
        raise StartError(
            f"listen is {endpoint}: with --security no options may follow #, since they would override it"
        )
    return f"{endpoint}#tls_handshake_timeout_ms={HANDSHAKE_MS}"


def _check_pair(folder: Path) -> None:
    """Test the files by a TLS handshake in this process, because Zenoh's errors do not say what is wrong."""
    for name in (AUTHORITY, CERTIFICATE, KEY):
        try:
            read_bytes(folder / name, "certificate or key")
        except OSError as error:
            raise StartError(f"{folder / name}: {error.strerror}; `tvist keys` makes it") from error
    try:
        server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        server.load_cert_chain(folder / CERTIFICATE, folder / KEY)
        client = ssl.create_default_context(cafile=folder / AUTHORITY)
        client.check_hostname = False  # only clients know the name by which they reach the robot
        _shake_hands(server, client)
    except ssl.SSLCertVerificationError as error:
        why = f"no client would trust {CERTIFICATE}: {error.verify_message}"
        raise StartError(f"{folder}: {why}; move it away and run `tvist keys` again") from error
    except ssl.SSLError as error:
        why = f"{AUTHORITY}, {CERTIFICATE} and {KEY} do not belong together"
        raise StartError(f"{folder}: {why} ({error.reason or error})") from error


def _shake_hands(server: ssl.SSLContext, client: ssl.SSLContext) -> None:
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    sides = (client.wrap_bio(to_client, to_server), server.wrap_bio(to_server, to_client, server_side=True))
    for side in (*sides, sides[0]):
        with contextlib.suppress(ssl.SSLWantReadError):
            side.do_handshake()


def protocol(endpoint: str) -> str:
    """Return the protocol, such as `tcp` of `tcp/127.0.0.1:7447`; empty if there is none."""
    before, slash, _ = endpoint.partition("/")
    return before if slash else ""


def options(endpoint: str) -> str:
    """Return the part after `#`, which overrides the session's settings; empty if there is none."""
    return endpoint.partition("#")[2]


def is_local(endpoint: str) -> bool:
    """Return whether only this machine can reach an endpoint; False if in doubt, as for an unknown protocol or host."""
    if protocol(endpoint) == "unixsock-stream":
        return True
    if protocol(endpoint) not in IP_PROTOCOLS:
        return False
    address = endpoint.partition("/")[2].partition("#")[0].partition("?")[0]
    host = address.rpartition(":")[0].removeprefix("[").removesuffix("]")
    addresses = _addresses(host)
    return bool(addresses) and all(address.is_loopback for address in addresses)


def _addresses(host: str) -> list[ipaddress.IPv4Address | ipaddress.IPv6Address]:
    if not host:
        return []
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
        return [ipaddress.ip_address(str(where[0]).partition("%")[0]) for *_, where in found]
    except (OSError, ValueError):
        return []
