"""Detection of a wrong payload from the torque that the drives' feedback adds to the feed-forward."""

from typing import ClassVar

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.arm import SLEW, Arm
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_tick import QD, QDD, Q, Sample
from tvist_controller.motion.monitors import Monitor, MonitorFinding
from tvist_plant.chain import BODY, torques
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import carries_weight
from tvist_plant.plant import GRAVITY, PERIOD

TICKS_AVERAGED = 10  # ticks averaged per measurement
MEMORY = 2.0  # time constant of the memory, many periods of a vibration [s]
RECENT = 0.1
"""Shorter time constant for the mass in a warning, because the long memory includes the time before a pick-up [s]."""
ENOUGH = 1.0  # Observation time before a judgement [s]
TOLERATED = 0.5  # tolerated error of the declared mass [kg]
FRICTION = 0.4  # fraction of each joint's Coulomb friction that may be unknown, with the worst sign [-]
STUDIED = 1.0  # time at rest after which a robot that learns its payload has studied a motion [s]
PATIENCE = 20.0  # longest time that a doubt waits for that [s]


@compiled_for_ticks
def correlate(
    chain: Floats,  # of which only the kilogram has mass, see `tvist_plant.chain`, shape (n+1, 22)
    q: Floats,  # shape (n,) [rad]
    qd: Floats,
    qdd: Floats,
    scratch: Floats,  # shape (n+1, 28)
    friction: Floats,  # F of each joint, shape (n,) [N m]
    feedback: Floats,  # sum of r over `TICKS_AVERAGED` ticks, shape (n,) [N m]; set to zero
    fade: Floats,  # what is left of each memory after these ticks, shape (2,) [-]
    sums: Floats,  # yᵀ W y [1/kg²], yᵀ W r and φ Σ |y_j| W_j F_j [1/kg] in each memory, shape (3, 2); changed
) -> None:
    """Correlate the drives' feedback with the torques y of one kilogram."""
    per_kg = np.empty(q.shape[0])
    torques(chain, q, qd, qdd, GRAVITY, scratch, per_kg)
    square = product = bound = 0.0
    for j in range(q.shape[0]):
        weighted = per_kg[j] / (friction[j] * friction[j])
        square += weighted * per_kg[j]
        product += weighted * feedback[j]
        bound += abs(weighted) * friction[j]
        feedback[j] = 0.0
    for memory in range(fade.shape[0]):
        sums[0, memory] = fade[memory] * sums[0, memory] + square
        sums[1, memory] = fade[memory] * sums[1, memory] + product / TICKS_AVERAGED
        sums[2, memory] = fade[memory] * sums[2, memory] + FRICTION * bound


class PayloadMonitor(Monitor):
    """Compares the declared payload with drive torques, in motion and at rest.

    The torque r that a drive's feedback adds to the feed-forward is what the model does not explain. A mass error μ
    adds y(q, q̇, q̈) μ, with y the torque of 1 kg at the declared centre of mass. The estimate over some time is

        μ = Σ yᵀ W r / Σ yᵀ W y,   W = diag(1/F²),      |error of μ| <= Σ_j Σ |y_j| W_j φ F_j / Σ yᵀ W y

    where the bound covers unknown friction of up to φF per joint. Vibrations have zero mean and cancel. A warning
    requires that μ exceed the bound plus the tolerated error, so there is none in an upright posture, where gravity has
    no lever arm.

    Arms with only vertical axes are not judged: they feel the payload only in acceleration, delayed by soft joints. A
    changed frequency would be less clear, and visible only in vibration: 3 kg instead of 5 kg change the frequency by a
    fifth, but the shoulder's torque by half.

    A robot that learns its payload does so after a motion. The warning waits until a motion has been studied in vain,
    and then refers to the assumed payload, so that there is one verdict at a time.
    """

    needs: ClassVar = "drives alone"  # else contact of the tool would look like a payload

    def __init__(self, description: RobotDescription, declared: Payload, *, follows: bool = False) -> None:
        self._follows = follows
        drives = description.drives
        self._judges = carries_weight(description)
        self._arm = Arm(description)
        self._arm.chain[:, BODY:] = 0.0  # only the kilogram has mass in this chain
        self._sum = np.zeros(description.joints)
        # Without this floor, a joint without friction would dominate the estimate.
        self._friction = np.maximum(drives.coulomb_friction, 0.01 * np.array(description.limits.torque))
        self._fade = np.exp(-TICKS_AVERAGED * PERIOD / np.array([MEMORY, RECENT]))
        self.declare(declared, SLEW)
        signals = np.zeros((QDD + 1, len(self._sum)))
        self._correlate(signals, np.zeros_like(self._sums))  # loads compiled code, which takes many ticks

    def declare(self, payload: Payload, ticks: int, *, found: bool = False, told: bool = False) -> None:
        """Set another payload and drop measurements; `found`: learnt by the robot; `told`: clients warned."""
        self.payload = payload
        self._called = "assumed" if found else "declared"
        self._arm.chain[-2, BODY:] = self._arm.on_flange(Payload(mass=1.0, com=payload.com))
        self.restart()
        self._wait, self._warned = ticks, told

    def restart(self) -> None:
        """Discard past measurements."""
        self._ticks, self._sum[:] = 0, 0.0
        self._time = 0.0
        self._sums = np.zeros((3, len(self._fade)))
        self._warned = False
        self._be_sure()

    def _be_sure(self) -> None:
        self._doubted = self._rested = 0.0
        self._moved = False

    @property
    def excess(self) -> tuple[float, float]:
        """Estimated error of the declared mass, and its bound due to friction, possibly infinite [kg]."""
        return self._estimate(0)

    def _estimate(self, memory: int) -> tuple[float, float]:
        """Return the mass error and its bound [kg], over the time `MEMORY` (0) or `RECENT` (1)."""
        square, product, bound = self._sums[:, memory].tolist()
        return (0.0, np.inf) if square <= 0.0 else (product / square, bound / square)

    def look(self, sample: Sample) -> MonitorFinding | None:
        """Return, once per set payload, the finding that the payload cannot be right."""
        if self._wait > 0:
            self._wait -= 1
            return None
        self._sum += sample.measured.moment - sample.command.torque
        self._ticks += 1
        if self._ticks < TICKS_AVERAGED:
            return None
        self._correlate(sample.signals, self._sums)
        self._ticks, self._time = 0, float(self._fade[0]) * self._time + TICKS_AVERAGED * PERIOD
        why = self._judge(sample.mode.at_rest)
        return None if why is None else MonitorFinding(why, "payload_mismatch")

    def _correlate(self, signals: Floats, sums: Floats) -> None:
        arm, q, qd, qdd = self._arm, signals[Q], signals[QD], signals[QDD]
        correlate(arm.chain, q, qd, qdd, arm.scratch, self._friction, self._sum, self._fade, sums)

    def _judge(self, at_rest: bool) -> str | None:
        if not self._judges or self._warned or self._time < ENOUGH:
            return None
        if not _contradicts(*self.excess):
            self._be_sure()
            return None
        if self._follows and self._waits(at_rest):
            return None
        mass, bound = self._estimate(1)
        if not _contradicts(mass, bound):  # the reported mass must contradict the declaration, too
            return None
        self._warned = True
        felt = self.payload.mass + mass
        hold = f"about {felt:.1f} kg" if felt >= 0.0 else f"{-mass:.1f} kg less"
        told = f"{self.payload.mass:g} kg are {self._called}, but the drives hold {hold} (within {bound:.1f} kg): "
        if felt + bound < 0.0:
            return f"{told}no payload is that light, so find out what pushes the arm"
        felt = max(felt, 0.0)
        return (
            f"{told}declare them, in a program with set_payload({felt:.1f}, …) or set_target_payload({felt:.1f}, …) "
            "and their centre of mass, or find out what pushes the arm"
        )

    def _waits(self, at_rest: bool) -> bool:
        """Count `TICKS_AVERAGED` more ticks of doubt; return whether learning may still find the payload."""
        span = TICKS_AVERAGED * PERIOD
        self._doubted += span
        self._moved = self._moved or not at_rest
        self._rested = self._rested + span if at_rest and self._moved else 0.0
        return self._rested < STUDIED and self._doubted < PATIENCE


def _contradicts(mass: float, bound: float) -> bool:
    """Return whether an estimated mass error exceeds its bound plus the tolerance [kg]."""
    return abs(mass) > TOLERATED + bound
