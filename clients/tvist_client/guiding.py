"""Motions of an arm under control that each command replaces: servoing and speeds, and the stops that end them."""

from collections.abc import Iterable

from tvist_client.leased import Leased
from tvist_client.motion import Motion
from tvist_client.servo import TICK
from tvist_client.values import floats, number, optional_number, positive, twist_of
from tvist_protocol.motions import ServoJ, SpeedJ, SpeedL, StopJ, StopL


class Guiding(Leased):
    """The part of `Arm` that guides it without a plan.

    Each command takes over any motion at once, and the arm obeys it until another comes. With `duration`, a
    method returns after that much of the robot's time; in lockstep and free, time is stepped. The arm then **keeps its
    speed**, as after UR's `speedj`: `stop_j` and `stop_l` stop it, and so does the end of control.

    Such commands share one `Motion` until the arm rests or a stop begins. A planned motion that is taken over ends.
    """

    async def servo_j(
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
        return await self._guide(
            ServoJ(
                token=self.token,
                q=floats(q, "q"),
                lookahead=number(lookahead, "lookahead"),
                gain=number(gain, "gain"),
                shaped=shaped,
            ),
            duration,
        )

    async def speed_j(
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
        return await self._guide(
            SpeedJ(
                token=self.token,
                qd=floats(qd, "qd"),
                acceleration=number(acceleration, "acceleration"),
                shaped=shaped,
            ),
            duration,
        )

    async def speed_l(
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
        return await self._guide(
            SpeedL(
                token=self.token,
                xd=twist_of(xd, "xd"),
                acceleration=number(acceleration, "acceleration"),
                angular_acceleration=optional_number(angular_acceleration, "angular_acceleration"),
                shaped=shaped,
            ),
            duration,
        )

    async def stop_j(self, acceleration: float = 2.0) -> None:
        """Come to rest with a deceleration of the joints, and wait for that; a planned motion stays on its path.

        Args:
            acceleration: Deceleration of the joint that is fastest [rad/s²].
        """
        await self.robot.request(StopJ(token=self.token, acceleration=number(acceleration, "acceleration")))
        await self.robot.rest()

    async def stop_l(self, acceleration: float = 1.2, *, angular_acceleration: float | None = None) -> None:
        """Come to rest with a deceleration of the tool, and wait for that; a planned motion stays on its path.

        Args:
            acceleration: Deceleration of the tool [m/s²].
            angular_acceleration: Angular deceleration of the tool [rad/s²]; None for the number of `acceleration`.
        """
        await self.robot.request(
            StopL(
                token=self.token,
                acceleration=number(acceleration, "acceleration"),
                angular_acceleration=optional_number(angular_acceleration, "angular_acceleration"),
            )
        )
        await self.robot.rest()

    async def _guide(self, command: ServoJ | SpeedJ | SpeedL, duration: float | None) -> Motion:
        seconds = None if duration is None else positive(duration, "duration")
        motion = await self._begin(command)
        if seconds is not None:
            await self.robot.pass_time(max(round(seconds / TICK), 1))
        return motion
