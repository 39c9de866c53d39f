"""Options of `tvist study` for the studies that come with the package."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from tvist_cli.offered import COMPARED, PLANTS, ROBOTS

SEVERAL = Parameter(consume_multiple=1)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """Content of a study that comes with the package; a file defines its own."""

    moves: str = "60"
    """Make this number of random, collision-free moves over the workspace, each 30 to 100 % of the way
    between two configurations; or read moves from a JSON file: a list of maps with start and target, one
    angle per joint, and optionally payload in kg."""
    shapers: Annotated[list[str] | None, COMPARED, SEVERAL] = None
    """Compare these: names that tvist shapers lists, or of simpler methods such as fixed_ei2; FILE.py:NAME
    for a shaper of your own, which executes that file; or FILE.py with a class that has step(q_ref, info) ->
    q_star, and optionally reset(q) and delay in s [moves: zv; bench and robustness: those of the
    documentation's page]."""
    baselines: bool = False
    """Make the moves with the study's baselines as well, as happens if no shapers are named; not with match."""
    plants: Annotated[list[str] | None, PLANTS, SEVERAL] = None
    """With moves and match, simulate arms with a property that the controller does not know, such as
    stribeck, hysteresis, torsion, base, backlash, combined, springs-30 or springs+30 [moves: the arm as
    described; match: these]."""
    hidden: Annotated[list[int] | None, SEVERAL] = None
    """Add one arm for each of these seeds, from which its springs, dampers, loops, rotors, friction and
    payload are drawn."""
    payload: Annotated[list[float] | None, SEVERAL] = None
    """Carry and declare a disc of this mass on the flange in kg; with two, each move has a mass between them
    [0 and the arm's rating]."""
    robot: Annotated[str, ROBOTS] = "ur5e"
    """Simulate this robot: a name that comes with the package, or the path of a robot file; with bench, if it
    is not ur5e, the two arms whose motors stick are left out."""
    calibration: str | None = None
    """Use this calibration: a name that comes with the package, or the path of a file [that of the robot;
    with moves, for shapers of a single mode, the one made by the paper's method]."""
    modes: int = 1
    """With moves and match, suppress this number of modes with impulse shapers; more than one needs a modal
    calibration."""
    seed: int = 0  # set the seed of moves, payloads, gear errors and random properties of plants
    limits: Literal["gentle", "industrial"] = "gentle"
    """With moves and match, use gentle limits, the paper's 1.5 rad/s, 2 rad/s² and 100 rad/s³; or industrial
    ones, 3 rad/s, 8 rad/s² and 2000 rad/s³. Moves for which the drives are too weak are left out."""
    stroke: tuple[float, float] | None = None
    """Set the smallest and largest length of random moves, as a share of the way between two configurations [0.3 1]."""
    wrists: bool = False  # let random moves turn the two outer wrist joints as well
    streams: bool = False
    """With moves, follow a stream of set-points that turns to other targets on the way and is then stopped,
    instead of making each move."""
    clean: bool = False  # simulate without nonlinear friction, gear errors and noise
    disturbances: str | None = None
    """Simulate these disturbances, separated by commas: friction, gear, noise, or none [all]."""
    frequency_error: float = 0.0
    """With moves, let the controller overestimate every frequency by this percentage."""
    payload_error: float = 0.0  # with moves, let the declared mass exceed the carried one by this percentage
    stiffness_error: float = 0.0
    """With moves, add one arm whose gears, links and velocity loops are each stiffer or softer, at random, by
    this percentage than the controller knows."""
    quick: bool = False  # with bench, make each move with one payload error only, in turn
    save_moves: Path | None = None  # write the moves and their payloads to this file

    @property
    def given(self) -> dict[str, Any]:
        """Return the options that differ from their defaults, by name."""
        every = {one: getattr(self, one.name) for one in fields(self)}
        return {one.name: value for one, value in every.items() if value != one.default}


AS_SHIPPED = StudyOptions()
