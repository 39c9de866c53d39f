"""Learns what to add to motions that are made again, from what the tool's accelerometer says after each stop."""

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from tvist_controller.experience.bump_responses import (
    LATE,
    LISTENED,
    SAMPLES,
    THIN,
    BumpResponses,
    thinned,
)
from tvist_controller.experience.motion_record import MotionRecord
from tvist_controller.experience.twin import Twin
from tvist_controller.line.correction import BUMPS, JOINTS, KEPT, LENGTH, course, heights
from tvist_controller.line.differentiator import Floats
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.lessons import Bumps, MotionLesson

STILL = 0.04
"""Residual at which nothing more can be learnt: the largest of 24 samples of noise alone is of that size [m/s²]."""
WORSE = 0.02
"""Difference of two residuals that noise does not explain [m/s²]."""
RISES = 2
"""Repetitions in a row that are worse than the best one, after which that is kept."""
SETTLED = 4
"""Repetitions in a row that are not better than the best one, after which that is kept."""
SHORTER = 0.5
"""Share of a step from the best correction that is made after one that was worse [-]."""
TRIED = 0.1
"""Height of the bumps with which the twin is asked [rad/s²]."""
Residual = Annotated[float, Meta(ge=0.0, le=1e3)]


class LearntMotion(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The best correction of a motion, to be kept between runs."""

    move: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]
    """What tells the motion from all others, see `MotionLesson`."""
    begins: Annotated[int, Meta(ge=1, le=100_000)]
    """See `MotionLesson`."""
    bumps: Bumps
    """See `MotionLesson`."""
    first: Residual
    """Residual of the first repetition [m/s²]."""
    best: Residual
    """Residual with this correction [m/s²]."""

    @property
    def lesson(self) -> MotionLesson:
        """The lesson, about which nobody need be told."""
        return MotionLesson(move=self.move, begins=self.begins, bumps=self.bumps, why="")


class _Learning:
    """One motion that is being learnt."""

    def __init__(self, kept: LearntMotion) -> None:
        self.kept = kept
        self.responses: BumpResponses | None = None
        self.repetitions = 0
        self.worse = 0
        """Number of repetitions in a row that were worse than the best one."""
        self.no_better = 0
        """Number of those that were not better."""
        self.without = 0
        """Number of repetitions in a row that did not get the correction that is kept."""
        self.settled = False


class MotionStudent:
    """Learns the corrections of motions, each from its own repetitions.

    After each repetition it gives the correction with which the least is expected to be left. When the residual is
    worse than the best one twice in a row, or no better for a while, the best one is kept for good; where even that
    becomes worse than the first repetition, the motion is learnt anew.

    Args:
        description: The robot.
        learnt: What was learnt in earlier runs.
        keep: Called with all that is learnt, after each change.
    """

    def __init__(
        self,
        description: RobotDescription,
        learnt: Sequence[LearntMotion] = (),
        keep: Callable[[Sequence[LearntMotion]], None] = lambda _: None,
    ) -> None:
        self._description, self._keep = description, keep
        self._motions = {one.move: _Learning(one) for one in learnt}
        still = np.zeros((1, 3, description.joints))
        FlexibleArm(description, description.payload).play(
            still
        )  # loads compiled code, which takes many ticks

    def study(self, motion: MotionRecord) -> MotionLesson | None:
        """Return the correction of the motion's next repetition; None if it stays as it is."""
        repetition, begins = motion.repetition, motion.stop + LATE - LENGTH
        heard = motion.accelerometer[begins - 1 : begins - 1 + SAMPLES * THIN]
        if repetition is None or not motion.whole or begins < 1 or len(heard) < SAMPLES * THIN:
            return None
        if not np.isfinite(heard).all() or np.abs(heard).max() > 1e3:
            return None  # no accelerometer says that
        made = () if repetition.corrected is None else repetition.corrected.bumps
        residual = left(motion)
        learning = self._motions.get(repetition.move)
        if learning is None or learning.kept.begins != begins:
            if made:
                return None  # it is corrected by what somebody else has learnt
            learning = _Learning(
                LearntMotion(move=repetition.move, begins=begins, bumps=(), first=residual, best=residual)
            )
        self._motions.pop(repetition.move, None)
        self._motions[repetition.move] = learning  # the last one to be dropped
        if len(self._motions) > KEPT:
            del self._motions[next(iter(self._motions))]
        lesson = self._learn(learning, motion, made, residual)
        if lesson is not None and learning.repetitions > 1:
            self._keep([one.kept for one in self._motions.values()])
        return lesson

    def _learn(
        self, learning: _Learning, motion: MotionRecord, made: Bumps, residual: float
    ) -> MotionLesson | None:
        kept = learning.kept
        learning.repetitions += 1
        learning.worse = learning.worse + 1 if residual > kept.best + WORSE else 0
        if learning.settled:
            return self._watch(learning, made, residual)
        better = residual < kept.best or learning.repetitions == 1
        if better:
            kept = learning.kept = _with(kept, bumps=made, best=residual)
        learning.no_better = 0 if better else learning.no_better + 1
        if kept.best <= STILL or learning.worse >= RISES or learning.no_better >= SETTLED:
            learning.settled, learning.worse, learning.responses = True, 0, None
            return self._say(learning, kept.bumps, "which is kept") if made or kept.bumps else None
        if learning.responses is None:
            learning.responses = BumpResponses(
                answers(Twin(self._description, motion.beliefs), motion, kept.begins)
            )
        learning.responses.hear(heights(made), thinned(motion.accelerometer, kept.begins - 1))
        best = learning.responses.best()
        if learning.worse:  # what is believed of the arm has misled: a shorter step
            best = heights(kept.bumps) + SHORTER * (best - heights(kept.bumps))
        bumps = _as_bumps(with_room(best, motion, kept, made, self._description))
        return self._say(learning, bumps, f"{residual:.3f} now")

    def _watch(self, learning: _Learning, made: Bumps, residual: float) -> MotionLesson | None:
        """Learn a motion anew if its correction was forgotten, or does harm, as on an arm that has changed."""
        kept = learning.kept
        learning.without = learning.without + 1 if kept.bumps and not made else 0
        if learning.without == RISES:  # once may be a repetition that began before the lesson was taken
            del self._motions[kept.move]
            return None
        if learning.worse < RISES or residual <= kept.first + WORSE:
            return None
        del self._motions[kept.move]
        return self._say(learning, (), f"{residual:.3f} now: it is learnt anew")

    @staticmethod
    def _say(learning: _Learning, bumps: Bumps, now: str) -> MotionLesson:
        kept = learning.kept
        why = (
            ""
            if learning.repetitions == 1
            # nobody knows yet whether it is ever made again
            else (
                f"motion {kept.move}, made {learning.repetitions} times, left {kept.first:.3f} m/s² at first, "
                f"{kept.best:.3f} at best, {now}"
            )
        )
        return MotionLesson(move=kept.move, begins=kept.begins, bumps=bumps, why=why)


def left(motion: MotionRecord) -> float:
    """Return what is left after a motion's stop: the largest change of the acceleration, of 10 ms means [m/s²]."""
    after = motion.accelerometer[motion.stop : motion.stop + LISTENED]
    means = after.reshape(-1, THIN, 3).mean(axis=1)
    rest = means[-6:].mean(axis=0)
    return float(np.sqrt(((means[1:] - rest) ** 2).sum(axis=1)).max())


def answers(twin: Twin, motion: MotionRecord, begins: int) -> Floats:
    """Return the twin's answers to bumps in a motion, shape (10, 3, 48, 3) [m/s² per rad/s²]."""
    joints = min(JOINTS, twin.description.joints)
    plain = thinned(twin.play(motion).measured.accelerometer, begins - 1)
    found = np.zeros((BUMPS, JOINTS, SAMPLES, 3))
    for bump in range(BUMPS):
        for joint in range(joints):
            tried = np.zeros((BUMPS, JOINTS))
            tried[bump, joint] = TRIED
            more = added(tried, motion, begins, twin.description)
            with_it = thinned(twin.play(motion, more).measured.accelerometer, begins - 1)
            found[bump, joint] = (with_it - plain) / TRIED
    return found


def added(bumps: Floats, motion: MotionRecord, begins: int, description: RobotDescription) -> Floats:
    """Return what a correction adds to a motion's commands, shape (T, 3, n)."""
    joints = min(JOINTS, description.joints)
    more = np.zeros_like(motion.commands)
    playing = more[begins - 1 : begins - 1 + LENGTH, :, :joints]
    playing[:] = course(bumps)[: len(playing), :, :joints]
    playing[:, 2] *= np.array(description.drives.rotor_inertia)[:joints]
    return more


def with_room(
    bumps: Floats, motion: MotionRecord, kept: LearntMotion, made: Bumps, description: RobotDescription
) -> Floats:
    """Return a correction, scaled down where the drives' torque limits have no room for it in this motion."""
    plain = motion.commands[:, 2] - added(heights(made), motion, kept.begins, description)[:, 2]
    more = np.abs(added(bumps, motion, kept.begins, description)[:, 2])
    room = np.maximum(np.array(description.limits.torque) - np.abs(plain), 0.0)
    scale = np.divide(room, more, out=np.full_like(more, np.inf), where=more > 0.0).min()
    return bumps * min(1.0, float(scale))


def _as_bumps(found: Floats) -> Bumps:
    return tuple((float(a), float(b), float(c)) for a, b, c in found)


def _with(kept: LearntMotion, *, bumps: Bumps, best: float) -> LearntMotion:
    return LearntMotion(move=kept.move, begins=kept.begins, bumps=bumps, first=kept.first, best=best)
