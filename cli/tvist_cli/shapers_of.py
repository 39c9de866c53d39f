"""Load shapers that a command line names, or gives as FILE.py:NAME, and the calibrations that they need."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told

if TYPE_CHECKING:
    from tvist_controller.sources.own_shapers import OwnShaper
    from tvist_lab.study.method import Method
    from tvist_plant.description import RobotDescription
    from tvist_protocol.calibration import Calibration
    from tvist_shaping import Shaper


@contextmanager
def designing(code: int = 2) -> Iterator[None]:
    """Tell why a shaper cannot be made of a calibration for an arm."""
    from tvist_controller.refusal import RefusalError
    from tvist_lab.study.recipes import RecipeError
    from tvist_shaping.errors import ShapingError

    with told(RecipeError, RefusalError, ShapingError, code=code):
        yield


def loaded(shaper: str) -> "tuple[str, tuple[OwnShaper, ...]]":
    """Return the name of a shaper, and the shaper loaded from its file, if any.

    Args:
        shaper: A name in any case, or FILE.py:NAME.

    Raises:
        Failure: The file contains no such shaper.
    """
    from tvist_controller.sources.own_files import is_file

    if not is_file(shaper):
        return shaper.lower(), ()
    own = load_given(shaper)
    return own.name, (own,)


def load_given(place: str) -> "OwnShaper":
    """Load the shaper of FILE.py:NAME.

    Raises:
        Failure: The file contains no such shaper, or no file is named.
    """
    from tvist_controller.sources.own_files import OwnFileError
    from tvist_controller.sources.own_shapers import load_own

    with told(OwnFileError, code=2):
        return load_own(place)


def of_impulses(shaper: str) -> "Shaper":
    """Return the shaper of a name or of FILE.py:NAME; only those with impulses have a delay for each mode.

    Raises:
        Failure: There is no such shaper, or it is none of impulses.
    """
    from tvist_shaping import SHAPERS, Shaper

    name, own = loaded(shaper)
    found = own[0].shaper if own else SHAPERS.get(name)
    if not isinstance(found, Shaper):
        if own:
            raise Failure(f"shaper {shaper} has no impulses of one mode: give one that has", code=2)
        raise Failure(f"shaper is {name!r}: must be FILE.py:NAME or one of {', '.join(SHAPERS)}", code=2)
    return found


def calibration_for(
    name: str | None,
    shaper: str,
    own: "tuple[OwnShaper, ...]",
    modes: int,
    description: "RobotDescription",
) -> "Calibration | None":
    """Return the calibration that was named, or the one of this robot: for several modes, a modal one.

    Args:
        name: Name of a calibration that comes with the package, or path of a calibration file; None for the robot's.
        shaper: Name of the shaper.
        own: Shapers from files.
        modes: Number of modes that are asked for.
        description: The robot.

    Raises:
        Failure: There is no such calibration or shaper.
    """
    from tvist_controller.planning.filter_planner import wanted_modes
    from tvist_controller.refusal import RefusalError
    from tvist_controller.sources.calibrations import default_for, load
    from tvist_controller.sources.mode_source import modal_source
    from tvist_protocol.calibration import CalibrationError
    from tvist_shaping import Registry

    with told(CalibrationError, RefusalError, code=2):
        known = Registry(one.shaper for one in own)
        several = wanted_modes(shaper, modes, "shaper", known) > 1
        several = several or known.feed_forward_of(shaper) != "rigid"
        if name is not None:
            return load(name)
        default = default_for(description.robot.model)
        if default is None:
            return None
        calibration = load(default)
        found = modal_source(description, calibration) if several else None
        return calibration if found is None else found.calibration


def calibration_of(name: str) -> "Calibration":
    """Return the calibration of a name or a file.

    Raises:
        Failure: There is no such calibration.
    """
    from tvist_controller.sources.calibrations import load
    from tvist_protocol.calibration import CalibrationError

    with told(CalibrationError, code=2):
        return load(name)


def modal_calibration(name: str) -> "Calibration":
    """Return a calibration with a modal model.

    Raises:
        Failure: There is no such calibration, or it has no modal model.
    """
    known = calibration_of(name)
    if known.modal is None:
        raise Failure(f"calibration {known.name} has no modal model: make one with tvist identify", code=2)
    return known


def modal_for(name: str | None, robot: str) -> "tuple[RobotDescription, Calibration]":
    """Return a robot, and a calibration with a modal model: the one that was named, or the robot's own.

    Args:
        name: Name of a calibration that comes with the package, or path of a calibration file; None for the robot's.
        robot: Name of a robot that comes with the package, or path of a robot file.

    Raises:
        Failure: There is no such robot or calibration.
    """
    from tvist_plant.description import DescriptionError, load

    with told(DescriptionError, code=2):
        description = load(robot)
    return description, own_modal(description) if name is None else modal_calibration(name)


def own_modal(description: "RobotDescription") -> "Calibration":
    """Return the modal calibration that comes with the package for a robot.

    Raises:
        Failure: There is none.
    """
    own = calibration_for(None, "elastic", (), 1, description)
    if own is None:
        model = description.robot.model
        raise Failure(f"the package has no calibration of a {model}: give --calibration FILE", code=2)
    return own


def on_the_bench(
    description: "RobotDescription",
    known: "Calibration",
    against: list[str] | None,
    mine: "str | OwnShaper | None" = None,
) -> "list[Method]":
    """Return waiting, and the methods to compare; see `tvist_lab.study.catalogue.bench`.

    Raises:
        Failure: There is no shaper of a name.
    """
    from tvist_lab.study.catalogue import bench

    with designing():
        try:
            return bench(description, known, mine, against)
        except KeyError as error:
            raise Failure(f"against: {error.args[0]}", code=2) from None
