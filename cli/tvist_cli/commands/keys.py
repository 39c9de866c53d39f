"""`tvist keys`: create certificates for a robot and its clients."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from tvist_cli.certificates import (
    CertificateAuthority,
    CertificateError,
    Host,
    common_name,
    host_of,
    hosts_of,
    read_certificate,
    write_new,
)
from tvist_cli.failure import Failure, Misuse, check_range, failing_on
from tvist_cli.output import print_lines
from tvist_client.transports import certificates as of_client
from tvist_protocol.keys import check_robot_name
from tvist_server.gateways.access import Role
from tvist_server.gateways.security import AUTHORITY, CERTIFICATE, CLIENTS, KEY, roles_in
from tvist_server.option_values import StartError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
"""Allowed client names. They have no dot, so that a client's folder cannot collide with the files beside it."""
AUTHORITY_KEY = "authority.key"
HEAD = """\
# Role of each client, by the common name of its certificate: an "operator" may move the robot, a "viewer" may watch it.
# A router knows two more: a "robot" of that name or namespace, and another "router", which may do everything.
# A client that is not listed has no access: delete its line and restart the robot to revoke its rights.
"""


def keys(
    folder: Path,
    *,
    robot: str | None = None,
    host: list[str] | None = None,
    operator: list[str] | None = None,
    viewer: list[str] | None = None,
    member: list[str] | None = None,
    uplink: list[str] | None = None,
    days: int = 365,
    json: bool = False,
) -> None:
    """Create a certificate authority and certificates for a robot and its clients; keep files that exist.

    Give FOLDER to tvist serve --security, and FOLDER/NAME to --security of the client called NAME.

    Args:
        folder: Create the files in this folder.
        robot: Set the robot's name; required the first time.
        host: Add a host name or IP address under which clients reach the robot, repeatable; required the first time.
        operator: Add a client of this name that may move the robot, repeatable.
        viewer: Add a client of this name that may only watch the robot, repeatable.
        member: Add a robot, or a namespace of robots, that connects to the router of this folder, repeatable.
        uplink: Add another router that connects to the router of this folder, repeatable.
        days: Make the new certificates valid for this number of days.
        json: Print one JSON object.
    """
    check_range("days", days, 1, 3650)
    with failing_on(ValueError, exit_code=2):
        if robot is not None:
            check_robot_name(robot)
        asked = _roles({"operator": operator, "viewer": viewer, "robot": member, "router": uplink})
        hosts = tuple(dict.fromkeys(host_of(name) for name in host or []))
    with failing_on(CertificateError, StartError, OSError):
        ring = _KeyRing(folder, days)
        ring.look(robot, hosts, asked)
        ring.make(robot, hosts, asked)
    lines = (
        *(f"made  {what}" for what in ring.made),
        *(f"kept  {what}" for what in ring.kept),
        f"robot:  tvist serve --security {folder} --listen tls/ADDRESS:7447",
        *(f"{name}:  tvist check tls/HOST:7447 --security {folder / name}" for name in asked),
        f"anyone with {folder / AUTHORITY_KEY} can create operators; the robot does not need it: store it elsewhere",
    )
    result = {"folder": str(folder), "made": ring.made, "kept": ring.kept, "roles": ring.roles}
    print_lines(result, lines, json=json)


@dataclass
class _KeyRing:
    """A folder of keys; `look` changes nothing and raises if `make` would stop half way."""

    folder: Path
    days: int
    made: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)
    roles: dict[str, Role] = field(default_factory=dict)

    def look(self, robot: str | None, hosts: tuple[Host, ...], asked: dict[str, Role]) -> None:
        """Check that nothing is missing and that existing files agree with the request."""
        there = [(self.folder / name).exists() for name in (AUTHORITY, AUTHORITY_KEY)]
        if there == [True, False]:
            raise Failure(
                f"{self.folder / AUTHORITY_KEY} is missing: put it back to create more certificates"
            )
        if (self.folder / CERTIFICATE).exists():
            certificate = read_certificate(self.folder / CERTIFICATE)
            name = common_name(certificate)
            if robot not in {None, name} or (hosts and set(hosts) != hosts_of(certificate)):
                good = ", ".join(sorted(str(host.value) for host in hosts_of(certificate)))
                raise Failure(
                    f"{self.folder / CERTIFICATE} belongs to {name} at {good} and is not overwritten: "
                    "use another folder, or move it and robot.key away"
                )
        elif robot is None or not hosts:
            raise Misuse(f"{self.folder} has no {CERTIFICATE} yet: give --robot NAME and --host ADDRESS")
        if (self.folder / CLIENTS).exists():
            self.roles = roles_in(self.folder)
        for name, role in asked.items():
            given = self.roles.get(name)
            if given not in {None, role}:
                raise Failure(
                    f"{name} already has the role {given}: use another name, or edit {self.folder / CLIENTS}"
                )
            if given is None and (self.folder / name).exists():
                # A client whose line was deleted still has its certificate; a new line would admit it again.
                raise Failure(
                    f"{self.folder / name} exists but {CLIENTS} does not list {name}: use another name"
                )

    def make(self, robot: str | None, hosts: tuple[Host, ...], asked: dict[str, Role]) -> None:
        """Create the files that are missing."""
        self.folder.mkdir(parents=True, exist_ok=True)
        own = self.folder / AUTHORITY, self.folder / AUTHORITY_KEY
        there = own[0].exists()
        authority = CertificateAuthority.read(*own) if there else CertificateAuthority.make()
        if not there:
            authority.write(*own)
            self.made.append(f"{own[0]}: authority, until {authority.until:%Y-%m-%d}")
        if robot is not None and not (self.folder / CERTIFICATE).exists():
            pair = authority.issue(robot, "robot", days=self.days, hosts=hosts)
            pair.write(self.folder / CERTIFICATE, self.folder / KEY)
            self.made.append(f"{self.folder / CERTIFICATE}: robot {robot}, until {pair.until:%Y-%m-%d}")
        for name, role in asked.items():
            self._client(authority, name, role)

    def _client(self, authority: CertificateAuthority, name: str, role: Role) -> None:
        own = self.folder / name
        if own.exists():
            self.kept.append(f"{own}: {role}")
            return
        pair = authority.issue(name, "client", days=self.days)
        if name not in self.roles:
            # The file of roles may have been edited by hand.
            path = self.folder / CLIENTS
            before = path.read_text(encoding="utf-8") if path.exists() else HEAD
            gap = "" if before.endswith("\n") or not before else "\n"
            path.write_text(f'{before}{gap}"{name}" = "{role}"\n', encoding="utf-8")
            self.roles[name] = role
        own.mkdir(mode=0o700)
        pair.write(own / of_client.CERTIFICATE, own / of_client.KEY)
        write_new(own / of_client.AUTHORITY, (self.folder / AUTHORITY).read_bytes(), 0o644)
        self.made.append(f"{own}: {role}, until {pair.until:%Y-%m-%d}")


def _roles(names: dict[Role, list[str] | None]) -> dict[str, Role]:
    asked: dict[str, Role] = {}
    for role, name in [(role, name) for role, several in names.items() for name in several or ()]:
        if not NAME.fullmatch(name):
            form = "1 to 64 of A-Z a-z 0-9 _ -, the first a letter or a digit"
            raise ValueError(f"client is {name!r:.80}: must be {form}")
        if (other := asked.setdefault(name, role)) != role:
            more = ": an operator may watch, too" if {role, other} == {"operator", "viewer"} else ""
            raise ValueError(f"{name} cannot be both {other} and {role}{more}")
    return asked
