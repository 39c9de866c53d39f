"""One control period: the paper's Figure 6, left to right."""

from typing import TypeVar

import numpy as np

from tvist_controller.line.boxes import Boxes
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.guard import Guard, Obstacle
from tvist_controller.line.line_mode import LineMode, check_change
from tvist_controller.line.sample import Sample
from tvist_controller.trajectory import Rest, StuckError, Trajectory
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Measurement, Placeable, Plant
from tvist_plant.plant_checks import check_measurement, measured_standing
from tvist_shaping.base import Filter

T = TypeVar("T", bound=Trajectory)


class ControlCycle:
    """Trajectory generator, TVIST filter, differentiator, inverse dynamics, joint controllers, plant.

    Args:
        description: The robot.
        tvist: The filter, with its shaper and estimator.
        q: Joint angles at which the arm is at rest initially, shape (n,) [rad].
        declared: Payload that inverse dynamics uses.
        carried: Payload that the arm carries.
        seed: Seed of the arm's noise and gear errors.
        plant: Plant to control; None for the flexible arm of the description.
        elastic: Elastic feed-forward to use with the filter; None for that of the paper's controller.
        compensate_sag: Whether the drives lead by the twist of the gears under gravity.
        law: Identified friction to feed forward, see `friction_at`; None for a share of the description's.

    Raises:
        ValueError: The plant cannot start there, or its measurement has the wrong shape.
    """

    def __init__(
        self,
        description: RobotDescription,
        tvist: Filter,
        *,
        q: Floats,
        declared: Payload,
        carried: Payload,
        seed: int,
        plant: Plant | None = None,
        elastic: ElasticFeedForward | None = None,
        compensate_sag: bool = False,
        law: Floats | None = None,
    ) -> None:
        self.description = description
        arm = FlexibleArm(description, carried) if plant is None else plant
        self.line = Boxes.of(description, tvist, q, declared, arm, compensate_sag=compensate_sag)
        """The boxes after the trajectory generator."""
        self.line.drives.use(elastic)
        self.line.drives.compensate(law)
        self.trajectory: Trajectory = Rest(q)
        """Trajectory generator."""
        self.mode = LineMode.REST
        """What the line does."""
        self.placements = 0
        """Number of times that the arm was put at rest somewhere, which breaks off what it did."""
        self.guard: Guard | None = None
        """What checks the references and the stops of a guarded motion; None without one."""
        self.sample = self.reset(q, carried=carried, seed=seed)
        """Signals of the last tick, or of the arm where it was put at rest since."""
        check_measurement(self.sample.measured, description.joints, self.line.plant)

    def step(self) -> Sample:
        """Compute one tick."""
        line = self.line
        # Trajectory generator: the reference x is q, or the parameter of a path. Filter: the shaped reference x*.
        x, x_star, refused = self._references()
        reference, mode = line.shaped.take(x, x_star), self.mode
        line.dynamics.advance()  # a newly declared payload is phased in
        # Differentiator, inverse dynamics and joint controllers: q*, q̇*, q̈* a tick earlier, τ* and the plain command
        signals = line.to_drives(reference)
        command = line.drives.command(
            signals, line.dynamics.payload_parameters,
            may_begin=mode.shaped and not line.filter.fading, may_go_on=mode is not LineMode.BYPASSED,
        )  # fmt: skip
        measured = line.plant.step(command)
        self.sample = Sample(
            mode, reference, line.shaped.references, line.shaped.joints.window, signals, command, measured,
            line.drives.reference, refused,
        )  # fmt: skip
        self._settle()  # last, so that the tick that comes to rest is still reported as one of the motion
        return self.sample

    def follow(self, target: Floats, measured: Measurement) -> Sample:
        """Take what another controller asked of the arm in a tick, and what that measured; the arm gets no command.

        Args:
            target: Position, velocity, acceleration and torque, shape (4, n).
            measured: Measurements of the same tick.
        """
        q, qd, qdd, torque = target
        signals = np.array([q, q, qd, qdd, torque, np.zeros_like(q), q, qd, torque])
        still = (q, q, q)
        self.sample = Sample(
            LineMode.REST, q, still, still, signals, DriveCommand(q, qd, torque), measured
        )  # fmt: skip
        return self.sample

    def _references(self) -> tuple[Floats, Floats, Obstacle | None]:
        """Return the reference of this tick, the shaped one, and why a stop had to begin; None if it had not."""
        guard = self.guard
        try:
            x = self.trajectory.next()
        except StuckError as error:
            assert guard is not None, "what may be stuck is guarded"
            return self._stopped(guard, guard.give_up(str(error)))
        x_star = self.line.filter.filter(x) if self.mode.shaped else x
        # Judged after the filter, since it is the shaped reference from which the arm must be able to stop.
        if self.mode.guarded and guard is not None:
            stop = guard(self.line.shaped.joints.after(x_star))
            if stop is not None:
                return self._stopped(guard, stop)
        return x, x_star, None

    def _stopped(self, guard: Guard, stop: Trajectory) -> tuple[Floats, Floats, Obstacle]:
        x = self.begin(stop, LineMode.STOPPING).next()
        return x, x, guard.obstacle

    def begin(self, trajectory: T, mode: LineMode = LineMode.SHAPED, guard: Guard | None = None) -> T:
        """Follow a trajectory from now on.

        Args:
            trajectory: In a shaped mode it continues the reference x; in another one it continues the shaped reference
                x*, and the delay line is discarded. A new path may begin only at rest.
            mode: Mode of the line.
            guard: Check of each shaped reference in a guarded mode; None to keep the present one.

        Raises:
            ValueError: The mode cannot follow the present one, or it is guarded, and there is no guard.
        """
        guard, path, line = guard or self.guard, trajectory.path, self.line
        check_change(self.mode, mode, guarded=guard is not None)
        if not mode.shaped:
            # What the delay line still holds would carry the arm on after the stop: it is never played.
            if path is None:
                line.shaped.enter(None, line.shaped.position)
            line.filter.cut()
        elif path is not None and path.posture_of != line.shaped.posture_of:
            line.enter(path.start, path.posture_of)
        if mode.shaped and trajectory.limits is not None:
            line.filter.limits = trajectory.limits
        self.trajectory, self.mode, self.guard = trajectory, mode, guard
        return trajectory

    def use(self, tvist: Filter, elastic: ElasticFeedForward | None = None) -> None:
        """Change the filter: at once if the arm is at rest, else within the limits of the motion.

        If a change is under way, the new filter waits until that is complete; only the latest waiting filter is kept.

        Args:
            tvist: New filter, with the joints and the period of the present one.
            elastic: Elastic feed-forward to use with it; None for that of the paper's controller.
        """
        line_filter, drives = self.line.filter, self.line.drives
        drives.use(elastic)
        if self.mode.at_rest:  # both kinds of feed-forward are equal there, so that none has to fade
            drives.rest()
        if self.mode.at_rest or not self.mode.shaped:
            line_filter.begin(tvist, self.sample.reference)
        else:
            line_filter.use(tvist)
            self.trajectory.adapt(line_filter.spared)

    @property
    def stands_still(self) -> bool:
        """Whether the shaped reference rests on a reference that stands: the motion is over, or it is paused."""
        line, sample = self.line, self.sample
        return (
            self.trajectory.standing
            and (not self.mode.shaped or line.filter.settled)
            and sample.target.rests_at(sample.reference, PERIOD)
        )

    def _settle(self) -> None:
        """Rest if the motion is over: its trajectory has finished, and the shaped reference rests on its end."""
        trajectory, mode = self.trajectory, self.mode
        if mode.at_rest or not ((trajectory.finished or mode is LineMode.RUNNING_OUT) and self.stands_still):
            return
        line, reference = self.line, self.sample.reference
        on_path = line.shaped.posture_of is not None
        if on_path or not mode.shaped:  # the delay line restarts from where the motion ended
            line.enter(reference)
        if on_path or not trajectory.finished:  # a motion that ran out while paused ends here
            self.trajectory = Rest(reference)
        self.mode, self.guard = LineMode.REST, None
        line.drives.rest()

    def reset(
        self, q: Floats, *, carried: Payload | None = None, seed: int = 0, measured: Measurement | None = None
    ) -> Sample:
        """Place the arm somewhere at rest, in static equilibrium; the whole line restarts.

        Args:
            q: Joint angles, shape (n,) [rad]; of an arm that cannot be placed, the line begins where that stands.
            carried: New carried payload; None for the present one.
            seed: Seed of the arm's noise and gear errors.
            measured: Last measurements of an arm that does not answer: the line then begins at q, and nobody asks it.

        Raises:
            ValueError: An arm that cannot be placed does not tell where it stands. Nothing has changed.
        """
        line, plant = self.line, self.line.plant
        if measured is None and not isinstance(plant, Placeable):
            measured = measured_standing(plant, len(q))
            q = measured.q.copy()
        self.trajectory, self.mode, self.guard = Rest(q), LineMode.REST, None
        self.placements += 1
        signals = line.rest_at(q)
        command = line.drives.command(signals, line.dynamics.payload_parameters)
        if measured is None and isinstance(plant, Placeable):
            measured = plant.reset(command, payload=carried, seed=seed)
        assert measured is not None, "what cannot be placed is measured"
        still = line.shaped.references
        self.sample = Sample(self.mode, q, still, still, signals, command, measured)
        return self.sample
