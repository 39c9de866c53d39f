"""The initial state of a robot, read from a file with the fields of `simulation.reset`."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from tvist_controller.setup import Setup
from tvist_controller.sources import calibrations
from tvist_controller.sources.own_files import is_file
from tvist_controller.sources.own_shapers import check_for, load_own
from tvist_plant.description import RobotDescription
from tvist_plant.user_file import read_bytes, read_toml
from tvist_protocol.calibration import Calibration
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Joints, Payload, ResetMode, Seed
from tvist_shaping import FirShaper

ShaperChoice = Annotated[str, Meta(min_length=1, max_length=4096)]


class InitialState(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Initial state of a robot; a field that is None keeps the value of the `Setup`."""

    q: Joints | None = None
    """Joint angles at which the arm rests [rad]."""
    seed: Seed | None = None
    """Seed of sensor noise and gear errors."""
    payload: Payload | None = None
    """Payload that the arm carries, independent of the declared one."""
    mode: ResetMode | None = None
    """Robot mode."""
    shaper: ShaperChoice | None = None
    """Name of the shaper, or FILE.py:NAME."""

    def on(self, setup: Setup) -> Setup:
        """Return a setup with the fields of this state that are not None.

        Raises:
            OwnFileError: The file that `shaper` names contains no such shaper.
            UserFileError: `shaper` names something that is not a text file, or too large.
        """
        if self.shaper is not None:
            setup = shaped_by(setup, self.shaper)
        given: dict[str, Any] = {
            "q": self.q,
            "seed": self.seed,
            "carried": self.payload,
            "mode": self.mode,
        }
        return replace(setup, **{name: value for name, value in given.items() if value is not None})


def shaped_by(setup: Setup, shaper: str) -> Setup:
    """Return a setup with another shaper.

    Args:
        setup: Setup to change.
        shaper: Name of a shaper, or FILE.py:NAME, which is then loaded.

    Raises:
        OwnFileError: The file contains no such shaper, or it fails for this arm's modes.
        UserFileError: FILE.py is not a text file, or too large.
    """
    if not is_file(shaper):
        return replace(setup, shaper=shaper)
    own = load_own(shaper)
    modes = own.shaper.modes if isinstance(own.shaper, FirShaper) else 1
    if modes <= (source := setup.source()).most:  # else it is refused where a filter is made
        check_for(own, source.estimator(modes, setup.payload), setup.description.joints)
    known = setup.own_shapers if own in setup.own_shapers else (*setup.own_shapers, own)
    return replace(setup, shaper=own.name, own_shapers=known)


class InitialStateError(ValueError):
    """A file contains no valid initial state; the message says why."""


def read_state(path: str) -> InitialState:
    """Read a state from a TOML file, or from a JSON file if its name ends in .json.

    Raises:
        InitialStateError: The file cannot be read, or a field is unknown or out of range.
        UserFileError: The file is not text, too large or nested too deeply.
    """
    try:
        is_json = Path(path).suffix == ".json"
        content = parse_json(read_bytes(path, "state")) if is_json else read_toml(path, "state")
        return checked(content, InitialState)
    except OSError as error:
        raise InitialStateError(f"state {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise InitialStateError(f"state {path}: it is not valid TOML: {error}") from error
    except ProtocolError as error:
        raise InitialStateError(f"state {path}: {error.why}") from error


def calibration_for(name: str | None, description: RobotDescription) -> Calibration | None:
    """Load a calibration.

    Args:
        name: Name of one that comes with the package, a file that `tvist identify` made, or `none`; None for the one
            that comes with the package for this model.
        description: The robot.

    Raises:
        ValueError: There is none, or it is for another robot.
    """
    model = description.robot.model
    name = calibrations.default_for(model) if name is None else name
    if name is None:
        raise ValueError(
            f"no calibration for a {model} comes with the package: give one that tvist identify made, or none"
        )
    if name == "none":
        return None
    found = calibrations.load(name)
    if found.robot != model:
        raise ValueError(
            f"calibration {found.name!r} is for a {found.robot}, but the robot is a {model}: give another "
            "calibration, or none"
        )
    return found


def posture(start: str | tuple[float, ...], description: RobotDescription) -> tuple[float, ...]:
    """Return the joint angles of a pose's name, or of angles separated by commas [rad].

    Raises:
        ValueError: It is neither.
    """
    if not isinstance(start, str):
        return start
    for name, pose in description.poses.items():
        if name.lower() == start.strip().lower():
            return pose
    try:
        return tuple(float(angle) for angle in start.split(","))
    except ValueError:
        known = ", ".join(description.poses)
        raise ValueError(
            f"start is {start.strip()!r}: must be one of {known}, or angles separated by commas"
        ) from None


def numbers_of(name: str, given: str | tuple[float, ...], count: int) -> tuple[float, ...]:
    """Return the numbers of an option, given as such or separated by commas.

    Raises:
        ValueError: They are not as many, or not finite.
    """
    try:
        numbers = tuple(map(float, given.split(",") if isinstance(given, str) else given))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} is {given!r}: must be {count} numbers, separated by commas")
    return numbers
