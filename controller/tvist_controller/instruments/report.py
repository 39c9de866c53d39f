"""Reports of a tick: state, built or encoded on demand, and truth; and their receivers."""

from collections.abc import Sequence
from typing import Literal

from msgspec import Struct

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import rotation_vector
from tvist_controller.line.differentiator import Floats, middle_of
from tvist_controller.line.line_tick import TORQUE, Sample
from tvist_plant.plant import PERIOD, Plant, PlantTruth
from tvist_protocol.codec import encode
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, State, Truth

Topic = Literal["state", "event", "truth", "telemetry", "io"]  # topics published without a request
MODES = ("f_d", "zeta", "participation")
TRUE_MODES_EVERY = 50  # ticks between computations of the arm's true modes, which take a good part of a tick


class Report(Struct, gc=False):
    """A tick, from which clients get a state; threads may share it."""

    tick: int  # number of the tick
    sample: Sample  # signals along the control line
    modes: tuple[int, int, int]  # robot mode, safety mode and runtime state
    speed: float  # fraction of the programmed speed [-]
    f_d: Floats  # damped frequencies used by the shaper, shape (modes,) [Hz]
    zeta: Floats  # damping ratios used by the shaper, shape (modes,) [-]
    delay: float  # time of the shaper's last impulse plus delay of the drive commands [s]
    clipped: bool  # whether the shaper cannot meet its specification
    sequence: int | None  # sequence number of the newest accepted set-point
    missed: int  # number of ticks that started late
    arm: Arm  # the arm with its tool; it must not change
    made: State | None = None
    written: bytes | None = None

    @property
    def state(self) -> State:
        """The state."""
        if self.made is None:
            self.made = self._make()
        return self.made

    @property
    def encoded(self) -> bytes:
        """The encoded state."""
        if self.written is None:
            self.written = encode(self.state)
        return self.written

    def _make(self) -> State:
        sample, measured = self.sample, self.sample.measured
        reference, target, target_qd, target_qdd, moment = sample.signals[: TORQUE + 1].tolist()
        unshaped: Sequence[list[float] | None] = (None, None, None)
        if sample.unshaped is not None:
            before = middle_of(sample.unshaped)
            unshaped = [row.tolist() for row in (before.q, before.qd, before.qdd)]
        motors = (None, None, None) if sample.motors is None else sample.motors.rows.tolist()
        motion = self.arm.motion(measured.q, measured.qd).tolist()
        robot_mode, safety_mode, runtime = self.modes
        return State(
            tick=self.tick, timestamp=self.tick * PERIOD, robot_mode=robot_mode, safety_mode=safety_mode,
            runtime_state=runtime, setpoint_sequence=self.sequence,
            reference_q=reference, target_q=target, target_qd=target_qd, target_qdd=target_qdd,
            target_moment=moment, actual_q=measured.q.tolist(), actual_qd=measured.qd.tolist(),
            actual_moment=measured.moment.tolist(),
            actual_TCP_pose=motion[:6], actual_TCP_speed=motion[6:],
            actual_tool_accelerometer=measured.accelerometer.tolist(), speed_scaling=self.speed,
            estimated_f_d=self.f_d.tolist(), estimated_zeta=self.zeta.tolist(), shaper_delay=self.delay,
            missed_ticks=self.missed, shaper_clipped=self.clipped,
            unshaped_q=unshaped[0], unshaped_qd=unshaped[1], unshaped_qdd=unshaped[2],
            motor_qd=motors[0], motor_qdd=motors[1], motor_moment=motors[2],
            motor_limited=sample.motors is not None and sample.motors.limited,
            flange_wrench=None if sample.wrench is None else sample.wrench.tolist(),
        )  # fmt: skip


class Sink:
    """Receives messages in the controller's thread; by default ignores them.

    Must not raise, nor block except in lockstep.
    """

    wants_truth = False
    """Whether this sink wants the truth now, even if the robot does not publish it."""

    def report(self, report: Report, /) -> None:
        """Take a tick's report; the default calls `state`, which takes a while to build."""
        self.state(report.state)

    def state(self, state: State, /) -> None:
        """Take a tick's state."""

    def event(self, event: Event, /) -> None:
        """Take an event; it precedes the state of its tick."""

    def truth(self, truth: Truth, /) -> None:
        """Take what a real robot cannot measure, if published or wanted by this sink."""

    def io(self, io: Io, /) -> None:
        """Take changed inputs, outputs and registers; they precede the state of their tick."""

    def raised(self, error: Exception) -> None:
        """Log an exception of a plant, program function or tick, which the robot has handled."""

    def journal(self, entry: Entry, /) -> None:
        """Take an input of the controller, which precedes the tick of its number."""


def true_modes(plant: Plant, joints: int) -> dict[str, list[float]]:
    """Return up to `joints` true modes of the arm (takes half a tick); empty lists if the plant has none."""
    modes = plant.modes()
    return {name: [] if modes is None else getattr(modes, name)[:joints].tolist() for name in MODES}


def truth_message(plant: Plant, tick: int, modes: dict[str, list[float]]) -> Truth:
    """Return the message of the truth with true modes; raise ValueError if the plant provides no truth."""
    truth = truth_of(plant)
    gears, links = truth.static_gear_deflection, truth.static_link_deflection
    return Truth(
        tick=tick,
        timestamp=tick * PERIOD,
        motor_q=truth.motor_q.tolist(),
        motor_qd=truth.motor_qd.tolist(),
        gear_deflection=truth.gear_deflection.tolist(),
        link_deflection=truth.link_deflection.tolist(),
        flange_pose=truth.flange_position.tolist() + rotation_vector(truth.flange_rotation),
        tool_acceleration=truth.specific_force.tolist(),
        static_gear_deflection=[] if gears is None else gears.tolist(),
        static_link_deflection=[] if links is None else links.tolist(),
        body_poses=plant.places().ravel().tolist(),
        contact_force=[] if plant.things() is None else plant.contact().tolist(),
        **(modes or {name: [] for name in MODES}),
    )


def truth_of(plant: Plant) -> PlantTruth:
    """Return what a real robot cannot measure; raise ValueError if the plant does not provide it."""
    if (truth := plant.truth()) is None:
        raise ValueError(
            f"truth is on, but the plant {type(plant).__name__} cannot report it: turn truth off"
        )
    return truth
