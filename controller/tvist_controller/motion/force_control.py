"""Force mode and freedrive: guided motions that give way to the force at the tool, and what ends them."""

from collections.abc import Callable, Sequence

import numpy as np

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.kinematics.tool import turn, turned
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.sample import Sample
from tvist_controller.motion.contact import ContactWatch
from tvist_controller.motion.guidance import Guidance
from tvist_controller.motion.task_frame import Feature, frame_of
from tvist_controller.trajectory import Compliant, ForceTask, Guided, JointSpeed, Rest
from tvist_controller.trajectory.compliant import CRAWL
from tvist_controller.trajectory.force_law import FREE_DAMPING
from tvist_plant.plant import PERIOD, Supervised

SMOOTHED = 0.04
"""Time constant of a wrench that is estimated from the drives' torques, which the arm's elasticity shakes [s]."""
HAND_SPEED = np.repeat([0.5, 1.5], 3)
"""Largest speed by hand [m/s, rad/s]."""
LIGHT, HEAVY = (30.0, 150.0), (70.0, 700.0)
"""Virtual mass [kg] and damping [N s/m] of freedrive, by a sensor and by an estimate, which the arm's elasticity shakes
more: with the light ones a hand that presses it against something hard would begin an oscillation."""
MOST = 250.0
"""Force at the tool above which a protective stop begins, as the widest limit of UR's robots [N]."""
TICKS = 5
"""Ticks for which a force or a deviation must last before it does."""
TOUCH = 10.0
"""Force of a contact, if the flange has a sensor [N]."""
ESTIMATED_TOUCH = 20.0
"""Force of a contact that is estimated from the drives' torques [N]."""
GENTLE = 1.0
"""Deceleration of the fastest joint where force mode ends, the lowest of any stop [rad/s^2]."""


class ForceControl:
    """Begins and ends force mode, and watches the limits that go with it.

    Args:
        guidance: Guided motions.
        felt: Returns force and torque at the tool centre point of a tick, base frame, shape (6,) [N, N m].
    """

    def __init__(self, guidance: Guidance, felt: Callable[[Sample], Floats]) -> None:
        self.guidance = self._guidance = guidance
        """Guided motions."""
        self._measure = felt
        self._motion, self._cycle = guidance.motion, guidance.motion.cycle
        self._smooth = self._external = np.zeros(6)
        self._offset: Sequence[float] | None = None
        self._by_hand, self._beyond, self._contact = False, 0, ContactWatch()

    @property
    def compliant(self) -> Compliant | None:
        """The present motion that gives way; None without one."""
        return self._guidance.compliant

    @property
    def by_hand(self) -> bool:
        """Whether the arm can be moved by hand."""
        return self._by_hand and self.compliant is not None

    @property
    def hindrance(self) -> int:
        """0 if the arm can be moved by hand freely, 1 near a singular posture, 2 if that hardly lets it move."""
        share = 1.0 if not self.by_hand or (lead := self.compliant) is None else lead.hindered
        return 0 if share == 1.0 else 1 if share > CRAWL else 2

    def begin(self, task: ForceTask, feature: Feature, kind: int, trigger: str = "force_mode") -> int:
        """Control the force at the tool from now on; the motion under way goes on in the other axes.

        Args:
            task: What is to be reached.
            feature: The frame of the task.
            kind: 1 to 3, see `frame_of`.
            trigger: `force_mode`, or `freedrive`, in which the arm is moved by hand.

        Returns:
            Number of the motion.

        Raises:
            RefusalError: The present activity does not allow it, or its motion cannot be taken over.
        """
        if isinstance(self._cycle.line.plant, Supervised):
            why = "this arm follows positions with a lag, and its force is a guess: forces cannot move it"
            raise RefusalError("wrong_mode", "", why)
        self._guidance.check(trigger)
        lead = self.compliant or self._new()
        lead.aim(task, frame_of(feature, kind))
        self._by_hand = trigger == "freedrive"
        return self._guidance.follow(trigger, lead)

    def free(self, axes: Floats, feature: Feature) -> int:
        """Let the arm be moved by hand along and about some axes, shape (6,), each 0 or 1; else as `begin`."""
        mass, damping = HEAVY if self._cycle.sample.measured.wrench is None else LIGHT
        task = ForceTask(
            axes,
            np.zeros(6),
            np.where(axes > 0.0, HAND_SPEED, np.inf),
            (damping / FREE_DAMPING) ** 4,
            1.0,
            mass,
            damping,
        )
        return self.begin(task, feature, 2, "freedrive")

    def end(self) -> None:
        """Come to rest where the arm is, if force mode is on; a motion in the other axes ends, too."""
        if self.compliant is not None:
            self._guidance.stop_joints(GENTLE, "end_force_mode")

    def sense(self, wrench: Floats) -> None:
        """Take what an external force sensor measures, in the directions of the flange frame, shape (6,) [N, N m]."""
        self._external = wrench
        if self._offset is not None:
            lever = np.cross(self._offset, wrench[:3])
            self._cycle.external = np.concatenate((wrench[:3], wrench[3:] + lever))

    def use_external(self, offset: Sequence[float] | None) -> None:
        """Use an external force sensor; None for the plant's own, if it has one.

        Args:
            offset: Where it measures, in the flange frame, shape (3,) [m].
        """
        self._offset, self._cycle.external = offset, None
        self.sense(self._external)

    def touched(self, direction: Sequence[float]) -> int:
        """Return the number of ticks since just before the tool touched something; 0 if it does not.

        Args:
            direction: Direction in which it meets that, base frame, shape (3,); zeros for any.
        """
        estimated = self._cycle.sample.measured.wrench is None
        return self._contact.steps(direction, ESTIMATED_TOUCH if estimated else TOUCH)

    def _new(self) -> Compliant:
        guidance = self._guidance
        state, present = guidance.state, guidance.guided
        self._smooth = self._measure(self._cycle.sample)
        inner: Guided | Rest
        if present is not None and not self._cycle.mode.shaped:
            inner = present
        elif self._cycle.mode.at_rest:
            inner = Rest(state[0])
        else:
            inner = stop = JointSpeed(state, guidance.limits, guidance.torque, PERIOD)
            stop.aim(np.zeros_like(state[0]), guidance.limits.acceleration)
        return Compliant(
            state, guidance.limits, guidance.reach, guidance.torque, PERIOD, kinematics=guidance.tool, inner=inner,
            felt=self._felt, turn=turn, turned=turned,
        )  # fmt: skip

    def _felt(self) -> Floats:
        """Force and torque of the last tick."""
        sample = self._cycle.sample
        found = self._measure(sample)
        if sample.measured.wrench is None:
            found = self._smooth = self._smooth + PERIOD / (PERIOD + SMOOTHED) * (found - self._smooth)
        return found

    def watch(self, sample: Sample) -> None:
        """Make a protective stop if the arm presses too hard, or leaves its way in an axis that does not give way."""
        if self._contact.awake:
            self._contact.note(self._measure(sample)[:3])
        why = (
            self._excess(sample)
            if self._motion.activity.moving or sample.measured.wrench is not None
            else None
        )
        self._beyond = 0 if why is None else self._beyond + 1
        if why is not None and self._beyond > TICKS:
            self._beyond = 0
            self._motion.protect(why, "limit_force")

    def _excess(self, sample: Sample) -> str | None:
        if sample.measured.wrench is not None:
            force = float(np.linalg.norm(self._measure(sample)[:3]))
            if force > MOST:
                return f"force at the tool is {force:.0f} N, above {MOST:g} N for more than 10 ms"
        lead = self.compliant
        if lead is None or self._by_hand:
            return None
        there, here = lead.kinematics.pose(sample.target.q), lead.kinematics.pose(sample.measured.q)
        off = np.concatenate(((here[1] - there[1]) @ lead.axes, turn(there[0], here[0]) @ lead.axes))
        over = np.where(lead.task.compliant > 0.0, -np.inf, np.abs(off) - lead.task.limits)
        axis = int(np.argmax(over))
        if over[axis] <= 0.0:
            return None
        return (
            f"the tool is {abs(off[axis]):.3g} off its way in axis {axis} of force mode; limits[{axis}] "
            f"is {lead.task.limits[axis]:g}"
        )
