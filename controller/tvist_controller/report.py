"""What a tick has computed, as a message that is made, or encoded, when somebody wants it."""

from msgspec import Struct

from tvist_controller.control.differentiator import Floats
from tvist_controller.control.kinematics import ForwardKinematics
from tvist_controller.cycle import Sample
from tvist_plant.plant import PERIOD
from tvist_protocol.codec import encode
from tvist_protocol.stream import State


class Report(Struct, gc=False):
    """A tick, of which clients get a state. Threads may share it."""

    tick: int
    """Number of the tick."""
    sample: Sample
    """Signals along the control line."""
    modes: tuple[int, int, int]
    """Robot mode, safety mode and runtime state."""
    speed: float
    """Share of the programmed speed [-]."""
    f_d: Floats
    """Damped frequencies that the shaper uses, shape (modes,) [Hz]."""
    zeta: Floats
    """Damping ratios that it uses, shape (modes,) [-]."""
    delay: float
    """Time of the shaper's last impulse, and by which commands for the drives are late [s]."""
    clipped: bool
    """Whether the shaper cannot meet its specification."""
    sequence: int | None
    """Sequence number of the newest accepted set-point."""
    missed: int
    """Number of ticks that began too late."""
    kinematics: ForwardKinematics
    """Kinematics of the tool, which must not change."""
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
        sample, unshaped, motors = self.sample, self.sample.unshaped, self.sample.motors
        target, measured = sample.target, sample.measured
        motion = self.kinematics.motion(measured.q, measured.qd).tolist()
        robot_mode, safety_mode, runtime = self.modes
        return State(
            tick=self.tick,
            timestamp=self.tick * PERIOD,
            robot_mode=robot_mode,
            safety_mode=safety_mode,
            runtime_state=runtime,
            setpoint_sequence=self.sequence,
            reference_q=sample.reference.tolist(),
            target_q=target.q.tolist(),
            target_qd=target.qd.tolist(),
            target_qdd=target.qdd.tolist(),
            target_moment=sample.torque.tolist(),
            actual_q=measured.q.tolist(),
            actual_qd=measured.qd.tolist(),
            actual_moment=measured.moment.tolist(),
            actual_TCP_pose=motion[:6],
            actual_TCP_speed=motion[6:],
            actual_tool_accelerometer=measured.accelerometer.tolist(),
            speed_scaling=self.speed,
            estimated_f_d=self.f_d.tolist(),
            estimated_zeta=self.zeta.tolist(),
            shaper_delay=self.delay,
            missed_ticks=self.missed,
            shaper_clipped=self.clipped,
            unshaped_q=None if unshaped is None else unshaped.q.tolist(),
            unshaped_qd=None if unshaped is None else unshaped.qd.tolist(),
            unshaped_qdd=None if unshaped is None else unshaped.qdd.tolist(),
            motor_qd=None if motors is None else motors.qd.tolist(),
            motor_qdd=None if motors is None else motors.qdd.tolist(),
            motor_moment=None if motors is None else motors.torque.tolist(),
            motor_limited=motors is not None and motors.limited,
        )
