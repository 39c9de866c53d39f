"""Values with one entry for each joint."""

from tvist_controller.instruments.joint_lists import SHAPED, UNSHAPED
from tvist_controller.instruments.ratings import BUS_VOLTAGE
from tvist_controller.instruments.reading import Reading
from tvist_controller.instruments.variables import Double, Vector6D, computed_once

DEVIATION = 0.05
"""Difference between measured and shaped angle that counts as 1 [rad]."""


class JointValues(Reading):
    """Motion, torque and electricity of the joints."""

    @property
    def shaped_q(self) -> Vector6D:
        """State: reference after shaping, which the drives follow; a variable that only TVIST has [rad]."""
        return self.state.target_q

    @property
    def shaped_qd(self) -> Vector6D:
        """State: velocity of the reference after shaping; a variable that only TVIST has [rad/s]."""
        return self.state.target_qd

    @property
    def shaped_qdd(self) -> Vector6D:
        """State: acceleration of the reference after shaping; a variable that only TVIST has [rad/s²]."""
        return self.state.target_qdd

    @computed_once
    def target_moment(self) -> Vector6D:
        """Computed: torque that the rigid model with the declared payload needs for the target motion [N m].

        It is that of the state, which belongs to the shaped reference, plus the difference between the two references.
        """
        state, moment = self.state, self.state.target_moment
        if state.unshaped_q is None:
            return moment
        motion, payload = self._motion, self.io.payload
        unshaped = self._rigid.moment(motion[UNSHAPED], payload)
        shaped = self._rigid.moment(motion[SHAPED], payload)
        return [m + (u - s) for m, u, s in zip(moment, unshaped, shaped, strict=True)]

    @computed_once
    def target_current(self) -> Vector6D:
        """Computed: target torque over torque constant; zero while the brakes hold the arm [A]."""
        if not self.driven:
            return [0.0] * len(self._ratings)
        moment = self.target_moment
        return [m / rating.torque_constant for m, rating in zip(moment, self._ratings, strict=True)]

    @property
    def actual_q(self) -> Vector6D:
        """State: measured angle, on the link's side of the gear [rad]."""
        return self.state.actual_q

    @property
    def actual_qd(self) -> Vector6D:
        """State: measured velocity [rad/s]."""
        return self.state.actual_qd

    @property
    def actual_moment(self) -> list[float]:
        """State: measured torque [N m]."""
        return self.state.actual_moment

    @property
    def actual_current(self) -> Vector6D:
        """Computed: measured torque over torque constant; zero while the brakes hold the arm [A]."""
        return self._current

    @computed_once
    def actual_current_window(self) -> Vector6D:
        """Constant: allowed difference of the two currents, from a tenth of the joint's largest torque [A]."""
        return [rating.window for rating in self._ratings]

    @property
    def actual_current_as_torque(self) -> Vector6D:
        """State: measured torque; zero while the brakes hold the arm [N m]."""
        return self.state.actual_moment if self.driven else [0.0] * len(self._ratings)

    @property
    def joint_control_output(self) -> Vector6D:
        """Computed: the measured currents, since a simulated motor has the current that its drive asks for [A]."""
        return self.actual_current

    @property
    def actual_joint_voltage(self) -> Vector6D:
        """Constant: 48 while the arm has power, else 0 [V]."""
        return [BUS_VOLTAGE if self.powered else 0.0] * len(self._ratings)

    @property
    def joint_temperatures(self) -> Vector6D:
        """Computed: one body per joint in air of 25 °C, heated by its electronics and R i² in about 20 minutes [°C]."""
        return self._temperatures

    @computed_once
    def joint_position_deviation_ratio(self) -> Double:
        """Computed: largest difference of measured and shaped angle, divided by 0.05 rad [-]."""
        state = self.state
        return max(abs(a - t) for a, t in zip(state.actual_q, state.target_q, strict=True)) / DEVIATION
