"""How a robot is served: from the command line, or from a TOML file."""

import dataclasses
import ipaddress
import tempfile
import tomllib
from typing import Annotated

from msgspec import Meta, Struct
from msgspec.structs import replace

from tvist_controller import calibrations
from tvist_controller.setup import Setup, check_rating, paper_payload
from tvist_plant import user_file
from tvist_plant.description import RobotDescription, load
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Clock
from tvist_protocol.values import RobotName, Seed
from tvist_server.fleet import members
from tvist_server.initial import read_state, shaped_by
from tvist_server.ur_ports import Door, UrPorts

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_NAME = "ur5e"
_INSTEAD = {
    "name": "several robots are named after their files, leave name out",
    "robot": "put it into the list of robots",
}
"""What to do about a key that `robots` excludes."""


class ConfigError(ValueError):
    """A configuration is wrong: one sentence that names the key, the value and what is allowed."""


class ServeConfig(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What `tvist serve` can be told; every key is optional."""

    name: RobotName = DEFAULT_NAME
    """Name on the network."""
    robot: str = "ur5e"
    """Robot that comes with the package, or path of a robot file."""
    robots: str | None = None
    """Several of them, ROBOT[*COUNT] with commas, named after their files; instead of `name` and `robot`."""
    listen: tuple[str, ...] = (DEFAULT_ENDPOINT,)
    """Zenoh endpoints to listen on."""
    security: str | None = None
    """Folder with certificates and roles, as `tvist keys` makes it; endpoints are then tls/…"""
    insecure: bool = False
    """Let anybody who reaches an endpoint move the robot, on whatever network that is."""
    payload: Annotated[float, Meta(ge=0, le=100)] | None = None
    """Mass of the paper's disc, declared and carried [kg]; default: the robot file's payload."""
    overload: bool = False
    """Start even where the payload declared is above the robot's rating."""
    shaper: str = "zv"
    """Shaper to start with: its name, or FILE.py:NAME for one of your own."""
    calibration: str | None = calibrations.DEFAULT
    """Calibration that comes with the package, or path of one; "none": a robot still to be identified."""
    clock: Clock = "realtime"
    """Who lets time pass."""
    speed: Annotated[float, Meta(gt=0, le=100)] = 1.0
    """Of the robot's time against the clock's; real time only [-]."""
    realtime_priority: bool = False
    """Ask the system to put the ticks before all else; real time only."""
    start: str | tuple[float, ...] = "Q1"
    """A pose of the robot file, or joint angles [rad]."""
    state: str | None = None
    """TOML or JSON file with the state to start in: any of q, payload (carried), mode, shaper, seed."""
    seed: Seed = 0
    """Of sensor noise and gear errors; of several robots each has one of its own, counted on from here."""
    record: str | None = None
    """MCAP file to record into; of several robots each has its own, with its name at the end."""
    dump: str = tempfile.gettempdir()
    """Folder for the last second before the simulated arm failed."""
    truth: bool = False
    """Tell what no robot can know, too."""
    quiet: bool = False
    """Sensors without noise, and angles in the steps of an encoder: at rest nothing changes from tick to tick."""
    ur: bool = False
    """Open UR's own interfaces, too."""
    ur_address: str = "127.0.0.1"
    """IP address they listen at; of several robots each has the next one."""
    ur_ports: UrPorts = UrPorts()
    """Ports of those that are not where UR has them; 0 keeps one shut."""

    def setups(self) -> list[Setup]:
        """The start of every robot's controller.

        Raises:
            ConfigError: As `setup`.
            UserFileError: As `setup`.
        """
        if self.robots is None:
            return [self.setup()]
        try:
            found = members(self.robots)
        except ValueError as error:
            raise ConfigError(str(error)) from error
        # By its own start each is what it would be alone, apart from the noise.
        starts: dict[str, Setup] = {}
        for member in found:
            if member.robot not in starts:
                starts[member.robot] = replace(self, robot=member.robot).setup()
        return [
            dataclasses.replace(starts[member.robot], name=member.name, seed=self.seed + index)
            for index, member in enumerate(found)
        ]

    def doors(self, number: int) -> tuple[str, dict[Door, int]]:
        """Where UR's interfaces of a robot are: address, and port by door.

        Args:
            number: Of the robot, 0 the first.

        Raises:
            ConfigError: `ur_address` is none, or leaves no room for so many.
        """
        try:
            first = ipaddress.ip_address(self.ur_address)
            address = first + number
        except ValueError as error:
            raise ConfigError(
                f"ur_address is {self.ur_address!r}: must be an IP address ({error})"
            ) from error
        if number and first.is_unspecified:
            raise ConfigError(
                f"ur_address is {self.ur_address}: several robots need an address of their own each"
            )
        return str(address), self.ur_ports.open()

    def command_line(self, command: str, name: str) -> str:
        """What to type on this machine for a command to reach a robot.

        Args:
            command: Such as `unlock`.
            name: The robot's.
        """
        words = ["tvist", command]
        if self.listen and self.listen[0] != DEFAULT_ENDPOINT:
            here = self.listen[0].replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")  # noqa: S104  only said
            words.append(here)
        words += ["--name", name] if name != DEFAULT_NAME else []
        return " ".join([*words, "--security", "FOLDER"] if self.security is not None else words)

    def setup(self) -> Setup:
        """The controller's start, of one robot.

        Raises:
            ConfigError: A value does not fit the others, or names something that is not there.
            UserFileError: It names a file that is not what is asked for.
        """
        try:
            description = load(self.robot)
            named = self.calibration not in {None, "none"}
            calibration = calibrations.load(str(self.calibration)) if named else None
            setup = Setup(
                description=description,
                q=self._start(description),
                payload=paper_payload(description, self.payload),
                calibration=calibration,
                name=self.name,
                seed=self.seed,
                clock=self.clock,
                truth=self.truth,
            )
            setup = shaped_by(setup, self.shaper)
            if self.state is not None:
                setup = read_state(self.state).on(setup)
            if self.quiet:
                setup = dataclasses.replace(setup, description=setup.description.quiet())
            setup.check()
        except user_file.UserFileError:
            raise
        except ValueError as error:
            raise ConfigError(str(error)) from error
        if not self.overload:
            try:
                check_rating(setup.payload, description)
            except ValueError as error:
                raise ConfigError(f"{error}: give --overload to insist") from error
        if calibration is not None and calibration.robot != description.robot.model:
            raise ConfigError(
                f"calibration {calibration.name!r} is of a {calibration.robot}; the robot is a "
                f"{description.robot.model}: name another one, or none"
            )
        return setup

    def _start(self, description: RobotDescription) -> tuple[float, ...]:
        if not isinstance(self.start, str):
            return self.start
        for name, pose in description.poses.items():
            if name.lower() == self.start.strip().lower():
                return pose
        try:
            return tuple(float(angle) for angle in self.start.split(","))
        except ValueError:
            known = ", ".join(description.poses)
            why = f"start is {self.start.strip()!r}: must be one of {known}, or angles with commas"
            raise ConfigError(why) from None


def from_mapping(content: object, source: str) -> ServeConfig:
    """Check values by name.

    Raises:
        ConfigError: A key is unknown, a value out of range, or one key excludes another.
    """
    if isinstance(content, dict) and content.get("robots") is not None:
        for key in ("name", "robot"):
            if content.get(key) is not None:
                raise ConfigError(f"{source}: robots and {key} exclude each other: {_INSTEAD[key]}")
    try:
        return checked(content, ServeConfig)
    except ProtocolError as error:
        raise ConfigError(f"{source}: {error.why}") from error


def read_toml(path: str) -> dict[str, object]:
    """Content of a configuration file, not yet checked.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
        UserFileError: It is no file with a text of that size, or is nested too deeply.
    """
    try:
        return user_file.read_toml(path, "configuration")
    except OSError as error:
        raise ConfigError(f"configuration {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"configuration {path}: it is no TOML: {error}") from error
