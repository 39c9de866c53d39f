"""Force mode and freedrive: guided motions that comply with the force at the tool; its sensors and limits."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import pinocchio as pin

from tvist_controller.instruments.tool_forces import ToolForces
from tvist_controller.kinematics.pose import turn
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_tick import Sample
from tvist_controller.motion.guidance import Guidance
from tvist_controller.motion.monitors import Monitor, MonitorFinding
from tvist_controller.refusal import wrong_mode
from tvist_controller.trajectory import Compliant, ForceTask
from tvist_controller.trajectory.compliant import CRAWL, FREE_DAMPING
from tvist_plant.plant import PERIOD

Feature = tuple[float, ...] | Literal["base", "tool"]
"""Pose of a frame in the base frame, x y z [m] and rotation vector [rad], or the frame of base or tool."""
FRAME_DEADBAND = 1e-3
"""Distance of the tool from the frame's origin, and speed, below which axes stay unchanged [m, m/s]."""
SMOOTHED = 0.04
"""Time constant for a wrench estimated from drive torques, which the arm's elasticity disturbs [s]."""
HAND_SPEED = np.repeat([0.5, 1.5], 3)  # largest speed in freedrive [m/s, rad/s]
LIGHT, HEAVY = (30.0, 150.0), (70.0, 700.0)
"""Virtual mass [kg] and damping [N s/m] of freedrive, with a sensor and with an estimate. Light values with
the disturbed estimate would oscillate when a hand presses the arm against something hard."""
MAX_FORCE = 250.0  # force at the tool that causes a protective stop, the widest limit of UR robots [N]
DRIVES = "the drives' torques"  # source of the force without a sensor
TICKS = 5  # ticks for which a force or deviation must last to cause a stop
TOUCH = 10.0, 4  # force of a contact [N] and number of ticks averaged, with a flange sensor
ESTIMATED_TOUCH = 20.0, 16  # the same for an estimated force, which a late set-point disturbs for a few ticks
GENTLE = 1.0  # deceleration of the fastest joint at the end of force mode, the lowest of any stop [rad/s^2]
REMEMBERED = 500  # ticks recorded, and after which an unused watch ends
FIRST = 20  # ticks at the start of a watch averaged as the force without contact
ONSET = 0.2  # fraction of the threshold that marks the start of a contact [-]
SILENT = 0.1  # time without values after which the sensor counts as silent [s]


class ContactWatch:
    """Finds the start of a contact in the force at the tool, which is recorded from the first query on."""

    def __init__(self) -> None:
        self._forces = deque[Floats](maxlen=REMEMBERED)
        self._usual: Floats | None = None
        self._asked = 0

    @property
    def awake(self) -> bool:
        """True while a program watches for contacts; `note` is then called every tick."""
        return self._asked > 0

    def note(self, force: Floats) -> None:
        """Take the force at the tool of a tick, base frame, shape (3,) [N]."""
        self._asked -= 1
        self._forces.append(force)
        if self._usual is None and len(self._forces) == FIRST:
            self._usual = np.mean(self._forces, axis=0)

    def steps(self, direction: Sequence[float], threshold: float, sure: int) -> int:
        """Return the ticks since just before a contact began; 0 if there is none.

        `direction` is the tool's motion towards the contact, base frame, zeros for any. The mean of `sure`
        ticks must exceed `threshold` [N].
        """
        self._asked = REMEMBERED
        if self._usual is None:
            return 0
        forces, length = np.array(self._forces) - self._usual, float(np.linalg.norm(direction))
        pushes = np.linalg.norm(forces, axis=1) if length == 0.0 else forces @ direction / -length
        if pushes[-sure:].mean() < threshold:
            return 0
        free = np.flatnonzero(pushes < ONSET * threshold)
        return len(pushes) - int(free[-1]) if len(free) else len(pushes)


class ExternalSensor:
    """A sensor replacing the arm's own while in use and not silent; in lockstep it never counts as silent."""

    def __init__(self, *, timeouts: bool) -> None:
        self._most = round(SILENT / PERIOD) if timeouts else np.inf
        self._offset: Sequence[float] | None = None
        self.latest: Floats | None = None  # last value; None if too old
        self._age = 0

    def use(self, offset: Sequence[float] | None) -> None:
        """Use the sensor at an offset from the flange, in its frame, shape (3,) [m]; None to end."""
        self._offset, self.latest = offset, None if offset is None else self.latest

    def sense(self, wrench: Floats) -> None:
        """Take a reading in flange axes, shape (6,) [N, N m]."""
        self.latest, self._age = wrench, 0

    @property
    def felt(self) -> Floats | None:
        """Reading about the flange's origin, shape (6,); None if unused or silent."""
        if self._offset is None or self.latest is None:
            return None
        force, torque = self.latest[:3], self.latest[3:]
        return np.concatenate((force, torque + np.cross(self._offset, force)))

    @property
    def awaited(self) -> bool:
        """True if the sensor is in use but has no recent value."""
        return self._offset is not None and self.latest is None

    def next(self) -> Floats | None:
        """Return `felt` for the next tick; call once per tick while there is a `latest` value."""
        self._age += 1
        if self._age > self._most:
            self.latest = None
        return self.felt


class ForceControl(Monitor):
    """Starts, ends and monitors force mode and freedrive; without `timeouts`, no sensor counts as silent."""

    def __init__(self, guidance: Guidance, forces: ToolForces, *, timeouts: bool) -> None:
        self._guidance, self._forces = guidance, forces
        self.external = ExternalSensor(timeouts=timeouts)  # a user's own force sensor
        self._motion, self._cycle = guidance.motion, guidance.motion.cycle
        self._smooth = np.zeros(6)
        self._by_hand, self._beyond = False, 0
        self._contact: ContactWatch | None = None
        self._source = self._source_of(self._cycle.sample)
        self._qd = self._cycle.sample.measured.qd
        self._basis: object = None

    @property
    def by_hand(self) -> bool:
        """Whether the arm is in freedrive."""
        return self._by_hand and self._guidance.compliant is not None

    @property
    def hindrance(self) -> int:
        """Freedrive near a singular posture: 0 if not hindered, 1 if slowed down, 2 if nearly blocked."""
        share = 1.0 if not self.by_hand or (lead := self._guidance.compliant) is None else lead.hindered
        return 0 if share == 1.0 else 1 if share > CRAWL else 2

    def begin(self, task: ForceTask, feature: Feature, kind: int, trigger: str = "force_mode") -> int:
        """Start or change force control with trigger `force_mode` or `freedrive`; return the motion's number.

        A running guided motion continues in the other axes. `feature` is the task's frame; `kind`, 1 to 3, is
        explained in `frame_of`. Raise RefusalError if the present activity or motion does not allow force
        control.
        """
        if self._cycle.plant.supervised:
            raise wrong_mode(
                "this arm follows positions late and only estimates its forces: use force mode at its own controller"
            )
        self.check_sensor()
        self._guidance.check(trigger)
        self.awake = True
        lead = self._guidance.compliant or self._new()
        lead.aim(task, frame_of(feature, kind))
        self._by_hand = trigger == "freedrive"
        return self._guidance.follow(trigger, lead)

    def free(self, axes: Floats, feature: Feature) -> int:
        """Start freedrive in the axes of the feature whose entry is 1, shape (6,); see `begin`."""
        mass, damping = HEAVY if self._cycle.sample.wrench is None else LIGHT
        speeds = np.where(axes > 0.0, HAND_SPEED, np.inf)
        task = ForceTask(axes, np.zeros(6), speeds, (damping / FREE_DAMPING) ** 4, 1.0, mass, damping)
        return self.begin(task, feature, 2, "freedrive")

    def end(self) -> None:
        """End force mode and the motion in the other axes, if any; the arm comes to rest."""
        if self._guidance.compliant is not None:
            self._guidance.stop_joints(GENTLE, "end_force_mode")

    def check_sensor(self) -> None:
        """Raise RefusalError if an external force sensor in use has sent nothing (yet, or for too long)."""
        if self.external.awaited:
            raise wrong_mode(
                "the external force sensor has sent no value yet: send one at least every 100 ms"
            )

    def sensed(self) -> Floats | None:
        """Return the external sensor's reading for the next tick; call once per tick while it has values."""
        self.awake = True
        return self.external.next()

    def begin_anew(self) -> None:
        """Use the arm's own sensor without zero, because the arm was placed elsewhere."""
        self.external.use(None)
        self._forces.forget_zero()

    def touched(self, direction: Sequence[float]) -> int:
        """Return the ticks since just before a contact in a direction (base frame, zeros: any), 0 if none."""
        estimated = self._cycle.sample.wrench is None
        if self._contact is None:
            self._contact, self.awake = ContactWatch(), True
            self._basis, self._qd = self._forces.basis, self._cycle.sample.measured.qd
        return self._contact.steps(direction, *(ESTIMATED_TOUCH if estimated else TOUCH))

    def _new(self) -> Compliant:
        guidance = self._guidance
        state, present = guidance.state, guidance.guided
        self._smooth = self._forces.felt(self._cycle.sample)
        if present is not None and not self._cycle.mode.shaped:
            inner = present
        else:
            inner = guidance.halting(state, guidance.limits.acceleration)
        return Compliant(
            state, guidance.limits, guidance.reach, guidance.torque, tool=lambda: self._motion.tool,
            inner=inner, felt=self._felt,
        )  # fmt: skip

    def _felt(self) -> Floats:
        sample = self._cycle.sample
        found = self._forces.felt(sample)
        if sample.wrench is None:
            found = np.asarray(self._smooth + PERIOD / (PERIOD + SMOOTHED) * (found - self._smooth))
            self._smooth = found
        return found

    def look(self, sample: Sample) -> MonitorFinding | None:
        """Detect excessive force, deviation in a non-compliant axis, and a change of the force's source."""
        # Without sensor and compliance there is nothing to monitor: sleep.
        leads = isinstance(self._cycle.trajectory, Compliant)
        if sample.wrench is None and self._contact is None and self._source == DRIVES and not leads:
            self._beyond, self.awake = 0, False
            return None
        self.awake = True
        if (changed := self._follow_source(self._source_of(sample))) is not None:
            return changed
        pressed = [
            self._forces.unexplained(sample, wrench, zeroed=wrench is sample.wrench)
            for wrench in (sample.external, sample.measured.wrench)
            if wrench is not None
        ]
        if self._contact is not None:
            self._note_contact(self._contact, sample, pressed)
        # NumPy's maximum propagates NaN, unlike Python's.
        force = float(np.max([np.linalg.norm(one) for one in pressed])) if pressed else 0.0
        why = self._excess(sample, force)
        self._beyond = 0 if why is None else self._beyond + 1
        if why is None or self._beyond <= TICKS:
            return None
        self._beyond = 0
        return MonitorFinding(why, "limit_force", "protective_stop")

    def _note_contact(self, contact: ContactWatch, sample: Sample, pressed: Sequence[Floats]) -> None:
        """Pass the force to the contact watch; drop the watch if zero or declared payload have changed."""
        basis = self._forces.basis
        if basis != self._basis:
            self._basis, self._contact = basis, None
            return
        contact.note(pressed[0] if pressed else self._forces.estimated(sample, self._qd))
        self._qd = sample.measured.qd
        if not contact.awake:
            self._contact = None

    def _source_of(self, sample: Sample) -> str:
        if self.external.felt is not None:
            return "the external force sensor"
        return DRIVES if sample.wrench is None else "the arm's force sensor"

    def _follow_source(self, source: str) -> MonitorFinding | None:
        """If the source of the force changes, forget the zero (the old source's) and end force control."""
        if source == self._source:
            return None
        self._source, self._contact = source, None
        self._forces.forget_zero()
        why = f"forces are now those of {source}"
        if self.external.awaited:
            why = f"the external force sensor has sent no value for {1e3 * SILENT:g} ms: {why}"
        if self._guidance.compliant is not None:
            return MonitorFinding(why, then="interruption")
        return MonitorFinding(why) if self.external.awaited else None

    def _excess(self, sample: Sample, force: float) -> str | None:
        if not force <= MAX_FORCE:
            return f"force at the tool is {force:.0f} N, above {MAX_FORCE:g} N for more than 10 ms"
        lead = self._guidance.compliant
        if lead is None or self._by_hand:
            return None
        there, here = lead.kinematics.pose(sample.target.q), lead.kinematics.pose(sample.measured.q)
        off = np.concatenate(((here[1] - there[1]) @ lead.axes, turn(there[0], here[0]) @ lead.axes))
        over = np.where(lead.task.compliant > 0.0, -np.inf, np.abs(off) - lead.task.limits)
        axis = int(np.argmax(over))
        if over[axis] <= 0.0:
            return None
        return (
            f"the tool is {abs(off[axis]):.3g} off its path in axis {axis} of force mode; limits[{axis}] "
            f"is {lead.task.limits[axis]:g}"
        )


def frame_of(feature: Feature, kind: int) -> Callable[[tuple[Floats, Floats], Floats], Floats]:
    """Return a function from tool pose (R, p) and velocity (3,) [m/s] to a task's axes, columns (3, 3).

    With kind 2 the axes are the frame's. With 1, its y axis is turned to point from the tool to the frame's
    origin; with 3, its x axis is the tool's velocity projected into its x-y plane.
    """
    if feature == "tool":
        return lambda pose, _: pose[0]
    axes, origin = np.eye(3), np.zeros(3)
    if not isinstance(feature, str):
        axes, origin = np.asarray(pin.exp3(np.array(feature[3:]))), np.array(feature[:3])
    if kind == 1:
        return lambda pose, _: _turned_to(axes, origin - pose[1])
    if kind == 3:
        latest = [axes]

        def along(_: tuple[Floats, Floats], velocity: Floats) -> Floats:
            flat = velocity - axes[:, 2] * (axes[:, 2] @ velocity)
            if np.linalg.norm(flat) > FRAME_DEADBAND:
                x = flat / np.linalg.norm(flat)
                latest[0] = np.column_stack((x, np.cross(axes[:, 2], x), axes[:, 2]))
            return latest[0]

        return along
    return lambda _pose, _velocity: axes


def _turned_to(axes: Floats, direction: Floats) -> Floats:
    """Turn the y axis of a frame into a direction by the shortest rotation."""
    length = np.linalg.norm(direction)
    if length < FRAME_DEADBAND:
        return axes
    return np.asarray(pin.Quaternion.FromTwoVectors(axes[:, 1], direction / length).matrix() @ axes)
