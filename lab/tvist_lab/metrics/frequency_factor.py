"""Compare the frequencies of the vibration after a stop with those of an arm's model."""

import math
from collections.abc import Iterable

import numpy as np

from tvist_controller.api.line import mass_matrix
from tvist_lab.metrics.ring_down import SLOW_POLE
from tvist_lab.recordings import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.imperfections import YieldingBase, on_base
from tvist_plant.model import Integers, flexible_model
from tvist_plant.plant import PERIOD
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal

MODES = 4  # number of modes that may vibrate, from the lowest
HIGHEST = 100.0  # largest frequency of a mode [Hz]
SKIP = 3  # ticks after the stop that are ignored, since the end of the deceleration is no ring-down
SCALES = np.linspace(-0.4, 0.3, 29)  # logarithms of the common frequency factors to try
BASES = np.geomspace(1e6, 3e4, 20)
"""Stiffnesses to try for the arm's base [N m/rad]; with the first one it is practically rigid."""
CORRELATED_SAMPLES = 3.0  # number of samples that count as one, since the residual is correlated in time
EXPECTED = 0.07  # standard deviation of the factor's logarithm before any measurement
UNLIKE, ELSEWHERE = 0.05, 0.1
"""Standard deviation of the factor between poses, and share of stops where parts besides the arm vibrate."""
VAGUE = 0.1  # standard error from which a stop is ignored because it hardly vibrated
FIRST = 8  # number of stops from which the stiffness of the base is found


def unexplained(alpha: Floats, f_d: Floats, zeta: Floats) -> Floats:
    """Return the energy unexplained by modes, constant and slow tail, for each factor in `SCALES` [m²/s⁴].

    `alpha` [m/s²], shape (T, 3), starts `SKIP` ticks after the stop; `f_d` [Hz], before scaling, and `zeta`
    have shape (k,).
    """
    time, left = PERIOD * np.arange(len(alpha)), np.empty(len(SCALES))
    common = [np.ones_like(time), np.exp(-SLOW_POLE * time)]
    for place, scale in enumerate(np.exp(SCALES)):
        known = scale * f_d <= HIGHEST
        omega, ratio = 2.0 * np.pi * scale * f_d[known], zeta[known]
        waves = np.exp(np.outer(1j * omega - omega * ratio / np.sqrt(1.0 - ratio * ratio), time))
        basis, _ = np.linalg.qr(np.vstack([common, waves.real, waves.imag]).T)
        left[place] = np.sum((alpha - basis @ (basis.T @ alpha)) ** 2)
    return left


class FrequencyFactorEstimator:
    """Finds the common factor between the frequencies after a stop and a model's, f_d = e^u f_model(q).

    The amplitudes of the modes enter linearly and are eliminated (variable projection; Golub and Pereyra,
    1973), so each u has a sum of squares and hence a likelihood; if a stop hardly vibrates, it is nearly
    constant. Since the stiffness of the arm's mounting is unknown, the model stands on a flexible base. The
    stiffness of this base is found once: the likeliest for the first `FIRST` stops.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        arm = flexible_model(description, payload)
        rows = _of_file(description, arm.joints, arm.model.nv)
        mass = mass_matrix(on_base(arm, YieldingBase()))
        self._models = [
            Modal(mass, _standing(rows, float(base)), modes=min(MODES, len(rows[0]))) for base in BASES
        ]
        self._likelihoods: list[Floats] = []
        self._base: int | None = None

    def estimate(self, alpha: Floats, q: Floats) -> list[tuple[float, float]]:
        """Return u and its standard error [-] from the ring-down in a pose; none if the arm hardly vibrated.

        `alpha` [m/s²], shape (T, 3), are readings from the stop on, with gravity; `q` [rad] has shape (n,).
        Until the base is found, nothing is returned; then the results of all earlier stops are included.
        """
        alpha = alpha[SKIP:]
        if not np.isfinite(alpha).all():  # as of a log in which the accelerometer has a gap
            return []
        chosen = self._models if self._base is None else [self._models[self._base]]
        try:
            left = np.array([unexplained(alpha, *model.settle(q)) for model in chosen])
        except EstimatorError:  # so much damping that the arm does not vibrate there
            return []
        left = np.maximum(left, 1e-12 * alpha.size)
        likely = -0.5 * alpha.size / CORRELATED_SAMPLES * np.log(left / left.min())
        if self._base is not None:
            return _certain([likely[0]])
        self._likelihoods.append(likely)
        if len(self._likelihoods) < FIRST:
            return []
        self._base = int(
            np.argmax(np.max(sum(map(_blurred, self._likelihoods)) - 0.5 * (SCALES / EXPECTED) ** 2, axis=1))
        )
        likelihoods, self._likelihoods = self._likelihoods, []
        return _certain([one[self._base] for one in likelihoods])


def _certain(likelihoods: Iterable[Floats]) -> list[tuple[float, float]]:
    """Return mean and standard deviation of u for each log-likelihood that is not vague."""
    found = []
    for likely in likelihoods:
        weights = np.exp(likely - likely.max())
        mean = float(np.average(SCALES, weights=weights))
        spread = float(np.average((SCALES - mean) ** 2, weights=weights))
        error = math.sqrt(spread + (SCALES[1] - SCALES[0]) ** 2 / 12.0)
        # A maximum at an end means that something else vibrates, or that modes were confused.
        if error < VAGUE and 0 < np.argmax(likely) < len(SCALES) - 1:
            found.append((mean, error))
    return found


def _blurred(likely: Floats) -> Floats:
    """Return a stop's log-likelihood, (bases, scales), widened for pose differences and other vibrations."""
    spread = np.exp(-0.5 * ((SCALES[:, np.newaxis] - SCALES) / UNLIKE) ** 2)
    near = np.exp(likely) @ (spread / spread.sum(axis=0))
    anything = np.exp(likely).mean(axis=1).max()
    return np.asarray(np.log((1.0 - ELSEWHERE) * near + ELSEWHERE * anything + 1e-300))


def _of_file(description: RobotDescription, joints: Integers, size: int) -> Floats:
    """Return the rows of a `Drivetrain` with the springs and drives of a robot file."""
    drives, links = description.drives, description.link_flexibility
    rows = np.zeros((5, size))
    rows[:, joints] = [
        drives.gear_stiffness, drives.rotor_inertia, drives.velocity_gain, drives.position_gain, drives.gear_damping,
    ]  # fmt: skip
    bends = np.setdiff1d(np.arange(size), joints)
    rows[0, bends] = np.repeat(links.stiffness, 2)
    rows[4, bends] = rows[0, bends] * links.damping_time
    return rows


def _standing(rows: Floats, base: float) -> Drivetrain:
    """Return springs and drives of an arm on a base that yields about two axes."""
    foot = np.outer([base, 0.0, 0.0, 0.0, base * YieldingBase().damping_time], [1.0, 1.0])
    return Drivetrain(*(tuple(row.tolist()) for row in np.hstack([foot, rows])))
