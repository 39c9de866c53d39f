"""Options of `tvist study` about what a study that comes with the package is made of."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from tvist_cli.offered import COMPARED, PLANTS, ROBOTS

SEVERAL = Parameter(consume_multiple=1)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """What a study that comes with the package is made of; a file says it itself."""

    moves: str = "60"
    """Number of random moves: over the workspace, 30 to 100 % of the way between two configurations, free
    of collisions. Or a JSON file with a list of maps with start and target, one angle per joint, and
    optionally payload in kg."""
    shapers: Annotated[list[str] | None, COMPARED, SEVERAL] = None
    """Names that tvist shapers lists, or of simpler methods such as fixed_ei2; FILE.py:NAME, which runs that file,
    for a shaper of your own; or FILE.py with a class that has step(q_ref, info) -> q_star, and optionally
    reset(q) and delay in s [moves: zv; bench and robustness: those of the documentation's page]."""
    baselines: bool = False
    """Not with match: make the moves by the study's baselines, too, as it does if no shapers are named."""
    plants: Annotated[list[str] | None, PLANTS, SEVERAL] = None
    """With moves and match, arms with something that the controller does not know, such as stribeck,
    hysteresis, torsion, base, backlash, combined, springs-30 or springs+30 [moves: the arm as described;
    match: these]."""
    hidden: Annotated[list[int] | None, SEVERAL] = None
    """Seeds of hidden robots, each of which is one more arm: its springs, dampers, loops, rotors, friction
    and payload are drawn from its seed."""
    payload: Annotated[list[float] | None, SEVERAL] = None
    """Mass of the disc on the flange in kg, both carried and declared; of two, each move has one between them
    [0 and the arm's rating]."""
    robot: Annotated[str, ROBOTS] = "ur5e"
    """Name of a robot that comes with the package, or path of a robot file; with bench, if it is not ur5e,
    the two arms whose motors stick are left out."""
    calibration: str | None = None
    """Name of a calibration that comes with the package, or path of a calibration file [that of the robot;
    with moves, for shapers of a single mode, the one that the paper's method made]."""
    modes: int = 1
    """With moves and match, number of modes that shapers of impulses suppress; more than one needs a modal
    calibration."""
    seed: int = 0
    """Seed of moves, payloads, gear errors and what plants draw."""
    limits: Literal["gentle", "industrial"] = "gentle"
    """With moves and match: gentle for the paper's limits, 1.5 rad/s, 2 rad/s² and 100 rad/s³; or
    industrial for 3 rad/s, 8 rad/s² and 2000 rad/s³. Moves for which the drives are too weak are left
    out."""
    stroke: tuple[float, float] | None = None
    """Smallest and largest length of random moves, as a share of the way between two configurations [0.3
    1]."""
    wrists: bool = False
    """Let random moves turn the two outer wrist joints as well."""
    streams: bool = False
    """With moves, follow a stream of set-points from the start of each, which turns to other targets on the
    way and is then stopped, instead of making the move."""
    clean: bool = False
    """Simulate without nonlinear friction, gear errors and noise."""
    disturbances: str | None = None
    """Disturbances to simulate, separated by commas: friction, gear, noise, or none [all]."""
    frequency_error: float = 0.0
    """With moves, percentage by which the controller overestimates every frequency."""
    payload_error: float = 0.0
    """With moves, percentage by which the declared mass exceeds the carried one."""
    stiffness_error: float = 0.0
    """With moves, percentage by which each gear, link and velocity loop of one more arm is stiffer or
    softer, at random, than the controller knows."""
    quick: bool = False
    """With bench, make each move with one payload error only, in turn."""
    save_moves: Path | None = None
    """File to write the moves and their payloads to."""

    @property
    def given(self) -> dict[str, Any]:
        """Those that differ from their defaults, by name."""
        every = {one: getattr(self, one.name) for one in fields(self)}
        return {one.name: value for one, value in every.items() if value != one.default}


AS_SHIPPED = StudyOptions()
"""Nothing was asked for."""
