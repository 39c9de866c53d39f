"""Loads the files that a robot starts with: cells, states, shapers and calibrations."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from tvist_controller.cell.description import Cell
from tvist_controller.setup import Setup
from tvist_controller.sources import calibrations
from tvist_controller.sources.own_files import is_file
from tvist_controller.sources.own_shapers import check_for, load_own
from tvist_plant.description import RobotDescription
from tvist_plant.world.scene_file import scenes
from tvist_protocol.calibration import Calibration
from tvist_protocol.values import Joints, Payload, ResetMode, Seed
from tvist_server.option_values import StartError, read_start_file
from tvist_shaping import FirShaper


def read_cell(path: str) -> Cell:
    """Read a cell. Its scene is the name of one of the package's scenes, or a file in the cell's folder."""
    cell = read_start_file(path, "cell", Cell)
    if cell.world is not None and cell.world not in scenes():
        cell = msgspec.structs.replace(cell, world=str(Path(path).parent / cell.world))
    try:
        cell.check()
    except ValueError as error:
        raise StartError(f"cell {path}: {error}") from error
    return cell


class InitialState(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Content of a state file, the fields of `simulation.reset`; None keeps the value of the `Setup`."""

    q: Joints | None = None  # joint angles at which the arm rests [rad]
    seed: Seed | None = None  # seed of sensor noise and gear errors
    payload: Payload | None = None  # payload that the arm carries, independent of the declared one
    mode: ResetMode | None = None  # robot mode
    shaper: Annotated[str, Meta(min_length=1, max_length=4096)] | None = None  # name or FILE.py:NAME

    def on(self, setup: Setup) -> Setup:
        """Return a setup with the fields of this state that are not None."""
        if self.shaper is not None:
            setup = with_shaper(setup, self.shaper)
        own = {"q": self.q, "seed": self.seed, "carried": self.payload, "mode": self.mode}
        given: dict[str, Any] = {name: value for name, value in own.items() if value is not None}
        return replace(setup, **given)


def with_shaper(setup: Setup, shaper: str) -> Setup:
    """Return a setup with another shaper, by name or FILE.py:NAME; OwnFileError or UserFileError if that fails."""
    if not is_file(shaper):
        return replace(setup, shaper=shaper)
    own = load_own(shaper)
    modes = own.shaper.modes if isinstance(own.shaper, FirShaper) else 1
    if modes <= (source := setup.source()).most:  # otherwise creating the filter reports the error
        check_for(own, source.estimator(modes, setup.payload), setup.description.joints)
    known = setup.own_shapers if own in setup.own_shapers else (*setup.own_shapers, own)
    return replace(setup, shaper=own.name, own_shapers=known)


def calibration_for(name: str | None, description: RobotDescription) -> Calibration | None:
    """Load a calibration by name in the package, a path, or `none`; None: the package's for this model."""
    model = description.robot.model
    name = calibrations.default_for(model) if name is None else name
    if name is None:
        raise StartError(
            f"no calibration for a {model} comes with the package: give one that tvist identify made, or none"
        )
    if name == "none":
        return None
    found = calibrations.load(name)
    if found.robot != model:
        raise StartError(
            f"calibration {found.name!r} is for a {found.robot}, but the robot is a {model}: give another "
            "calibration, or none"
        )
    return found
