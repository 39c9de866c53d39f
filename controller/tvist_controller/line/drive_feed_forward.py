"""Choice between paper's and elastic feed-forward for the drives, with a smooth transition."""

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.joint_controllers import LAW, STICTION, WINDUP, YIELDING, joint_rows
from tvist_controller.line.line_tick import Q_R, QD_R, STATIC, TORQUE, TORQUE_FF, MotorReference, Q
from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD

FADE = 150  # duration of the transition in motion [ticks]


class DriveFeedForward:
    """The paper's feed-forward, or elastic feed-forward while a shaper uses that.

    Commands of the two kinds belong to different ticks and contain different shares of wind-up, so in motion
    one kind fades into the other; at rest they are equal. For `compensate_sag` and `positions` see
    `joint_rows`.
    """

    def __init__(
        self,
        description: RobotDescription,
        *,
        compensate_sag: bool = False,
        positions: bool = False,
    ) -> None:
        self.law: Floats | None = None
        """Known friction (`LAWS`) to feed forward from the next rest on; None for a fraction of the description's."""
        self.rows = joint_rows(description, compensate_sag=compensate_sag, positions=positions)
        """Parameters and state of the paper's joint controllers, see `joint_controllers`."""
        self._sags = compensate_sag and not positions
        self.wanted: ElasticFeedForward | None = None
        """Elastic feed-forward in use, or next after a transition; None for the paper's."""
        self._elastic: ElasticFeedForward | None = None
        self._share, self._rising = 0, False
        self._rate = 1.0 / (FADE * PERIOD)
        self.reference: MotorReference | None = None
        """Motion of the motors in the last command; None without elastic feed-forward."""

    @property
    def delay(self) -> float:
        """Delay of commands behind those of the paper's feed-forward [s]."""
        return 0.0 if self.wanted is None else self.wanted.delay

    def _rely_on_law(self) -> None:
        self.rows[LAW:] = 0.0
        if self.law is not None:
            self.rows[LAW : LAW + len(self.law)] = self.law

    def rest(self) -> None:
        """If no motor leads its joint, complete a transition at once: both feed-forwards are then equal."""
        self._rely_on_law()
        if self._elastic is self.wanted and self._share == self._full:
            return
        if self._elastic is None or self._share == 0 or self._elastic.settled:
            self._begin()
            self._share = self._full

    def reset(self, gravity: Floats) -> None:
        """Restart at rest with the torque that balances gravity, shape (n,) [N m]."""
        self._rely_on_law()
        self.rows[WINDUP], self.rows[STICTION] = self.rows[YIELDING] * gravity, 0.0
        self._begin()
        self._share = self._full

    def command(
        self,
        signals: Floats,  # the target, its torques and the paper's command, see `line_tick`
        carried: Floats,  # inertial parameters of the payload, see `InverseDynamics.payload_parameters`
        *,
        may_begin: bool = True,
        may_go_on: bool = True,
    ) -> DriveCommand:
        """Return the drive command for a target.

        `may_begin`, `may_go_on`: the reference is smooth enough to begin or continue elastic feed-forward. A
        stop is smooth enough to continue it. An unshaped guided motion may jump in acceleration, which motors
        cannot lead.
        """
        if self._elastic is not None or self.wanted is not None:
            self._fade(may_begin if self._share == 0 else may_go_on)
        elastic, plain = self._elastic, DriveCommand(signals[Q_R], signals[QD_R], signals[TORQUE_FF])
        if elastic is None or self._share == 0:
            self.reference = None
            return plain
        sag = self.rows[YIELDING] * signals[STATIC] if self._sags else None
        command = elastic.command(signals[Q : TORQUE + 1], carried, sag, smooth=may_begin)
        motors = elastic.motors
        if self._share < FADE:
            command = self._blend(plain, command)
            motors = np.array([command.qd, motors[1], command.torque])
        self.reference = MotorReference(motors, elastic.limited)
        return command

    @property
    def _full(self) -> int:
        return 0 if self.wanted is None else FADE

    def _begin(self) -> None:
        self._elastic, self._share, self._rising = self.wanted, 0, False
        if self._elastic is not None:
            self._elastic.reset(self.rows[STICTION])

    def _fade(self, smooth: bool) -> None:
        """Advance the transition by a tick; a transition is completed before the reverse one begins."""
        if self._share == 0 and self._elastic is not self.wanted:
            self._begin()
        rises = smooth and self._elastic is not None and self._elastic is self.wanted
        if self._share == 0 and rises and self._elastic is not None:
            # Its lead depends on past ticks; forget those of earlier motions.
            self._elastic.reset(self.rows[STICTION])
        if self._share in {0, FADE}:
            self._rising = rises
        # Complete each transition, since `_blend` adds the rate of a complete one.
        self._share = min(max(self._share + (1 if self._rising else -1), 0), FADE)

    def _blend(self, plain: DriveCommand, elastic: DriveCommand) -> DriveCommand:
        """Blend both commands; the velocity is the derivative of the position."""
        x = self._share / FADE
        # Quintic with zero velocity and acceleration at both ends.
        share = x * x * x * (10.0 - x * (15.0 - 6.0 * x))
        rate = 30.0 * (x * (1.0 - x)) ** 2 * (self._rate if self._rising else -self._rate)
        away = elastic.q - plain.q
        return DriveCommand(
            q=plain.q + share * away,
            qd=plain.qd + share * (elastic.qd - plain.qd) + rate * away,
            torque=plain.torque + share * (elastic.torque - plain.torque),
        )
