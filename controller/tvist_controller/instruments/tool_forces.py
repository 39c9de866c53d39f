"""External forces and torques on the arm in the last tick, computed on request."""

from collections.abc import Callable

import numpy as np

from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.instruments.report import Report
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import (
    ACTUAL_Q,
    ROWS,
    RUNNING,
    SHAPED,
    sensed_at_tool,
    without_weight,
)
from tvist_controller.line.line_tick import QDD, TORQUE, Q, Sample
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats
from tvist_plant.plant import GRAVITY, PERIOD
from tvist_protocol.values import Payload


class ToolForces:
    """External forces: measured by a force sensor at the flange if any, else estimated from drive torques."""

    def __init__(
        self,
        description: RobotDescription,
        peripherals: Peripherals,  # the tool centre point, and the wrench that counts as zero
        latest: Callable[[], Report],  # of the last tick
        declared: Callable[[], Payload],
    ) -> None:
        self._peripherals, self._latest = peripherals, latest
        self._rigid, self._declared = RigidBody(description), declared

    def torques(self) -> list[float]:
        """Return the external joint torques, shape (n,) [N m]."""
        return list(self._estimate()[6:].tolist())

    def wrench(self) -> list[float]:
        """Return external force and torque at the tool centre point, base frame [N, N m]."""
        sample = self._latest().sample
        if sample.wrench is None:
            found = self._since_zeroed(self._estimate()[:6])
        else:
            found = self._sensed(sample.wrench, sample.measured.q)
        return list(found.tolist())

    def zero(self) -> None:
        """Take present force and torque at the tool as zero; those of a sensor are stored in its frame."""
        sample = self._latest().sample
        if sample.wrench is None:
            found = self._estimate()[:6]
        else:
            rotation, _ = self._rigid.arm.pose(sample.measured.q)
            found = without_weight(sample.wrench, rotation, self._declared())
        self._peripherals.zero_wrench(found.tolist())

    def felt(self, sample: Sample) -> Floats:
        """Return `wrench` for a tick in which the drives hold the arm, shape (6,) [N, N m]."""
        if sample.wrench is not None:
            return self._sensed(sample.wrench, sample.measured.q)
        return self._since_zeroed(self._estimated(sample, sample.signals[TORQUE])[:6])

    def estimated(self, sample: Sample, qd_before: Floats) -> Floats:
        """Return the force estimated from drive torques and measured motion, shape (3,) [N].

        Links may lag behind their reference, in vibration or after late set-points. Unlike `felt`, this
        estimate excludes the forces that accelerate such links. The rotors are assumed to follow the
        reference.
        """
        measured = sample.measured
        motion = np.array([measured.q, measured.qd, (measured.qd - qd_before) / PERIOD])
        return self._estimated(sample, self._rigid.moment(motion, self._declared()))[:3]

    def _estimate(self) -> Floats:
        """Estimate the forces of the last tick from drive torques; zeros with closed brakes."""
        latest = self._latest()
        sample = latest.sample
        if latest.modes[0] != RUNNING:
            return np.zeros(6 + len(sample.measured.q))
        return self._estimated(sample, sample.signals[TORQUE])

    def _estimated(self, sample: Sample, torque: Floats | list[float]) -> Floats:
        measured = sample.measured
        rows = np.zeros((ROWS, len(measured.q)))
        rows[SHAPED], rows[SHAPED.stop] = sample.signals[Q : QDD + 1], torque
        rows[ACTUAL_Q:] = measured.q, measured.qd, measured.moment
        return self._rigid.external(rows, self._peripherals.tcp_offset)

    def _since_zeroed(self, found: Floats) -> Floats:
        zero = self._peripherals.wrench_zero
        return found if zero is None else found - zero

    @property
    def basis(self) -> tuple[object, ...]:
        """Quantities that forces depend on: the zero and the declared payload."""
        zero = self._peripherals.wrench_zero
        return None if zero is None else tuple(zero), self._declared()

    def forget_zero(self) -> None:
        """Remove the zero."""
        if self._peripherals.wrench_zero is not None:
            self._peripherals.zero_wrench(None)

    def unexplained(self, sample: Sample, wrench: Floats, *, zeroed: bool) -> Floats:
        """Return the force of a sensor's wrench minus weight and inertia force of the payload, (3,) [N].

        The payload's acceleration is that of the flange's accelerometer, which includes bending of links. If
        a plant has no accelerometer (zeros), only the weight is subtracted. `zeroed`: the zero was taken with
        this sensor.
        """
        measured, zero = sample.measured, self._peripherals.wrench_zero
        rotation, specific = self._rigid.arm.pose(measured.q)[0], measured.accelerometer
        if not specific.any():
            specific = GRAVITY * rotation[2]
        force = wrench[:3] - zero[:3] if zeroed and zero is not None else wrench[:3]
        return np.asarray(rotation @ (force + self._declared().mass * specific))

    def _sensed(self, raw: Floats, q: Floats) -> Floats:
        rotation, there = self._rigid.arm.pose(q)[0], self._peripherals
        return sensed_at_tool(raw, rotation, self._declared(), there.wrench_zero, there.tcp_offset)
