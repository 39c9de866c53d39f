"""Configuration of `tvist serve`, from the command line or a TOML file."""

import dataclasses
import ipaddress
import tempfile
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from tvist_controller.cell.description import Cell, as_declared
from tvist_controller.setup import Setup, check_rating, paper_payload
from tvist_controller.sources.own_plants import OwnPlant, load_plant, load_world
from tvist_plant import user_file
from tvist_plant.description import RobotDescription, load
from tvist_protocol.calibration import Calibration
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Payload
from tvist_server.moving.moved_robot import MovedRobot
from tvist_server.moving.servo_lag import ServoLag
from tvist_server.option_values import (
    MAX_ROBOTS,
    StartError,
    numbers_of,
    posture,
    read_start_file,
    robots_in,
    ticks_of,
)
from tvist_server.options import DEFAULT_NAME, ProfileName, ServeOptions
from tvist_server.profiles import PROFILES, Profile
from tvist_server.program_folder import ProgramFolder
from tvist_server.start_files import InitialState, calibration_for, read_cell, with_shaper
from tvist_server.ur_ports import InterfaceName
from tvist_server.watching.address import is_place, place_of
from tvist_server.watching.watched_robot import WatchedRobot

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
SPEED_CAP = 0.5  # default speed limit of a real robot that tvist moves [rad/s]
TOOL_IN_WORLD = 1.0
"""Default mass on the flange in a scene [kg]; with no mass, the sensor would not measure wrist contacts."""
_REAL = ("enable_motion", "speed_cap", "tcp", "servo_lag")
MOST_LAG, LEAST_GAIN = 0.15, 50.0
"""Largest lag [s] and smallest gain [1/s²] of a `servoj` that can be compensated."""
_INSTEAD = {
    "name": "leave name out, since several robots are named after their files",
    "robot": "add it to the list of robots",
}
"""Advice for a key that excludes `robots`."""
T = TypeVar("T")


class ServeConfig(ServeOptions, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of a server; the methods return the setups, folders and endpoints that follow from them."""

    def setups(self) -> list[Setup]:
        """Return the initial setup of every robot's controller; raises as `setup` does."""
        if self.robots is None:
            return [self.setup()]
        found = robots_in(self.robots, MAX_ROBOTS * self.workers)
        # Robots of the same file differ only in name and noise.
        starts: dict[str, Setup] = {}
        for robot, _ in found:
            if robot not in starts:
                starts[robot] = replace(self, robot=robot).setup()
        return [
            dataclasses.replace(
                starts[robot],
                name=name,
                seed=self.seed + index,
                hidden=None if self.hidden is None else self.hidden + index,
            )
            for index, (robot, name) in enumerate(found)
        ]

    def program_folder(self, name: str) -> ProgramFolder:
        """Return the folder of a robot's programs; raise StartError if it is not a folder."""
        if self.programs is None:
            return ProgramFolder()
        return ProgramFolder.of(_folder("programs", self.programs), name)

    def dump_folder(self) -> Path:
        """Return the folder for records of the last second before failures; StartError if it is no folder."""
        if self.dump is not None:
            return _folder("dump", self.dump)
        try:
            return Path(tempfile.gettempdir())
        except FileNotFoundError:  # a container may have no such folder; saving then fails with a message
            return Path.cwd()

    def keep_ticks(self) -> int | None:
        """Return the least number of ticks to keep in the recording (None: all); StartError if `keep` is invalid."""
        if self.keep is None:
            return None
        if self.record is None:
            raise StartError(f"keep is {self.keep}, but nothing is recorded: give record, too")
        return ticks_of(self.keep, "keep")

    def interfaces(self, number: int) -> tuple[str, dict[InterfaceName, int]]:
        """Return address and ports of robot `number`'s UR interfaces; StartError for an invalid address."""
        try:
            first = ipaddress.ip_address(self.ur_address)
            address = first + number
        except ValueError as error:
            raise StartError(f"ur_address is {self.ur_address!r}: must be an IP address ({error})") from error
        if number and first.is_unspecified:
            raise StartError(
                f"ur_address is {self.ur_address}, but several robots need one address each: give the first"
            )
        ports = self.ur_ports.open()
        if self.cell is not None and self.ur_ports.gripper:
            ports["gripper"] = self.ur_ports.gripper
        return str(address), ports

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Endpoints to listen on: `listen`, or the default one; without `listen`, none if `connect` is given."""
        return (() if self.connect else (DEFAULT_ENDPOINT,)) if self.listen is None else self.listen

    @property
    def place(self) -> str:
        """Where clients reach the robots, for messages."""
        places = [f"on {', '.join(self.endpoints)}"] if self.endpoints else []
        places += [f"through the router at {', '.join(self.connect)}"] if self.connect else []
        return " and ".join(places) + (f" in namespace {self.namespace}" if self.namespace else "")

    @property
    def reached(self) -> str:
        """Endpoint at which clients on this machine reach the robots."""
        first = (*self.endpoints, *self.connect)[0]
        return first.replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")  # noqa: S104  listens nowhere: clients cannot connect to it

    def command_line(self, command: str, name: str) -> str:
        """Return the command line that runs `command` for a robot from this machine."""
        words = ["tvist", command]
        words += [self.reached] if self.reached != DEFAULT_ENDPOINT else []
        words += ["--name", name] if name != DEFAULT_NAME else []
        words += ["--namespace", self.namespace] if self.namespace else []
        return " ".join([*words, "--security", "FOLDER"] if self.security is not None else words)

    def setup(self) -> Setup:
        """Return the initial setup of one robot's controller.

        Raises:
            StartError: A value contradicts another one, or names something that does not exist.
            UserFileError: A named file has the wrong kind of content.
        """
        try:
            chosen, description = self.profile_in_force, load(self.robot)
            if self.ur:
                self.ur_ports.check_joints(description.robot.name, description.joints)
            profile = PROFILES[chosen]
            real = self.plant is not None and is_place(self.plant)
            watched = real and not self.enable_motion
            self._check_real(real=real)
            calibration = calibration_for(self.calibration, description)
            cell = None if self.cell is None else read_cell(self.cell)
            setup = Setup(
                description=self._described(description, profile),
                q=posture(_either(self.start, profile.start(description) or "Q1"), description),
                payload=self._declared(description, profile, cell),
                carried=None if cell is None or not cell.tools else as_declared(cell.tools[0]),
                cell=cell,
                calibration=calibration,
                name=self.name,
                seed=self.seed,
                clock=self.clock,
                truth=self.truth or self._scene(cell) is not None,
                compensate_sag=_either(self.compensate_sag, profile.compensate_sag),
                shape_servo=self.shape_servo,
                adapt=self.adapt,
                plant=self._plant(cell, description, calibration),
                hidden=self.hidden,
            )
            setup = with_shaper(setup, "none" if watched else _either(self.shaper, profile.shaper))
            if self.state is not None:
                setup = read_start_file(self.state, "state", InitialState).on(setup)
            setup.check(placed=not real)
        except user_file.UserFileError:
            raise
        except ValueError as error:
            raise StartError(str(error)) from error
        if not self.overload:
            try:
                check_rating(setup.payload, description)
            except ValueError as error:
                raise StartError(f"{error}: give --overload to insist") from error
        return setup

    def _check_real(self, *, real: bool) -> None:
        """Raise ValueError if an option needs a real UR robot but `real` is False, or the reverse."""
        if not real:
            given = [name for name in _REAL if getattr(self, name)]
            if given:
                raise ValueError(f"{given[0]} needs a real UR robot: also give --plant ur://ADDRESS")
            return
        asked: dict[str, object] = {
            "adapt": self.adapt, "cell": self.cell, "state": self.state, "truth": self.truth or None,
            "robots": self.robots,
        }  # fmt: skip
        what = "is not simulated"
        if not self.enable_motion:
            asked |= {
                "shaper": self.shaper, "start": self.start, "speed_cap": self.speed_cap,
                "tcp": self.tcp, "servo_lag": self.servo_lag, "shape_servo": self.shape_servo or None,
            }  # fmt: skip
            what = "is only watched"
        for name, value in asked.items():
            if value is not None:
                raise ValueError(f"{name} is {value}, but the robot at {self.plant} {what}: leave {name} out")

    def _plant(
        self, cell: Cell | None, description: RobotDescription, calibration: Calibration | None
    ) -> OwnPlant | None:
        """Return the chosen plant or the scene's; None: the simulated arm. ValueError if options conflict."""
        world = self._scene(cell)
        if world is not None:
            if self.plant is not None or self.hidden is not None:
                other = f"hidden is {self.hidden}" if self.plant is None else f"plant is {self.plant}"
                raise ValueError(
                    f"world is {world}, in which MuJoCo simulates the arm, but {other}: leave one out"
                )
            return load_world(world)
        if self.plant is None or not is_place(self.plant):
            return None if self.plant is None else load_plant(self.plant)
        where = place_of(self.plant)
        if not self.enable_motion:
            return OwnPlant(str(where), "", partial(WatchedRobot, where))
        moved = partial(
            MovedRobot,
            where,
            speed_cap=_either(self.speed_cap, SPEED_CAP),
            tool=None if self.tcp is None else numbers_of("tcp", self.tcp, 6),
            lag=self._lag(calibration),
            start=None if self.start is None else posture(self.start, description),
        )
        return OwnPlant(str(where), "", moved)

    def _scene(self, cell: Cell | None) -> str | None:
        """Return the scene around the arm: that of option `world`, or else of the cell; None: no scene."""
        return self.world or (None if cell is None else cell.world)

    def _lag(self, calibration: Calibration | None) -> ServoLag | None:
        """Return the lag of `servoj` from the option, or else the calibration; ValueError if out of range."""
        if self.servo_lag == "simulated":
            return ServoLag.simulated()
        if self.servo_lag is not None:
            time, gain = numbers_of("servo_lag", self.servo_lag, 2)
        elif (
            calibration is not None
            and calibration.servo_lag_s is not None
            and calibration.servo_gain is not None
        ):
            time, gain = calibration.servo_lag_s, calibration.servo_gain
        else:
            return None
        if not (0.0 <= time <= MOST_LAG and gain >= LEAST_GAIN):
            raise ValueError(
                f"servo_lag is {time:g},{gain:g}: must be a time from 0 to {MOST_LAG:g} s and a gain of {LEAST_GAIN:g} "
                "1/s² or more"
            )
        return ServoLag(time, gain)

    @property
    def profile_in_force(self) -> ProfileName | None:
        """Profile that gives the defaults; None: no profile."""
        return self.profile or ("ursim" if self.ur and not self.enable_motion else None)

    def _described(self, description: RobotDescription, profile: Profile) -> RobotDescription:
        """Return the robot's description with the options for sensors and floor applied."""
        if _either(self.quiet, profile.quiet):
            description = description.quiet()
        return description if _either(self.floor, profile.floor) else description.without_floor()

    def _declared(self, description: RobotDescription, profile: Profile, cell: Cell | None) -> Payload:
        """Return the declared payload: from the option `payload`, or else the cell's tool or the profile."""
        if self.payload is None and cell is not None and cell.tools:
            return as_declared(cell.tools[0])
        mass = _either(self.payload, profile.payload)
        if self.payload is None and mass == 0.0 and self._scene(cell) is not None:
            mass = min(TOOL_IN_WORLD, description.limits.payload)
        return paper_payload(description, mass)


def from_mapping(content: object, source: str) -> ServeConfig:
    """Convert a map to a configuration; StartError names `source` and the unknown, invalid or excluded key."""
    if isinstance(content, dict) and content.get("robots") is not None:
        for key, instead in _INSTEAD.items():
            if content.get(key) is not None:
                raise StartError(f"{source}: robots and {key} exclude each other: {instead}")
    try:
        return checked(content, ServeConfig)
    except ProtocolError as error:
        raise StartError(f"{source}: {error.why}") from error


def _folder(name: str, given: str) -> Path:
    if not Path(given).is_dir():
        raise StartError(f"{name} is {given!r}: must be a folder that exists")
    return Path(given)


def _either(given: T | None, default: T) -> T:
    return default if given is None else given
