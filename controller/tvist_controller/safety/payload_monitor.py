"""Detection of a wrong payload, from the torque that the drives' feedback adds to the feed-forward."""

from typing import ClassVar

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.arm import Arm
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.inverse_dynamics import SLEW
from tvist_controller.line.line_tick import QD, QDD, Q
from tvist_controller.line.sample import Sample
from tvist_controller.motion.monitor import Finding, Monitor
from tvist_plant.chain import BODY, torques
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import carries_weight
from tvist_plant.plant import GRAVITY, PERIOD

EVERY = 10
"""Number of ticks that are averaged into one measurement."""
MEMORY = 2.0
"""Time in which the weight of a measurement decays to 1/e [s]; many periods of a vibration."""
RECENT = 0.1
"""The same for the mass that a warning names [s]: the long memory still holds what was before a part was picked up."""
ENOUGH = 1.0
"""Observation time required for a judgement [s]."""
TOLERATED = 0.5
"""Error of the declared mass that is tolerated [kg]."""
FRICTION = 0.4
"""Share of the Coulomb friction that may be unknown in each joint, with the worst sign [-]."""
STUDIED = 1.0
"""Time at rest after a motion in which a robot that follows its payload has studied it [s]."""
PATIENCE = 20.0
"""Longest time for which a doubt waits for that [s]."""


@compiled_for_ticks
def add(total: Floats, moment: Floats, expected: Floats) -> None:
    """Add what a moment has beyond the expected one to a sum, each of shape (n,) [N m]."""
    for j in range(total.shape[0]):
        total[j] += moment[j] - expected[j]


@compiled_for_ticks
def correlate(
    chain: Floats,  # of which only the kilogram has mass, see `tvist_plant.chain`, shape (n+1, 22)
    q: Floats,  # shape (n,) [rad]
    qd: Floats,
    qdd: Floats,
    scratch: Floats,  # shape (n+1, 28)
    friction: Floats,  # F of each joint, shape (n,) [N m]
    feedback: Floats,  # sum of r over `EVERY` ticks, shape (n,) [N m]; set to zero
    fade: Floats,  # what is left of each memory after these ticks, shape (2,) [-]
    sums: Floats,  # yᵀ W y [1/kg²], yᵀ W r and φ Σ |y_j| W_j F_j [1/kg] in each memory, shape (3, 2); changed
) -> None:
    """Compare the feedback of the drives with the torques that a kilogram needs, y."""
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
        sums[1, memory] = fade[memory] * sums[1, memory] + product / EVERY
        sums[2, memory] = fade[memory] * sums[2, memory] + FRICTION * bound


class PayloadMonitor(Monitor):
    """Compares the payload that the drives feel with the declared one, in motion and at rest.

    The torque that a drive's feedback adds to the feed-forward is what the model does not explain. A mass error μ
    adds y(q, q̇, q̈) μ, with y the torque for 1 kg at the declared payload's centre of mass. Over some time, the
    estimate is

        μ = Σ yᵀ W r / Σ yᵀ W y,   W = diag(1/F²),      |error of μ| <= Σ_j Σ |y_j| W_j φ F_j / Σ yᵀ W y

    where the bound covers any unknown friction of up to φF in each joint. Vibrations have zero mean and cancel out. A
    warning requires that μ exceed what friction and the tolerated error of the declaration explain together. In an
    upright posture, where gravity has no lever arm, there is therefore no warning.

    An arm with only vertical axes is not judged: it feels its payload only while it accelerates, and there a soft joint
    delays what its drive feels.

    A deviating frequency would show the error too, but only while the arm vibrates, and less clearly: 3 kg instead of
    5 kg change the frequency by a fifth and the shoulder's torque by half.

    A robot that follows its payload finds it after a motion by itself. There the warning waits as long as that may
    still come, until a motion has been studied in vain, and is about the payload that is assumed. So there is one
    verdict at a time.
    """

    needs: ClassVar = "drives alone"  # else what the tool touches would be taken for a payload

    def __init__(self, description: RobotDescription, declared: Payload, *, follows: bool = False) -> None:
        self._follows = follows
        drives = description.drives
        self._judges = carries_weight(description)
        self._arm = Arm(description)
        self._arm.chain[:, BODY:] = 0.0  # only the kilogram has mass in this chain
        self._sum = np.zeros(description.joints)
        # Without this floor, a joint without friction would dominate the estimate.
        self._friction = np.maximum(drives.coulomb_friction, 0.01 * np.array(description.limits.torque))
        self._fade = np.exp(-EVERY * PERIOD / np.array([MEMORY, RECENT]))
        self.declare(declared, SLEW)
        still = np.zeros_like(self._sum)  # the first calls load compiled code, which takes many ticks
        add(still, still, still)
        nothing = np.zeros_like(self._sums)
        self._correlate(np.zeros((QDD + 1, len(still))), nothing)

    def declare(self, payload: Payload, ticks: int, *, found: bool = False, told: bool = False) -> None:
        """Set another payload: discard past measurements, and wait for the ticks in which it is phased in.

        If the robot has `found` it, it is assumed, not declared; `told` says whether a warning has told
        already that the arm carries something else.
        """
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
        """Forget a doubt."""
        self._doubted = self._rested = 0.0
        self._moved = False

    @property
    def excess(self) -> tuple[float, float]:
        """Estimated mass error of the declaration, and its bound from friction, which may be infinite [kg]."""
        return self._estimate(0)

    def _estimate(self, memory: int) -> tuple[float, float]:
        """The same with `MEMORY`, 0, or with `RECENT`, 1."""
        square, product, bound = self._sums[:, memory].tolist()
        return (0.0, np.inf) if square <= 0.0 else (product / square, bound / square)

    def look(self, sample: Sample) -> Finding | None:
        """Return once that the payload cannot be right; then nothing until another is set."""
        if self._wait > 0:
            self._wait -= 1
            return None
        add(self._sum, sample.measured.moment, sample.command.torque)
        self._ticks += 1
        if self._ticks < EVERY:
            return None
        self._correlate(sample.signals, self._sums)
        self._ticks, self._time = 0, float(self._fade[0]) * self._time + EVERY * PERIOD
        why = self._judge(sample.mode.at_rest)
        return None if why is None else Finding(why, "payload_mismatch")

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
        if not _contradicts(mass, bound):  # what is named has to contradict the declaration, too
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
        """Take `EVERY` ticks of doubt; return whether a motion may still tell what the arm carries."""
        span = EVERY * PERIOD
        self._doubted += span
        self._moved = self._moved or not at_rest
        self._rested = self._rested + span if at_rest and self._moved else 0.0
        return self._rested < STUDIED and self._doubted < PATIENCE


def _contradicts(mass: float, bound: float) -> bool:
    """Return whether an estimated error of the declared mass is beyond its bound and what is tolerated [kg]."""
    return abs(mass) > TOLERATED + bound
