"""Input of a study that a user requests: a robot, moves and shapers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tvist_controller.api.line import MotionLimits
from tvist_lab.study.case import Case, arm_seed
from tvist_lab.study.line import PAPER
from tvist_lab.study.method import Method
from tvist_lab.study.method_list import MethodSet
from tvist_lab.study.moves import Move
from tvist_lab.study.study import Study, StudyError
from tvist_plant.description import RobotDescription
from tvist_plant.variants import Variant


@dataclass(frozen=True, kw_only=True)
class StudyRequest:
    """A robot, moves and shapers, all checked."""

    description: RobotDescription  # the arm, which is also the controller's model of it
    moves: Sequence[Move]
    methods: Sequence[Method]  # methods of every study, then named shapers, then baselines
    named: int = 0  # number of methods before the baselines
    arms: Sequence[Variant] = ()  # the named plants
    seed: int = 0  # seed of gear errors and deviations
    limits: MotionLimits = PAPER
    payload_error: float = 0.0  # error of the declared mass, relative to the carried one [-]
    streams: bool = False  # whether to follow streams from the start of each move
    quick: bool = False  # whether a few motions are enough
    facts: Mapping[str, Any] = field(default_factory=dict)  # description of the request for --json
    notes: Sequence[str] = ()  # notes on the moves for the reader
    on: "Callable[[str], StudyRequest | None]" = lambda _: None
    """Returns the same request for another robot of the package; None if the user chose a robot."""

    def feasible(self) -> list[Move]:
        """Return the moves for which the drives are strong enough."""
        if self.streams:
            return list(self.moves)
        return [
            one for one in self.moves if Case(self.description, one, limits=self.limits).torque_share <= 1.0
        ]

    def cases(self, moves: Sequence[Move], arms: Sequence[Variant]) -> list[Case]:
        """Return a numbered case for each move, on some arms."""
        if not moves:
            raise StudyError(
                "no move is within the drives' torque at these limits: lower the limits or the payload"
            )
        return [
            Case(
                self.description, move, arm_seed(self.seed, place), tuple(arms), self.limits, self.payload_error,
                self.streams, axes={"move": place + 1, "payload_kg": move.mass},
            )
            for place, move in enumerate(moves)
        ]  # fmt: skip


@dataclass(frozen=True)
class Preset:
    """A study that comes with the package."""

    study: Callable[[StudyRequest], Study]
    always: tuple[str, ...] = ()
    shapers: tuple[str, ...] = ()  # default shapers
    defaults: MethodSet | None = None  # methods that are compared with the shapers; None if there are none
    options: frozenset[str] = frozenset()  # options of this preset besides those of all presets
    modal: bool = True  # whether each calibration needs a modal model
    least: int = 1
