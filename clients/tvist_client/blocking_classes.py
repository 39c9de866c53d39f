"""The classes of the client without `await`; `tvist_client.blocking` opens and closes the connection.

Made by `python -m tools.blocking` from the classes of the client with `await`: change those instead.
"""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, Self

from tvist_client import arm, motion, robot, servo, stepper
from tvist_client.blocking_stream import Stream
from tvist_client.commanded import Answer
from tvist_client.portal import Portal
from tvist_client.published import BUFFER
from tvist_client.robot import ANSWER_S
from tvist_protocol.commands import Command
from tvist_protocol.forces import FrameType
from tvist_protocol.info import Clock, Info
from tvist_protocol.io import Bank, Io
from tvist_protocol.motions import Orientation, Segment
from tvist_protocol.simulation import StepSetpoint
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_protocol.values import Payload, ResetMode


class Motion:
    """One motion, from the robot's acceptance to its end."""

    def __init__(self, portal: Portal, motion: motion.Motion) -> None:
        self._portal, self._motion = portal, motion

    @property
    def id(self) -> int:
        """The robot's number for it."""
        return self._motion.id

    @property
    def started(self) -> int | None:
        """Tick at which it began; None until then."""
        return self._motion.started

    @property
    def done(self) -> int | None:
        """Tick at which its shaped reference came to rest at the target; None until then, or if it never did."""
        return self._motion.done

    @property
    def limited(self) -> str | None:
        """Why it is slower than asked, or which limit it will exceed, in a sentence; None if it is as asked."""
        return self._motion.limited

    @property
    def stopped(self) -> Event | None:
        """The event that reports its end before the target; None if there is none."""
        return self._motion.stopped

    @property
    def ended(self) -> bool:
        """Whether the motion has ended, or the connection that would report its end is lost."""
        return self._motion.ended

    def wait(self) -> Self:
        """Wait for the end; in lockstep and free, step time until then.

        Raises:
            MotionStoppedError: The motion ended before its target.
            NotConnectedError: The robot disconnected.
        """
        self._portal.call(self._motion.wait)
        return self


class Servo:
    """The stream that `Arm.servo` yields: numbers set-points from 0 and checks them, since a robot does not answer."""

    def __init__(self, portal: Portal, servo: servo.Servo) -> None:
        self._portal, self._servo = portal, servo

    @property
    def period(self) -> float:
        """Time between two set-points [s]."""
        return self._servo.period

    @property
    def sequence(self) -> int:
        """Number of the next set-point."""
        return self._servo.sequence

    def set(self, q: Iterable[float]) -> int:
        """Send the next set-point, without blocking; to be called once per period.

        In real time, 250 ms without a set-point end the stream; this includes the wait for the first one.

        Args:
            q: Set-point, one angle per joint [rad].

        Returns:
            Its number; `state.setpoint_sequence` says when it was accepted.

        Raises:
            ArgumentError: The number of angles is wrong, or an angle is not finite or outside its joint's range.
            StreamStoppedError: The robot has ended the stream.
            MisuseError: The block of `Arm.servo` has been left.
        """
        return self._portal.run(lambda: self._servo.set(q))

    def step_through(self, qs: Iterable[Iterable[float]]) -> int:
        """Play set-points in lockstep and free, each for one period, and step time accordingly.

        Args:
            qs: Set-points, one per period, each with one angle per joint [rad].

        Returns:
            The tick at the end of the last set-point; its state has arrived.

        Raises:
            ArgumentError: See `set`; none of the set-points was played.
            MisuseError: Time passes by itself here, or there are no set-points.
            StreamStoppedError: The robot has ended the stream.
        """
        return self._portal.call(lambda: self._servo.step_through(qs))


class Stepper:
    """The clock of a simulated robot, which `Robot.clock_control` yields. It cannot move the robot."""

    def __init__(self, portal: Portal, stepper: stepper.Stepper) -> None:
        self._portal, self._stepper = portal, stepper

    @property
    def token(self) -> str:
        """Token of the clock."""
        return self._stepper.token

    def step(self, ticks: int) -> int:
        """Advance time with one command; other clients' commands are carried out between the ticks.

        Args:
            ticks: Number of control periods, 1 to 100000.

        Returns:
            The last tick that passed, which is earlier than requested if the clock was lost meanwhile; its state has
            arrived.

        Raises:
            RefusedError: The clock was lost; the message contains the present holder's name.
        """
        return self._portal.call(lambda: self._stepper.step(ticks))

    def advance(self, ticks: int) -> int:
        """Advance time by any number of ticks, as `Robot.advance` does."""
        return self._portal.call(lambda: self._stepper.advance(ticks))


class Arm:
    """The arm that `Robot.control` yields. Joint values are any sequence of numbers [rad], one for each joint.

    Every command may raise RefusedError; it has then changed nothing.
    """

    def __init__(self, portal: Portal, arm: arm.Arm) -> None:
        self._portal, self._arm = portal, arm

    @contextlib.contextmanager
    def servo(
        self, *, period: float = 0.002, velocity: float = 1.5, acceleration: float = 2.0, jerk: float = 100.0
    ) -> Iterator[Servo]:
        """Stream set-points for as long as the block lasts; then the stream ends and the arm comes to rest.

        Args:
            period: Time between two set-points [s].
            velocity: Velocity to which every joint is limited [rad/s].
            acceleration: Acceleration to which every joint is limited [rad/s²].
            jerk: Jerk to which every joint is limited [rad/s³].
        """
        with self._portal.enter(
            self._arm.servo(period=period, velocity=velocity, acceleration=acceleration, jerk=jerk)
        ) as entered:
            yield Servo(self._portal, entered)

    def stop(self, deceleration: float | None = None) -> None:
        """Come to rest now, bypassing the shaper.

        Args:
            deceleration: Largest deceleration of any joint [rad/s²]; None for as much as the torque limits allow.
        """
        self._portal.call(lambda: self._arm.stop(deceleration))

    def pause(self) -> None:
        """Bring the running motion to a standstill on its path."""
        self._portal.call(self._arm.pause)

    def resume(self) -> None:
        """Continue a paused motion."""
        self._portal.call(self._arm.resume)

    def set_speed(self, fraction: float) -> None:
        """Scale the speed of motions, as the slider of a teach pendant does; streams keep their own time.

        Args:
            fraction: Share of the programmed speed, 0 to 1 [-].
        """
        self._portal.call(lambda: self._arm.set_speed(fraction))

    def power_on(self, *, release_brakes: bool = True) -> None:
        """Power on the arm; without `release_brakes`, the brakes of an arm that was off stay closed."""
        self._portal.call(lambda: self._arm.power_on(release_brakes=release_brakes))

    def power_off(self) -> None:
        """Stop any motion, then power off the arm."""
        self._portal.call(self._arm.power_off)

    def unlock_protective_stop(self) -> None:
        """Unlock a protective stop; the arm must be at rest.

        In real time, wait for `UNLOCKED_TICKS` to see that the robot does not stop again. In lockstep and free, the
        caller advances time: a new stop is then reported as an event, and as `stop` in `Robot.info`.

        Raises:
            ProtectiveStopError: The robot has stopped again, because the cause of the stop persists.
        """
        self._portal.call(self._arm.unlock_protective_stop)

    def restart_safety(self) -> None:
        """Restart the safety system after a violation or a fault; afterwards the arm has no power."""
        self._portal.call(self._arm.restart_safety)

    def load_program(self, name: str, text: str | None = None) -> None:
        """Load a program; a running program and the arm are stopped first.

        Args:
            name: Its name: one of `programs` in `info`, or any other if `text` is given.
            text: Its text in URScript, which the robot keeps under this name; None for the one it has.
        """
        self._portal.call(lambda: self._arm.load_program(name, text))

    def run_program(self, text: str) -> None:
        """Start a program in URScript at once; it replaces a running one, unless it is secondary (`sec`)."""
        self._portal.call(lambda: self._arm.run_program(text))

    def close_popup(self) -> None:
        """Close the message that a program shows, for which it may be waiting."""
        self._portal.call(self._arm.close_popup)

    def play_program(self) -> None:
        """Start the loaded program, or resume a paused one. `io` reports its progress; it ends with control."""
        self._portal.call(self._arm.play_program)

    def pause_program(self) -> None:
        """Pause the program and its motion; `play_program` resumes it."""
        self._portal.call(self._arm.pause_program)

    def stop_program(self) -> None:
        """Stop the program, and the arm with it."""
        self._portal.call(self._arm.stop_program)

    def set_shaper(self, name: str, modes: int = 1) -> None:
        """Choose the input shaper, one of those in `info`; `none` turns shaping off."""
        self._portal.call(lambda: self._arm.set_shaper(name, modes))

    def set_estimator(
        self,
        name: str,
        *,
        f_d: float | Iterable[float] | None = None,
        zeta: float | Iterable[float] | None = None,
        calibration: str | Mapping[str, Any] | None = None,
    ) -> None:
        """Choose the estimator that provides the shaper with frequency and damping ratio.

        Args:
            name: `fixed` with `f_d` and `zeta`, `polynomial` or `modal` with `calibration`.
            f_d: Damped frequency of each mode [Hz]; a single number for one mode.
            zeta: Damping ratio of each mode [-]; a single number for one mode.
            calibration: Name of a calibration in `info`, or its content as a map.
        """
        self._portal.call(lambda: self._arm.set_estimator(name, f_d=f_d, zeta=zeta, calibration=calibration))

    def set_payload(self, mass: float, com: Iterable[float], inertia: Iterable[float]) -> None:
        """Declare the payload to the controller.

        Args:
            mass: Mass [kg].
            com: Centre of mass x y z in the flange frame [m].
            inertia: xx xy xz yy yz zz about the centre of mass, flange axes [kg m²].
        """
        self._portal.call(lambda: self._arm.set_payload(mass, com, inertia))

    def forget(self) -> None:
        """Undo what the robot has learnt of its payload: it assumes the declared one again.

        A robot served with `--adapt payload` learns it anew.
        """
        self._portal.call(self._arm.forget)

    def set_tcp(self, offset: Iterable[float]) -> None:
        """Set the tool centre point.

        Args:
            offset: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
        """
        self._portal.call(lambda: self._arm.set_tcp(offset))

    def hand_over(self, client: str) -> None:
        """Give control to another client, which only has to take it; this client loses control."""
        self._portal.call(lambda: self._arm.hand_over(client))

    def keep_alive(self) -> None:
        """Renew the lease, as every command does; `Robot.control` does this automatically."""
        self._portal.call(self._arm.keep_alive)

    def move_j(
        self,
        q: Iterable[float],
        *,
        velocity: float = 1.5,
        acceleration: float = 2.0,
        jerk: float = 100.0,
        duration: float | None = None,
        wait: bool = True,
    ) -> Motion:
        """Move to a joint configuration, all joints in phase.

        Args:
            q: Target [rad].
            velocity: Largest velocity of any joint [rad/s].
            acceleration: Largest acceleration of any joint [rad/s²].
            jerk: Largest jerk of any joint [rad/s³].
            duration: Duration of the motion before shaping [s], instead of the three limits above; one too short for
                the arm takes longer.
            wait: Whether to wait for the end; in lockstep and free, time is stepped until then.

        Returns:
            The motion; `started` and `done` are ticks once they are known.

        Raises:
            MotionStoppedError: The motion ended before its target.
        """
        return Motion(
            self._portal,
            self._portal.call(
                lambda: self._arm.move_j(
                    q, velocity=velocity, acceleration=acceleration, jerk=jerk, duration=duration, wait=wait
                )
            ),
        )

    def move_l(
        self,
        pose: Iterable[float],
        *,
        frame: Iterable[float] | None = None,
        velocity: float = 0.25,
        acceleration: float = 1.2,
        jerk: float = 60.0,
        duration: float | None = None,
        wait: bool = True,
    ) -> Motion:
        """Move the tool centre point on a straight line, and turn it by the shortest way.

        Args:
            pose: Target of the tool centre point.
            frame: Frame in which `pose` is given, as a pose in the base frame; None for the base frame.
            velocity: Largest speed of the tool [m/s].
            acceleration: Largest acceleration of the tool [m/s²].
            jerk: Largest jerk of the tool [m/s³].
            duration: Duration of the motion before shaping [s], instead of the three limits above; one too short for
                the arm takes longer.
            wait: Whether to wait for the end; see `move_j`.

        Raises:
            RefusedError: The line passes a singular posture, a pose out of reach or an obstacle; the message says at
                which share of the way.
            MotionStoppedError: The motion ended before its target.
        """
        return Motion(
            self._portal,
            self._portal.call(
                lambda: self._arm.move_l(
                    pose,
                    frame=frame,
                    velocity=velocity,
                    acceleration=acceleration,
                    jerk=jerk,
                    duration=duration,
                    wait=wait,
                )
            ),
        )

    def move_c(
        self,
        via: Iterable[float],
        pose: Iterable[float],
        *,
        frame: Iterable[float] | None = None,
        orientation: Orientation = "interpolated",
        velocity: float = 0.25,
        acceleration: float = 1.2,
        jerk: float = 60.0,
        wait: bool = True,
    ) -> Motion:
        """Move the tool centre point on the circular arc through the positions of `via` and `pose`.

        Args:
            via: A pose on the arc, of which only the position counts.
            pose: Target of the tool centre point.
            frame: Frame in which both are given, as a pose in the base frame; None for the base frame.
            orientation: `interpolated` turns the tool to the orientation of `pose` by the shortest way; `tangent` keeps
                its orientation relative to the arc's tangent, and ignores that of `pose`.
            velocity: Largest speed of the tool [m/s].
            acceleration: Largest acceleration of the tool along the arc [m/s²].
            jerk: Largest jerk of the tool [m/s³].
            wait: Whether to wait for the end; see `move_j`.

        Raises:
            RefusedError: There is no such arc, or the arm cannot follow it.
            MotionStoppedError: The motion ended before its target.
        """
        return Motion(
            self._portal,
            self._portal.call(
                lambda: self._arm.move_c(
                    via,
                    pose,
                    frame=frame,
                    orientation=orientation,
                    velocity=velocity,
                    acceleration=acceleration,
                    jerk=jerk,
                    wait=wait,
                )
            ),
        )

    def move_path(
        self,
        segments: Iterable[Segment],
        *,
        frame: Iterable[float] | None = None,
        jerk: float = 60.0,
        wait: bool = True,
    ) -> Motion:
        """Move along a path of several parts, without stopping where they are blended.

        Args:
            segments: Parts of the path in their order, at most 500: `LineSegment`, `ArcSegment`, `ProcessSegment` and
                `JointSegment`, each of which begins where the previous one ends. A blend that does not fit is left
                out; an event of the kind `warning` and the code `blend_skipped` then says so.
            frame: Frame in which all poses are given, as a pose in the base frame; None for the base frame.
            jerk: Largest jerk of the tool [m/s³]; of the joints on joint segments, four times the number [rad/s³].
            wait: Whether to wait for the end; see `move_j`.

        Raises:
            RefusedError: The arm cannot follow the path; the field in the message names the part.
            MotionStoppedError: The motion ended before its target.
        """
        return Motion(
            self._portal,
            self._portal.call(lambda: self._arm.move_path(segments, frame=frame, jerk=jerk, wait=wait)),
        )

    def servo_j(
        self,
        q: Iterable[float],
        *,
        lookahead: float = 0.1,
        gain: float = 300.0,
        shaped: bool = False,
        duration: float | None = None,
    ) -> Motion:
        """Approach a posture, and follow it if more come one after the other.

        Args:
            q: Posture [rad].
            lookahead: Lag behind a moving posture, besides two steps [s]; values outside 0.03 to 0.2 are clipped.
            gain: How abruptly the arm begins to approach it [1/s²]; values outside 100 to 2000 are clipped.
            shaped: Whether the shaper is used; only for a motion that begins at rest.
            duration: Time after which this returns [s]; None for at once.
        """
        return Motion(
            self._portal,
            self._portal.call(
                lambda: self._arm.servo_j(q, lookahead=lookahead, gain=gain, shaped=shaped, duration=duration)
            ),
        )

    def speed_j(
        self,
        qd: Iterable[float],
        acceleration: float = 1.4,
        *,
        shaped: bool = False,
        duration: float | None = None,
    ) -> Motion:
        """Accelerate to velocities of the joints and keep them, also after `duration`.

        Args:
            qd: Velocities, one per joint [rad/s].
            acceleration: Acceleration of the joint whose velocity changes most [rad/s²]; the others change in phase.
            shaped: Whether the shaper is used; only for a motion that begins at rest.
            duration: Time after which this returns [s]; None for at once.
        """
        return Motion(
            self._portal,
            self._portal.call(lambda: self._arm.speed_j(qd, acceleration, shaped=shaped, duration=duration)),
        )

    def speed_l(
        self,
        xd: Iterable[float],
        acceleration: float = 1.2,
        *,
        angular_acceleration: float | None = None,
        shaped: bool = False,
        duration: float | None = None,
    ) -> Motion:
        """Accelerate to a velocity of the tool and keep it, also after `duration`.

        Args:
            xd: Velocity vx vy vz [m/s] and angular velocity wx wy wz [rad/s] of the tool centre point, base frame.
            acceleration: Acceleration of the tool [m/s²].
            angular_acceleration: Angular acceleration of the tool [rad/s²]; None for the number of `acceleration`.
            shaped: Whether the shaper is used; only for a motion that begins at rest.
            duration: Time after which this returns [s]; None for at once.
        """
        return Motion(
            self._portal,
            self._portal.call(
                lambda: self._arm.speed_l(
                    xd,
                    acceleration,
                    angular_acceleration=angular_acceleration,
                    shaped=shaped,
                    duration=duration,
                )
            ),
        )

    def stop_j(self, acceleration: float = 2.0) -> None:
        """Come to rest with a deceleration of the joints, and wait for that; a planned motion stays on its path.

        Args:
            acceleration: Deceleration of the joint that is fastest [rad/s²].
        """
        self._portal.call(lambda: self._arm.stop_j(acceleration))

    def stop_l(self, acceleration: float = 1.2, *, angular_acceleration: float | None = None) -> None:
        """Come to rest with a deceleration of the tool, and wait for that; a planned motion stays on its path.

        Args:
            acceleration: Deceleration of the tool [m/s²].
            angular_acceleration: Angular deceleration of the tool [rad/s²]; None for the number of `acceleration`.
        """
        self._portal.call(lambda: self._arm.stop_l(acceleration, angular_acceleration=angular_acceleration))

    def force_mode(
        self,
        compliant: Iterable[bool],
        wrench: Iterable[float],
        *,
        limits: Iterable[float] = (0.1, 0.1, 0.1, 0.5, 0.5, 0.5),
        frame: Iterable[float] | None = None,
        frame_type: FrameType = 2,
        damping: float = 0.005,
        gain: float = 1.0,
    ) -> Motion:
        """Give way along and about the compliant axes of a frame until a wrench is reached.

        In the other axes the arm stands, or moves by `servo_j`, `speed_j` and `speed_l`. A further call changes what
        is to be reached; `end_force_mode`, any stop and the end of control end it.

        Args:
            compliant: Which axes give way: three directions of the frame, then the turns about them.
            wrench: What the arm exerts on its environment in these: force [N] and torque [N m].
            limits: Speed limit of each compliant axis [m/s, rad/s]; largest deviation of each other one [m, rad].
            frame: The frame, as a pose in the base frame; None for the base frame.
            frame_type: 1: the frame is turned so that its y axis points from the tool to its origin; 2: it stays; 3: it
                is turned so that its x axis is the tool's velocity projected into its x-y plane.
            damping: How quickly the arm slows down where nothing touches it, 0 to 1.
            gain: Factor of the difference between wanted and felt wrench, 0 to 2.
        """
        return Motion(
            self._portal,
            self._portal.call(
                lambda: self._arm.force_mode(
                    compliant,
                    wrench,
                    limits=limits,
                    frame=frame,
                    frame_type=frame_type,
                    damping=damping,
                    gain=gain,
                )
            ),
        )

    def freedrive(
        self, free: Iterable[bool] = (True,) * 6, frame: Iterable[float] | Literal["base", "tool"] = "base"
    ) -> Motion:
        """Let people move the arm by hand, until `end_force_mode`, a stop or the end of control.

        Args:
            free: Along which directions of the frame, and about which, it can be moved.
            frame: The frame: that of the base or of the tool, or a pose in the base frame.
        """
        return Motion(self._portal, self._portal.call(lambda: self._arm.freedrive(free, frame)))

    def end_force_mode(self) -> None:
        """End `force_mode` or `freedrive`, and wait until the arm is at rest."""
        self._portal.call(self._arm.end_force_mode)

    def zero_ftsensor(self) -> None:
        """Take the present force and torque at the tool as zero."""
        self._portal.call(self._arm.zero_ftsensor)

    def set_digital_output(self, number: int, on: bool) -> None:
        """Switch a digital output: 0–7 standard, 8–15 configurable, 16–17 tool."""
        self._portal.call(lambda: self._arm.set_digital_output(number, on))

    def set_analog_output(self, number: int, share: float, *, voltage: bool = False) -> None:
        """Set an analogue output.

        Args:
            number: 0 or 1.
            share: Value as a share of the output's range [-].
            voltage: Whether the range is 0 to 10 V; otherwise it is 4 to 20 mA.
        """
        self._portal.call(lambda: self._arm.set_analog_output(number, share, voltage=voltage))

    def set_registers(self, bank: Bank, values: Iterable[float], first: int = 0) -> None:
        """Write consecutive registers.

        Args:
            bank: Bank of registers: `input_int`, `output_double` …
            values: Booleans, integers or numbers, depending on the bank.
            first: Number of the first register.
        """
        self._portal.call(lambda: self._arm.set_registers(bank, values, first))

    def set_digital_input(self, number: int, on: bool) -> None:
        """Switch a digital input, as a device connected to it would: 0–7 standard, 8–15 configurable, 16–17 tool."""
        self._portal.call(lambda: self._arm.set_digital_input(number, on))

    def reset(
        self,
        q: Iterable[float] | None = None,
        *,
        seed: int | None = None,
        payload: Payload | None = None,
        mode: ResetMode | None = None,
        shaper: str | None = None,
    ) -> int | None:
        """Put the simulated arm at rest in a given state; arguments that are None change nothing.

        Args:
            q: Configuration to put the arm into [rad].
            seed: New seed of the sensors' noise.
            payload: Payload that the arm carries, independent of the declared one; see `make_payload`.
            mode: Robot mode to set.
            shaper: Shaper to select.

        Returns:
            The tick at which this was done.
        """
        return self._portal.call(
            lambda: self._arm.reset(q, seed=seed, payload=payload, mode=mode, shaper=shaper)
        )

    def step(self, ticks: int, setpoints: Sequence[StepSetpoint] | None = None) -> int:
        """Advance time by 1 to 100000 ticks at once, in lockstep and free; `Robot.advance` takes any number.

        If this client also holds the clock (`Robot.clock_control`), the clock's token is used.

        Args:
            ticks: Number of control periods.
            setpoints: Set-points of a running stream, at most 1000, in order and one per tick; `Servo.step_through`
                numbers them.

        Returns:
            The last tick that passed; its state has arrived.
        """
        return self._portal.call(lambda: self._arm.step(ticks, setpoints))

    def inject(
        self,
        fault: str,
        *,
        joint: int | None = None,
        seconds: float | None = None,
        value: float | None = None,
    ) -> None:
        """Cause a deliberate fault; the protocol's README lists them.

        Args:
            fault: Name of the fault.
            joint: Index of the joint that it affects, 0 for the base.
            seconds: Duration of the fault [s].
            value: Magnitude of the fault, in the fault's own unit.
        """
        self._portal.call(lambda: self._arm.inject(fault, joint=joint, seconds=seconds, value=value))

    @property
    def token(self) -> str:
        """Token of the lease, sent with every command."""
        return self._arm.token


class Robot:
    """One robot, over an open transport, which `close` closes."""

    def __init__(self, portal: Portal, robot: robot.Robot) -> None:
        self._portal, self._robot = portal, robot

    def info(self) -> Info:
        """Request the robot's description and settings.

        Raises:
            RefusedError: The robot is still starting; the message says how far that is.
        """
        return self._portal.call(self._robot.info)

    def clock(self) -> Clock:
        """What advances simulation time; requested only once."""
        return self._portal.call(self._robot.clock)

    def state(self) -> State:
        """Return the present state: in real time the next one to arrive, otherwise the last one.

        Before the first tick, the state describes the arm at rest. In lockstep the first call may take a second.

        Raises:
            AnswerTimeoutError: No state arrived within `STATE_S`.
            MisuseError: An in-process host other than this project's publishes no state before its first tick.
            NotConnectedError: The connection is closed, or the robot has disconnected.
        """
        return self._portal.call(self._robot.state)

    def request(self, command: Command, timeout_s: float = ANSWER_S) -> Answer:
        """Send any command.

        Args:
            command: The command, with its token if it has one.
            timeout_s: How long the robot may take [s].

        Raises:
            RefusedError: The robot refused it, which changed nothing.
            NotConnectedError: The robot does not answer.
            DeniedError: This client's certificate is not an operator's.
            AnswerTimeoutError: No answer came in time.
            ProtocolError: The command contains a value that cannot be sent.
        """
        return self._portal.call(lambda: self._robot.request(command, timeout_s))

    def stop(self) -> None:
        """Bring the arm to rest now; no control is needed."""
        self._portal.call(self._robot.stop)

    @contextlib.contextmanager
    def control(self, client: str, *, lease_s: float = 30.0) -> Iterator[Arm]:
        """Hold control for the duration of a block.

        The client's presence is announced first, so that control ends at once if it disconnects; in real time the
        lease is renewed in the background.

        Args:
            client: Name of this client, shown to others.
            lease_s: How long control lasts without renewal [s].

        Raises:
            RefusedError: Another client has control; the message contains its name.
            ProtocolError: `client` is not a valid client name.
        """
        with self._portal.enter(self._robot.control(client, lease_s=lease_s)) as entered:
            yield Arm(self._portal, entered)

    @contextlib.contextmanager
    def clock_control(self, client: str) -> Iterator[Stepper]:
        """Hold the clock for the duration of a block, so that time passes only by this client's steps.

        This works in lockstep and free. It is independent of control, which another client may have at the same time.

        Args:
            client: Name of this client, shown to others; the clock is released when it disconnects.

        Raises:
            RefusedError: Another client holds the clock, whose name is in the message; or time passes by itself.
            ProtocolError: `client` is not a valid client name.
        """
        with self._portal.enter(self._robot.clock_control(client)) as entered:
            yield Stepper(self._portal, entered)

    def advance(self, ticks: int) -> int:
        """Advance time: by steps in lockstep and free, by waiting in real time.

        Args:
            ticks: Number of control periods, at least 1.

        Returns:
            The last tick that passed; its state has arrived.

        Raises:
            ArgumentError: `ticks` is less than 1, or not an integer.
            MisuseError: Not in real time, and this client has neither the clock nor control.
            RefusedError: Another client holds the clock; the message contains its name.
        """
        return self._portal.call(lambda: self._robot.advance(ticks))

    def rest(self) -> State:
        """Step time until the shaped reference is at rest, or wait if another client steps; the arm may still vibrate.

        Returns:
            The first state received in which it is at rest.
        """
        return self._portal.call(self._robot.rest)

    def states(self, buffer: int = BUFFER) -> Stream[State]:
        """Iterate over every state from now on, one per tick. If the reader is slow, the oldest are dropped.

        Args:
            buffer: Number of messages that may wait; those dropped are counted in `Stream.dropped`.
        """
        return Stream(self._portal, self._portal.run(lambda: self._robot.states(buffer)))

    def events(self, buffer: int = BUFFER) -> Stream[Event]:
        """Iterate over every event from now on."""
        return Stream(self._portal, self._portal.run(lambda: self._robot.events(buffer)))

    def on_state(self, callback: Callable[[State], object]) -> Callable[[], None]:
        """Call a function, which must not block, with every state; the function returned ends that."""
        return self._portal.subscription(lambda: self._robot.on_state(callback))

    def on_event(self, callback: Callable[[Event], object]) -> Callable[[], None]:
        """Call a function with every event; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_event(callback))

    def on_truth(self, callback: Callable[[Truth], object]) -> Callable[[], None]:
        """Call a function with every truth message, if the server publishes them; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_truth(callback))

    def on_telemetry(self, callback: Callable[[Telemetry], object]) -> Callable[[], None]:
        """Call a function with every telemetry message, once a second; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_telemetry(callback))

    def on_io(self, callback: Callable[[Io], object]) -> Callable[[], None]:
        """Call a function with every message about inputs, outputs, registers and tool; see `on_state`."""
        return self._portal.subscription(lambda: self._robot.on_io(callback))

    def io(self) -> Io:
        """Return inputs, outputs, registers and tool: the latest known values, else the next ones within about 1 s.

        Raises:
            AnswerTimeoutError: No message arrived within `STATE_S`.
        """
        return self._portal.call(self._robot.io)

    def inverse_kinematics(
        self,
        pose: Iterable[float],
        *,
        near: Iterable[float] | None = None,
        tcp_offset: Iterable[float] | None = None,
        frame: Iterable[float] | None = None,
    ) -> tuple[float, ...]:
        """Return joint positions at which the tool has a pose, the nearest of all.

        Args:
            pose: Pose of the tool centre point.
            near: Posture to which the answer should be nearest [rad]; None for the present reference.
            tcp_offset: Tool centre point in the flange frame; None for that of `Arm.set_tcp`.
            frame: Frame in which `pose` is given, as a pose in the base frame; None for the base frame.

        Returns:
            One angle per joint [rad].

        Raises:
            RefusedError: No joint positions reach the pose: the code is `no_solution`.
        """
        return self._portal.call(
            lambda: self._robot.inverse_kinematics(pose, near=near, tcp_offset=tcp_offset, frame=frame)
        )

    def forward_kinematics(
        self,
        q: Iterable[float] | None = None,
        *,
        tcp_offset: Iterable[float] | None = None,
        frame: Iterable[float] | None = None,
    ) -> tuple[float, float, float, float, float, float]:
        """Return the pose that the tool has at joint positions.

        Args:
            q: Posture [rad]; None for the present reference.
            tcp_offset: Tool centre point in the flange frame; None for that of `Arm.set_tcp`.
            frame: Frame in which the answer is given, as a pose in the base frame; None for the base frame.

        Returns:
            Pose of the tool centre point.
        """
        return self._portal.call(
            lambda: self._robot.forward_kinematics(q, tcp_offset=tcp_offset, frame=frame)
        )
