"""Configuration of `tvist serve`, from the command line or a TOML file."""

import dataclasses
import ipaddress
import tomllib
from pathlib import Path
from typing import Annotated, TypeVar

from msgspec import Meta, Struct
from msgspec.structs import replace

from tvist_controller import calibrations
from tvist_controller.setup import Setup, check_rating, paper_payload
from tvist_plant import user_file
from tvist_plant.description import RobotDescription, load
from tvist_protocol.calibration import Calibration
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Clock
from tvist_protocol.values import Namespace, RobotName, Seed
from tvist_server.allowed_hosts import AllowedHosts
from tvist_server.durations import ticks_of
from tvist_server.fleet import MOST, members
from tvist_server.initial import read_state, shaped_by
from tvist_server.profiles import PLAIN, PROFILES, Profile, ProfileName
from tvist_server.program_folder import ProgramFolder
from tvist_server.temporary import temporary_folder
from tvist_server.ur_ports import InterfaceName, UrPorts

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_NAME = "ur5e"
T = TypeVar("T")
_INSTEAD = {
    "name": "leave name out, since several robots are named after their files",
    "robot": "add it to the list of robots",
}
"""What to do with a key that excludes `robots`."""


class ConfigError(ValueError):
    """A configuration is invalid; the message names the key, the value and what is allowed."""


class ServeConfig(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of `tvist serve`; every key is optional. What is None depends on the profile, if not stated otherwise."""

    name: RobotName = DEFAULT_NAME
    """Name of the robot on the network."""
    robot: str = "ur5e"
    """Name of a robot that comes with the package, or path of a robot file."""
    robots: str | None = None
    """Several robots, ROBOT[*COUNT] separated by commas and named after their files; replaces `name` and `robot`."""
    workers: Annotated[int, Meta(ge=1, le=256)] = 1
    """Number of processes that the robots are spread over."""
    listen: tuple[str, ...] | None = None
    """Zenoh endpoints to listen on; default: `DEFAULT_ENDPOINT`, and none with `connect`."""
    connect: tuple[str, ...] = ()
    """Zenoh endpoints of routers to connect to; the robot uses the first that answers."""
    namespace: Namespace | None = None
    """Chunks that precede the robot's keys, so that robots of several places can share a network."""
    metrics: str | None = None
    """ADDRESS:PORT to publish figures for Prometheus on, or a port of the loopback interface."""
    security: str | None = None
    """Folder with certificates and roles, made by `tvist keys`; endpoints are then tls/… With `connect`, the folder of
    a client with the role robot."""
    insecure: bool = False
    """Accept remote connections without TLS and do not authenticate clients; anyone can move the robot."""
    profile: ProfileName | None = None
    """Set of defaults: `ursim` is like UR's simulator, `real` like a robot; default: `ursim` with `ur`, else none."""
    payload: Annotated[float, Meta(ge=0, le=100)] | None = None
    """Mass of the disc on the flange, both declared and carried [kg]."""
    overload: bool = False
    """Start even if the declared payload exceeds the robot's rating."""
    shaper: str | None = None
    """Initial shaper: its name, or FILE.py:NAME for your own."""
    shape_servo: bool = False
    """Shape `servoj`, `speedj` and `speedl` of programs where they begin at rest."""
    calibration: str | None = None
    """Name of a calibration that comes with the package, path of one, or "none"; default: the package's, if any."""
    clock: Clock = "realtime"
    """What advances simulation time."""
    speed: Annotated[float, Meta(gt=0, le=100)] = 1.0
    """Simulation speed relative to real time [-]; only with the clock realtime."""
    realtime_priority: bool = False
    """Run the control loop with real-time priority, if the system permits it; only with the clock realtime."""
    processor: Annotated[int, Meta(ge=0, le=4095)] | None = None
    """Processor for the control loop, and for no other thread of the server; only with the clock realtime."""
    lock_memory: bool = False
    """Keep the server's memory from being swapped out, if the system permits it."""
    start: str | tuple[float, ...] | None = None
    """Initial pose: a name from the robot file, or joint angles [rad]."""
    state: str | None = None
    """TOML or JSON file with the initial state: any of q, payload (the carried one), mode, shaper, seed."""
    seed: Seed = 0
    """Seed of sensor noise and gear errors; with several robots, each further one adds 1."""
    record: str | None = None
    """MCAP file to record into; with several robots, each has a file of its own that ends with its name."""
    keep: str | None = None
    """Duration that the recording keeps at least, such as "10min"; it forgets what was before. Default: all of it."""
    dump: str | None = None
    """Folder to save the last second before a failure of the simulated arm to. Default: the system's temporary one."""
    truth: bool = False
    """Publish what a real robot cannot measure, too."""
    quiet: bool | None = None
    """Simulate sensors without noise and angles with an encoder's resolution: at rest, no value changes."""
    floor: bool | None = None
    """Keep the arm clear of the floor of the robot file; false: there is no floor."""
    compensate_sag: bool | None = None
    """Let the drives lead by the twist of the gears under gravity, so that the arm rests on its target."""
    programs: str | None = None
    """Folder with programs that clients load by their names; a robot may have a folder of its name in it."""
    ur: bool = False
    """Open UR's own interfaces, too."""
    ur_address: str = "127.0.0.1"
    """IP address on which UR's interfaces listen; each further robot uses the next address."""
    ur_ports: UrPorts = UrPorts()
    """Ports of UR's interfaces that differ from UR's defaults; 0 closes an interface."""
    ur_allow: tuple[str, ...] = ()
    """Machines that programs may open sockets to, besides the one that sent them: IP addresses, networks, names."""

    def setups(self) -> list[Setup]:
        """Return the initial setup of every robot's controller.

        Raises:
            ConfigError: See `setup`.
            UserFileError: See `setup`.
        """
        if self.robots is None:
            return [self.setup()]
        try:
            found = members(self.robots, MOST * self.workers)
        except ValueError as error:
            raise ConfigError(str(error)) from error
        # Each robot starts as it would alone, apart from the noise.
        starts: dict[str, Setup] = {}
        for member in found:
            if member.robot not in starts:
                starts[member.robot] = replace(self, robot=member.robot).setup()
        return [
            dataclasses.replace(starts[member.robot], name=member.name, seed=self.seed + index)
            for index, member in enumerate(found)
        ]

    def program_folder(self, name: str) -> ProgramFolder | None:
        """Return the folder with a robot's programs; None if there is none.

        Raises:
            ConfigError: `programs` is not a folder.
        """
        if self.programs is None:
            return None
        if not Path(self.programs).is_dir():
            raise ConfigError(f"programs is {self.programs!r}: must be a folder that exists")
        return ProgramFolder.of(Path(self.programs), name)

    def dump_folder(self) -> Path:
        """Return the folder for the last second before a failure.

        Raises:
            ConfigError: `dump` is not a folder, so that this second would be lost.
        """
        if self.dump is None:
            return temporary_folder()
        if not Path(self.dump).is_dir():
            raise ConfigError(f"dump is {self.dump!r}: must be a folder that exists")
        return Path(self.dump)

    def keep_ticks(self) -> int | None:
        """Return the number of ticks that a recording keeps at least; None if it keeps all.

        Raises:
            ConfigError: `keep` is no duration, or nothing is recorded.
        """
        if self.keep is None:
            return None
        if self.record is None:
            raise ConfigError(f"keep is {self.keep}, but nothing is recorded: give record, too")
        try:
            return ticks_of(self.keep, "keep")
        except ValueError as error:
            raise ConfigError(str(error)) from error

    def allowed_hosts(self) -> AllowedHosts:
        """Return the machines that programs may connect to.

        Raises:
            ConfigError: `ur_allow` has what names no machine.
        """
        try:
            return AllowedHosts(self.ur_allow)
        except ValueError as error:
            raise ConfigError(str(error)) from error

    def interfaces(self, number: int) -> tuple[str, dict[InterfaceName, int]]:
        """Return the address of a robot's UR interfaces, and the port of each.

        Args:
            number: Index of the robot, 0 for the first.

        Raises:
            ConfigError: `ur_address` is not an IP address, or too few addresses follow it.
        """
        try:
            first = ipaddress.ip_address(self.ur_address)
            address = first + number
        except ValueError as error:
            raise ConfigError(
                f"ur_address is {self.ur_address!r}: must be an IP address ({error})"
            ) from error
        if number and first.is_unspecified:
            raise ConfigError(f"ur_address is {self.ur_address}: several robots need one address each")
        return str(address), self.ur_ports.open()

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Endpoints to listen on."""
        return (() if self.connect else (DEFAULT_ENDPOINT,)) if self.listen is None else self.listen

    @property
    def place(self) -> str:
        """The place at which clients reach the robots, in words."""
        places = [f"on {', '.join(self.endpoints)}"] if self.endpoints else []
        places += [f"through the router at {', '.join(self.connect)}"] if self.connect else []
        return " and ".join(places) + (f" in namespace {self.namespace}" if self.namespace else "")

    def command_line(self, command: str, name: str) -> str:
        """Return the command line that reaches a robot from this machine.

        Args:
            command: Name of the command, such as `unlock`.
            name: Name of the robot.
        """
        words = ["tvist", command]
        first = (*self.endpoints, *self.connect)[0]
        if first != DEFAULT_ENDPOINT:
            here = first.replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")  # noqa: S104  only said
            words.append(here)
        words += ["--name", name] if name != DEFAULT_NAME else []
        words += ["--namespace", self.namespace] if self.namespace else []
        return " ".join([*words, "--security", "FOLDER"] if self.security is not None else words)

    def setup(self) -> Setup:
        """Return the initial setup of one robot's controller.

        Raises:
            ConfigError: A value contradicts another one, or names something that does not exist.
            UserFileError: A file that is named has the wrong kind of content.
        """
        try:
            chosen, description = self.profile_in_force, load(self.robot)
            profile = PLAIN if chosen is None else PROFILES[chosen]
            calibration = self._calibration(description.robot.model)
            setup = Setup(
                description=self._described(description, profile),
                q=self._start(description, profile),
                payload=paper_payload(description, _either(self.payload, profile.payload)),
                calibration=calibration,
                name=self.name,
                seed=self.seed,
                clock=self.clock,
                truth=self.truth,
                compensate_sag=_either(self.compensate_sag, profile.compensate_sag),
                shape_servo=self.shape_servo,
            )
            setup = shaped_by(setup, _either(self.shaper, profile.shaper))
            if self.state is not None:
                setup = read_state(self.state).on(setup)
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
                f"calibration {calibration.name!r} is for a {calibration.robot}, but the robot is a "
                f"{description.robot.model}: give another calibration, or none"
            )
        return setup

    @property
    def profile_in_force(self) -> ProfileName | None:
        """Profile that gives the defaults; None for those of a robot without a profile."""
        return self.profile or ("ursim" if self.ur else None)

    def _described(self, description: RobotDescription, profile: Profile) -> RobotDescription:
        """Return the robot with the sensors and the floor that it is to have."""
        if _either(self.quiet, profile.quiet):
            description = description.quiet()
        return description if _either(self.floor, profile.floor) else description.without_floor()

    def _calibration(self, model: str) -> Calibration | None:
        """Load the calibration that is named or, if none is, the one that comes with the package for this model."""
        name = calibrations.default_for(model) if self.calibration is None else self.calibration
        if name is None:
            raise ConfigError(
                f"no calibration for a {model} comes with the package: give one that tvist identify made, or none"
            )
        return None if name == "none" else calibrations.load(name)

    def _start(self, description: RobotDescription, profile: Profile) -> tuple[float, ...]:
        start = _either(self.start, profile.start(description) or "Q1")
        if not isinstance(start, str):
            return start
        for name, pose in description.poses.items():
            if name.lower() == start.strip().lower():
                return pose
        try:
            return tuple(float(angle) for angle in start.split(","))
        except ValueError:
            known = ", ".join(description.poses)
            why = f"start is {start.strip()!r}: must be one of {known}, or angles separated by commas"
            raise ConfigError(why) from None


def _either(given: T | None, default: T) -> T:
    """Return what is given, or else the default."""
    return default if given is None else given


def from_mapping(content: object, source: str) -> ServeConfig:
    """Check a mapping of values and convert it.

    Raises:
        ConfigError: A key is unknown, a value is out of range, or one key excludes another.
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
    """Return the unchecked content of a configuration file.

    Raises:
        ConfigError: The file cannot be read, or is not TOML.
        UserFileError: The file is not text, too large or nested too deeply.
    """
    try:
        return user_file.read_toml(path, "configuration")
    except OSError as error:
        raise ConfigError(f"configuration {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"configuration {path}: it is not valid TOML: {error}") from error
