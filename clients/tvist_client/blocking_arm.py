"""Objects that the blocking client's robot returns: an arm, its streams, and the clock."""

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from tvist_client import servo as asynchronous_servo
from tvist_client import stepper as asynchronous_stepper
from tvist_client.blocking_moves import Guiding, Moves
from tvist_client.portal import Portal
from tvist_protocol.io import Bank
from tvist_protocol.simulation import StepSetpoint
from tvist_protocol.values import Payload, ResetMode


class Servo:
    """A stream of set-points; see `tvist_client.servo.Servo`."""

    def __init__(self, portal: Portal, servo: asynchronous_servo.Servo) -> None:
        self._portal = portal
        self._servo = servo

    @property
    def period(self) -> float:
        """Time between two set-points [s]."""
        return self._servo.period

    @property
    def sequence(self) -> int:
        """Number of the next set-point."""
        return self._servo.sequence

    def set(self, q: Iterable[float]) -> int:
        """Send the next set-point; to be called once per period."""
        return self._portal.run(lambda: self._servo.set(q))

    def step_through(self, qs: Iterable[Iterable[float]]) -> int:
        """Play set-points in lockstep and free, each for one period."""
        return self._portal.call(lambda: self._servo.step_through(qs))


class Arm(Moves, Guiding):
    """An arm under control; see `tvist_client.arm.Arm` for the arguments."""

    @property
    def token(self) -> str:
        """Token of the lease."""
        return self._arm.token

    @contextlib.contextmanager
    def servo(
        self,
        *,
        period: float = 0.002,
        velocity: float = 1.5,
        acceleration: float = 2.0,
        jerk: float = 100.0,
    ) -> Iterator[Servo]:
        """Stream set-points for as long as the block lasts; then come to rest."""
        stream = self._arm.servo(period=period, velocity=velocity, acceleration=acceleration, jerk=jerk)
        with self._portal.enter(stream) as servo:
            yield Servo(self._portal, servo)

    def stop(self, deceleration: float | None = None) -> None:
        """Come to rest now, bypassing the shaper."""
        self._portal.call(lambda: self._arm.stop(deceleration))

    def pause(self) -> None:
        """Bring the running motion to a standstill on its path."""
        self._portal.call(self._arm.pause)

    def resume(self) -> None:
        """Continue a paused motion."""
        self._portal.call(self._arm.resume)

    def set_speed(self, fraction: float) -> None:
        """Scale the speed of motions, as the slider of a teach pendant does."""
        self._portal.call(lambda: self._arm.set_speed(fraction))

    def power_on(self, *, release_brakes: bool = True) -> None:
        """Power on the arm and release its brakes."""
        self._portal.call(lambda: self._arm.power_on(release_brakes=release_brakes))

    def power_off(self) -> None:
        """Stop any motion, then power off the arm."""
        self._portal.call(self._arm.power_off)

    def unlock_protective_stop(self) -> None:
        """Unlock a protective stop; the arm must be at rest. In real time, check that it does not stop again."""
        self._portal.call(self._arm.unlock_protective_stop)

    def restart_safety(self) -> None:
        """Restart the safety system after a violation or a fault; afterwards the arm has no power."""
        self._portal.call(self._arm.restart_safety)

    def set_tcp(self, offset: Iterable[float]) -> None:
        """Set the tool centre point."""
        self._portal.call(lambda: self._arm.set_tcp(offset))

    def set_digital_output(self, number: int, on: bool) -> None:
        """Switch a digital output."""
        self._portal.call(lambda: self._arm.set_digital_output(number, on))

    def set_analog_output(self, number: int, share: float, *, voltage: bool = False) -> None:
        """Set an analogue output."""
        self._portal.call(lambda: self._arm.set_analog_output(number, share, voltage=voltage))

    def set_registers(self, bank: Bank, values: Iterable[float], first: int = 0) -> None:
        """Write consecutive registers."""
        self._portal.call(lambda: self._arm.set_registers(bank, values, first))

    def set_digital_input(self, number: int, on: bool) -> None:
        """Switch a digital input, as a device connected to it would."""
        self._portal.call(lambda: self._arm.set_digital_input(number, on))

    def load_program(self, name: str, text: str | None = None) -> None:
        """Load a program, which the robot knows or whose text is given; a running program is stopped first."""
        self._portal.call(lambda: self._arm.load_program(name, text))

    def run_program(self, text: str) -> None:
        """Start a program in URScript at once."""
        self._portal.call(lambda: self._arm.run_program(text))

    def close_popup(self) -> None:
        """Close the message that a program shows."""
        self._portal.call(self._arm.close_popup)

    def play_program(self) -> None:
        """Start the loaded program, or resume a paused one."""
        self._portal.call(self._arm.play_program)

    def pause_program(self) -> None:
        """Pause the program and its motion."""
        self._portal.call(self._arm.pause_program)

    def stop_program(self) -> None:
        """Stop the program, and the arm with it."""
        self._portal.call(self._arm.stop_program)

    def set_shaper(self, name: str, modes: int = 1) -> None:
        """Choose the input shaper."""
        self._portal.call(lambda: self._arm.set_shaper(name, modes))

    def set_estimator(
        self,
        name: str,
        *,
        f_d: float | Iterable[float] | None = None,
        zeta: float | Iterable[float] | None = None,
        calibration: str | Mapping[str, Any] | None = None,
    ) -> None:
        """Choose the estimator that provides the shaper with frequency and damping ratio."""
        self._portal.call(lambda: self._arm.set_estimator(name, f_d=f_d, zeta=zeta, calibration=calibration))

    def set_payload(self, mass: float, com: Iterable[float], inertia: Iterable[float]) -> None:
        """Declare the payload to the controller."""
        self._portal.call(lambda: self._arm.set_payload(mass, com, inertia))

    def reset(
        self,
        q: Iterable[float] | None = None,
        *,
        seed: int | None = None,
        payload: Payload | None = None,
        mode: ResetMode | None = None,
        shaper: str | None = None,
    ) -> int | None:
        """Put the simulated arm at rest in a given state."""
        return self._portal.call(
            lambda: self._arm.reset(q, seed=seed, payload=payload, mode=mode, shaper=shaper)
        )

    def step(self, ticks: int, setpoints: Sequence[StepSetpoint] | None = None) -> int:
        """Advance time by 1 to 100000 ticks at once, in lockstep and free."""
        return self._portal.call(lambda: self._arm.step(ticks, setpoints))

    def inject(
        self,
        fault: str,
        *,
        joint: int | None = None,
        seconds: float | None = None,
        value: float | None = None,
    ) -> None:
        """Cause a deliberate fault."""
        self._portal.call(lambda: self._arm.inject(fault, joint=joint, seconds=seconds, value=value))

    def hand_over(self, client: str) -> None:
        """Give control to another client."""
        self._portal.call(lambda: self._arm.hand_over(client))

    def keep_alive(self) -> None:
        """Renew the lease; `Robot.control` does this automatically."""
        self._portal.call(self._arm.keep_alive)


class Stepper:
    """The clock of a simulated robot; see `tvist_client.stepper.Stepper`."""

    def __init__(self, portal: Portal, stepper: asynchronous_stepper.Stepper) -> None:
        self._portal = portal
        self._stepper = stepper

    @property
    def token(self) -> str:
        """Token of the clock."""
        return self._stepper.token

    def step(self, ticks: int) -> int:
        """Advance time by 1 to 100000 ticks with one command."""
        return self._portal.call(lambda: self._stepper.step(ticks))

    def advance(self, ticks: int) -> int:
        """Advance time by any number of ticks."""
        return self._portal.call(lambda: self._stepper.advance(ticks))
