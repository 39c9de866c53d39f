"""How a robot is served: from the command line, or from a TOML file."""

import tomllib
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from tvist_plant.description import RobotDescription, load
from tvist_protocol.info import Clock
from tvist_protocol.values import RobotName, Seed
from tvist_server import calibrations
from tvist_server.setup import Setup, paper_payload

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"


class ConfigError(ValueError):
    """A configuration is wrong: one sentence that names the key, the value and what is allowed."""


class ServeConfig(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What `tvist serve` can be told; every key is optional."""

    name: RobotName = "ur5e"
    """Name on the network."""
    robot: str = "ur5e"
    """Robot that comes with the package, or path of a robot file."""
    listen: tuple[str, ...] = (DEFAULT_ENDPOINT,)
    """Zenoh endpoints to listen on."""
    security: str | None = None
    """Folder with certificates and roles, as `tvist keys` makes it; endpoints are then tls/…"""
    insecure: bool = False
    """Let anybody who reaches an endpoint move the robot, on whatever network that is."""
    payload: Annotated[float, Meta(ge=0, le=100)] | None = None
    """Mass of the paper's disc, declared and carried [kg]; default: the robot file's payload."""
    shaper: str = "zv"
    """Shaper to start with."""
    calibration: str | None = calibrations.DEFAULT
    """Calibration that comes with the package, or path of one; "none": a robot still to be identified."""
    clock: Clock = "realtime"
    """Who lets time pass."""
    speed: Annotated[float, Meta(gt=0, le=100)] = 1.0
    """Of the robot's time against the clock's; real time only [-]."""
    start: str | tuple[float, ...] = "Q1"
    """A pose of the robot file, or joint angles [rad]."""
    seed: Seed = 0
    """Of sensor noise and gear errors."""
    record: str | None = None
    """MCAP file to record into."""
    truth: bool = False
    """Tell what no robot can know, too."""

    def setup(self) -> Setup:
        """The controller's start.

        Raises:
            ConfigError: A value does not fit the others, or names something that is not there.
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
                shaper=self.shaper,
                seed=self.seed,
                clock=self.clock,
                truth=self.truth,
            )
            setup.check()
        except ValueError as error:
            raise ConfigError(str(error)) from error
        if calibration is not None and calibration.robot != description.robot.model:
            raise ConfigError(
                f"calibration {calibration.name!r} is of a {calibration.robot}; the robot is a "
                f"{description.robot.model}: name another one, or none"
            )
        return setup

    def _start(self, description: RobotDescription) -> tuple[float, ...]:
        if not isinstance(self.start, str):
            return self.start
        if self.start in description.poses:
            return description.poses[self.start]
        try:
            return tuple(float(angle) for angle in self.start.split(","))
        except ValueError:
            known = ", ".join(description.poses)
            why = f"start is {self.start!r}: must be one of {known}, or angles with commas"
            raise ConfigError(why) from None


def from_mapping(content: object, source: str) -> ServeConfig:
    """Check values by name.

    Raises:
        ConfigError: A key is unknown or a value out of range.
    """
    try:
        return msgspec.convert(content, ServeConfig)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{source}: {error}") from error


def read_toml(path: str) -> dict[str, object]:
    """Content of a configuration file, not yet checked.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"configuration {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"configuration {path}: {error}") from error
