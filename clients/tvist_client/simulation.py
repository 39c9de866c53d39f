"""Commands for simulated arms only: placing the arm, stepping time, causing faults."""

from collections.abc import Iterable, Sequence

from tvist_client.leased import Leased
from tvist_client.stepper import step
from tvist_client.values import floats, number, whole
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject, SimulationReset, StepSetpoint
from tvist_protocol.values import Payload, ResetMode


class Simulation(Leased):
    """The part of `Arm` that requires a simulated arm."""

    async def reset(
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
        reply = await self.robot.request(
            SimulationReset(
                token=self.token,
                q=None if q is None else floats(q, "q"),
                seed=None if seed is None else whole(seed, "seed", 0),
                payload=payload,
                mode=mode,
                shaper=shaper,
            )
        )
        return reply.tick if isinstance(reply, Done) else None

    async def step(self, ticks: int, setpoints: Sequence[StepSetpoint] | None = None) -> int:
        """Advance time by 1 to 100000 ticks at once, in lockstep and free; `Robot.advance` takes any number.

        If this client also holds the clock (`Robot.clock_control`), the clock's token is used.

        Args:
            ticks: Number of control periods.
            setpoints: Set-points of a running stream, at most 1000, in order and one per tick; `Servo.step_through`
                numbers them.

        Returns:
            The last tick that passed; its state has arrived.
        """
        clock_token = self.robot.clock_token
        if clock_token is None:
            return await step(self.robot, self.token, ticks, setpoints)
        motion_token = None if setpoints is None else self.token
        return await step(self.robot, clock_token, ticks, setpoints, motion_token)

    async def inject(
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
        await self.robot.request(
            SimulationInject(
                token=self.token,
                fault=fault,
                joint=None if joint is None else whole(joint, "joint", 0),
                seconds=None if seconds is None else number(seconds, "seconds"),
                value=None if value is None else number(value, "value"),
            )
        )
