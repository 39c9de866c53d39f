"""One control period: Figure 6 of the paper, left to right."""

from typing import TypeVar

import numpy as np

from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Differentiator, Floats, ShapedReference, Target, rests_at
from tvist_controller.line.drive_feed_forward import DriveFeedForward
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.limits import arm_limits
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.line.line_mode import Guard, LineMode, Obstacle, check_change
from tvist_controller.line.line_tick import SIGNALS, Sample, to_drives
from tvist_controller.trajectory import PlannedMotion, Rest, StuckError, Trajectory
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.foreign import arm_of, check_measurement, measured_standing
from tvist_plant.plant import PERIOD, Measurement, Plant, SimulatedArm
from tvist_shaping.base import Filter, Posture

T = TypeVar("T", bound=Trajectory)


class ControlCycle:
    """Control line: trajectory generator, filter, differentiator, inverse dynamics, joint controllers, plant.

    Raise ValueError if the plant cannot start at q, or its measurement has the wrong shape.
    """

    def __init__(
        self,
        description: RobotDescription,
        tvist: Filter,
        *,
        q: Floats,  # initial joint angles, at rest, shape (n,) [rad]
        declared: Payload,  # for inverse dynamics
        carried: Payload,  # by the arm
        seed: int,  # of the arm's noise and gear errors
        plant: Plant | None = None,  # None for the flexible arm of the description
        elastic: ElasticFeedForward | None = None,  # for the filter; None for the paper's
        compensate_sag: bool = False,  # whether set-points compensate the gears' twist under gravity
        law: Floats
        | None = None,  # friction to feed forward, see `LAWS`; None for a share of the description's
    ) -> None:
        self.description = description
        self.plant: Plant = arm_of(FlexibleArm(description, carried) if plant is None else plant)
        self.trajectory: Trajectory = Rest(q)
        self.filter = LineFilter(tvist, arm_limits(description))
        """TVIST: shaper, estimator and fractional-delay filter."""
        self.shaped = ShapedReference(q)
        self.dynamics = InverseDynamics(description, declared)
        """Torques of the rigid arm with its declared payload."""
        self.drives = DriveFeedForward(
            description, compensate_sag=compensate_sag, positions=self.plant.supervised
        )  # joint controllers: from the target to the drive commands
        self.drives.wanted, self.drives.law = elastic, law
        self.mode = LineMode.REST
        self.placements = 0  # number of times the arm was placed at rest, which interrupts its motion
        self.guard: Guard | None = None  # checks references and stops of a guarded motion; None without one
        self.sample = self.reset(q, carried=carried, seed=seed)
        """Signals of the last tick, or of the arm at rest after a reset."""
        check_measurement(self.sample.measured, description.joints, self.plant)

    def step(self, external: Floats | None = None) -> Sample:
        """Compute one tick; `external` is the reading of an external force sensor, see `Sample.external`."""
        # Trajectory generator: the reference x is q, or the parameter of a path. Filter: the shaped reference x*.
        x, x_star, refused = self._references()
        reference, mode = self.shaped.take(x, x_star), self.mode
        self.dynamics.advance()  # a newly declared payload is phased in
        # Differentiator, inverse dynamics and joint controllers: q*, q̇*, q̈* a tick earlier, τ* and the plain command
        signals = self._to_drives(reference)
        command = self.drives.command(
            signals, self.dynamics.payload_parameters,
            may_begin=mode.shaped and not self.filter.fading, may_go_on=mode is not LineMode.BYPASSED,
        )  # fmt: skip
        measured = self.plant.step(command)
        self.sample = Sample(
            mode, reference, self.shaped.references, self.shaped.joints.window, signals, command, measured,
            self.drives.reference, refused, external,
        )  # fmt: skip
        self._settle()  # last, so that the final tick still counts as motion
        return self.sample

    def _to_drives(self, reference: Floats) -> Floats:
        """Return a tick's signals from the shaped reference to the drives, see `SIGNALS`, shape (9, n)."""
        signals, dynamics = np.empty((SIGNALS, len(reference))), self.dynamics
        before, middle, last = self.shaped.joints.window
        parts = dynamics.chain, dynamics.scratch, self.drives.rows
        to_drives(before, middle, last, reference, PERIOD, *parts, signals)
        return signals

    def follow(self, target: Floats, measured: Measurement) -> Sample:
        """Take target (q, q̇, q̈, τ, shape (4, n)) and measurement of an arm driven by its own controller."""
        q, qd, qdd, torque = target
        signals = np.array([q, q, qd, qdd, torque, np.zeros_like(q), q, qd, torque])
        still = (q, q, q)
        self.sample = Sample(
            LineMode.REST, q, still, still, signals, DriveCommand(q, qd, torque), measured
        )  # fmt: skip
        return self.sample

    def _references(self) -> tuple[Floats, Floats, Obstacle | None]:
        """Return reference, shaped reference and, if a stop had to begin, its reason, else None."""
        guard = self.guard
        try:
            x = self.trajectory.next()
        except StuckError as error:
            assert guard is not None, "what may be stuck is guarded"
            return self._stopped(guard, guard.give_up(str(error)))
        x_star = self.filter.filter(x) if self.mode.shaped else x
        # Check after the filter, since the arm must be able to stop from the shaped reference.
        if self.mode.guarded and guard is not None:
            stop = guard(self.shaped.joints.after(x_star))
            if stop is not None:
                return self._stopped(guard, stop)
        return x, x_star, None

    def _stopped(self, guard: Guard, stop: Trajectory) -> tuple[Floats, Floats, Obstacle]:
        x = self.begin(stop, LineMode.STOPPING).next()
        return x, x, guard.obstacle

    def begin(self, trajectory: T, mode: LineMode = LineMode.SHAPED, guard: Guard | None = None) -> T:
        """Follow a trajectory from now on, with the present guard unless another is given.

        In a shaped mode the trajectory continues the reference x. In other modes it continues the shaped
        reference x*, and the delay line is discarded. A new path can begin only at rest.

        Raises:
            ValueError: The mode cannot follow the present one, or needs a guard and has none.
        """
        guard, path = guard or self.guard, trajectory.path
        check_change(self.mode, mode, guarded=guard is not None)
        if not mode.shaped:
            # Drop the delay line's content, which would move the arm after the stop.
            if path is None:
                self.shaped.enter(None, self.position)
            self.filter.cut()
        elif path is not None and path.posture_of != self.shaped.posture_of:
            self._enter(path.start, path.posture_of)
        if mode.shaped and trajectory.limits is not None:
            self.filter.limits = trajectory.limits
        self.trajectory, self.mode, self.guard = trajectory, mode, guard
        return trajectory

    def _enter(self, sample: Floats, posture_of: Posture | None = None) -> None:
        """Change between joint samples and a path's parameter, at rest; see `ShapedReference.enter`."""
        self.shaped.enter(posture_of, sample)
        self.filter.begin(self.tvist, sample, posture_of)

    def use(self, tvist: Filter, elastic: ElasticFeedForward | None = None) -> None:
        """Change the filter: at once if at rest, otherwise within the limits of the motion.

        While an earlier change is in progress, the new filter waits; only the latest waiting filter is kept.
        If `elastic` is None, the paper's feed-forward is used.
        """
        self.drives.wanted = elastic
        if self.mode.at_rest:  # both kinds of feed-forward are equal at rest: no fading
            self.drives.rest()
        if self.mode.at_rest or not self.mode.shaped:
            self.filter.begin(tvist, self.sample.reference)
        else:
            self.filter.use(tvist)
            self.trajectory.adapt(self.filter.reduced_limits)

    def go_on(self, longer: PlannedMotion) -> None:
        """Extend the present planned motion to the end of a longer one that is equal until now."""
        assert isinstance(self.trajectory, PlannedMotion)
        self.trajectory.go_on(longer)
        self.filter.limits = self.trajectory.limits

    def fork(
        self, tvist: Filter | None = None, trajectory: Trajectory | None = None
    ) -> tuple[Trajectory, LineFilter | None, ShapedReference]:
        """Return copies of generator, filter (if in use) and output, with another filter or trajectory."""
        line_filter = self.filter.fork() if self.mode.shaped else None
        if tvist is not None and line_filter is not None:
            line_filter.use(tvist.fork())
        return (trajectory or self.trajectory).fork(), line_filter, self.shaped.fork()

    @property
    def tvist(self) -> Filter:
        """The latest chosen filter."""
        return self.filter.tvist

    @property
    def newest(self) -> Target:
        """State of the newest shaped reference."""
        return self.shaped.joints.newest

    @property
    def position(self) -> Floats:
        """The newest shaped reference, shape (n,) [rad]."""
        return self.shaped.joints.position

    @property
    def along(self) -> Differentiator:
        """Newest filter output and its derivatives: path parameters or joint positions."""
        return self.shaped.along

    @property
    def stands_still(self) -> bool:
        """True if reference and shaped reference rest: the motion is over or paused."""
        sample = self.sample
        return (
            self.trajectory.standing
            and (not self.mode.shaped or self.filter.settled)
            and rests_at(sample.reference, sample.target)
        )

    def _settle(self) -> None:
        """Enter rest if the trajectory has finished and the shaped reference rests at its end."""
        trajectory, mode = self.trajectory, self.mode
        if mode.at_rest or not ((trajectory.finished or mode is LineMode.RUNNING_OUT) and self.stands_still):
            return
        reference = self.sample.reference
        on_path = self.shaped.posture_of is not None
        if on_path or not mode.shaped:  # the delay line restarts from where the motion ended
            self._enter(reference)
        if on_path or not trajectory.finished:  # a motion that finished while paused ends here
            self.trajectory = Rest(reference)
        self.mode, self.guard = LineMode.REST, None
        self.drives.rest()

    def reset(
        self, q: Floats, *, carried: Payload | None = None, seed: int = 0, measured: Measurement | None = None
    ) -> Sample:
        """Place the arm at rest in static equilibrium, perhaps with another payload, and restart the whole line.

        An arm that cannot be placed stays where it is; if its position is unknown, raise ValueError before
        any change. If the arm does not answer, pass its last measurements as `measured`; the line starts
        there.
        """
        plant = self.plant
        if measured is None and not isinstance(plant, SimulatedArm):
            measured = measured_standing(plant, len(q))
            q = measured.q.copy()
        self.trajectory, self.mode, self.guard = Rest(q), LineMode.REST, None
        self.placements += 1
        self.dynamics.settle()
        self.shaped.reset(q)
        self.filter.begin(self.tvist, q)
        self.drives.reset(self.dynamics.gravity(q))
        signals = self._to_drives(q)
        command = self.drives.command(signals, self.dynamics.payload_parameters)
        if measured is None and isinstance(plant, SimulatedArm):
            measured = plant.reset(command, payload=carried, seed=seed)
        assert measured is not None, "what cannot be placed is measured"
        still = self.shaped.references
        self.sample = Sample(self.mode, q, still, still, signals, command, measured)
        return self.sample
