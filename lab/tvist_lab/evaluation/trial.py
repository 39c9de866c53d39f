"""One move of one arm, made in any number of ways."""

import numpy as np

from tvist_controller.api import ElasticFeedForward, body, paper_payload
from tvist_lab.evaluation.baselines import Baseline
from tvist_lab.evaluation.conditions import AS_KNOWN, Conditions
from tvist_lab.evaluation.line import ControlLine, point_to_point, shape
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.own_moves import own_move
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.sound import Sound
from tvist_lab.evaluation.streams import stopped_stream
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm


class Trial:
    """A move, and the arm that makes it. Each way starts anew from rest, with the same seed.

    Args:
        description: The arm, and the controller's model of it.
        move: The move, with the carried mass.
        seed: Seed of gear errors, and of the arm's deviations.
        conditions: Limits, and what the controller does not know.
        stream: Whether to follow a stream from the move's start that is stopped somewhere, instead of making the move.
    """

    def __init__(
        self,
        description: RobotDescription,
        move: Move,
        seed: int,
        conditions: Conditions = AS_KNOWN,
        *,
        stream: bool = False,
    ) -> None:
        self._description, self._seed, self._stream = description, seed, stream
        self._limits = conditions.limits
        self._move = conditions.declared(move)
        self._start = np.array(move.start)
        carried, declared = (body(paper_payload(description, one.mass)) for one in (move, self._move))
        self._arm = FlexibleArm(conditions.arm(description, seed), carried)
        self._line = ControlLine(description, self._start, declared)
        if stream:
            self._reference = stopped_stream(description, self._start, seed, self._limits)
        else:
            self._reference = point_to_point(self._start, np.array(move.target), self._limits)

    def unshaped(self) -> Recording:
        """Record the unshaped motion."""
        return self._follow(self._reference)

    def shaped(self, recipe: Recipe) -> Recording:
        """Record the motion shaped by a filter.

        Raises:
            ShaperFaultError: The shaper's function fails.
            RecipeError: There is no such filter for this arm.
        """
        description = self._description
        if self._stream:
            tvist, own = recipe.make(description, self._move.mass), self._reference
            tvist.reset(self._start)
            tvist.aim(None)
        else:
            tvist, own = own_move(recipe, description, self._move, self._limits)
        return self._follow(shape(Sound(tvist), own)[0], recipe.elastic(description, tvist))

    def baseline(self, baseline: Baseline, recipe: Recipe, ticks: int) -> Recording:
        """Record the motion of a baseline.

        Args:
            baseline: The baseline.
            recipe: Source of its estimates.
            ticks: Duration of the shaped motion that it is compared with.
        """
        shaped = baseline.shaped(recipe, self._description, self._move, self._reference, ticks, self._limits)
        return self._follow(shaped)

    def _follow(self, shaped: Floats, elastic: ElasticFeedForward | None = None) -> Recording:
        following = self._line.follow(self._reference, shaped, elastic=elastic)
        return following.simulate(self._arm, self._seed)
