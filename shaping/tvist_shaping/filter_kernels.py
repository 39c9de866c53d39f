"""Compiled computations of the TVIST filter in a tick.

`ring`, `head` and `scratch` are those of a `DelayLine`; `train` has the amplitudes without damping [-] and the times in
damped periods [-], shape (2, N); `impulses` receives amplitudes [-], times [s] and times in ticks, shape (3, N);
`joints` to `ranges` are the `coefficients` of a `Polynomial`; `longest` is the longest delay [s].
"""

import numpy as np
import numpy.typing as npt

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats
from tvist_shaping.delay_line import gather
from tvist_shaping.estimators.polynomial import evaluate
from tvist_shaping.impulse_train import F_D_RANGE
from tvist_shaping.impulses import decay

Integers = npt.NDArray[np.int64]
LOWEST, HIGHEST = F_D_RANGE


@compiled
def eased(
    f_d: Floats, zeta: Floats, ease: float, quickest: tuple[float, float], period: float, state: Floats
) -> None:
    """Advance a critically damped second-order low-pass, whose rates of change are limited, by one tick.

    `state`, shape (4, modes), has the filtered f_d [Hz] and ζ [-] and their rates of change; `ease` is the natural
    frequency [1/s], and `quickest` limits the rates, see `QUICKEST`.
    """
    for k in range(f_d.shape[0]):
        for row in range(2):
            goal = f_d[k] if row == 0 else zeta[k]
            most = 2.0 / ease * (quickest[0] * state[0, k] if row == 0 else quickest[1])
            apart = min(max(goal - state[row, k], -most), most)
            state[2 + row, k] += period * ease * (ease * apart - 2.0 * state[2 + row, k])
            state[row, k] += period * state[2 + row, k]


@compiled
def shape(
    f_d: Floats,
    zeta: Floats,
    zeta_max: float,
    longest: float,
    period: float,
    train: Floats,
    impulses: Floats,
    ring: Floats,
    head: int,
    scratch: Floats,
    out: Floats,
) -> bool:
    """Compute a mode's impulses and apply them to a delay line; return False if mode or delays are out of range.

    In that case `out` is not changed.
    """
    f, z = f_d[0], zeta[0]
    if not (LOWEST <= f <= HIGHEST and 0.0 <= z < zeta_max):
        return False
    A, tau, delays = impulses[0], impulses[1], impulses[2]
    decay(train[0], train[1], f, z, A, tau)
    for j in range(delays.shape[0]):
        delays[j] = tau[j] / period
    return tau[-1] <= longest and gather(ring, head, A, delays, scratch, out) < 0


@compiled
def shape_all(
    samples: Floats,
    joints: Integers,
    centre: Floats,
    multiples: Integers,
    coefficients: Floats,
    ranges: Floats,
    zeta_max: float,
    longest: float,
    period: float,
    train: Floats,
    impulses: Floats,
    ring: Floats,
    head: int,
    scratch: Floats,
    q_star: Floats,
    modes: Floats,
    out: Floats,
) -> int:
    """Shape samples with the paper's estimator; stop at a mode out of range, and return the number shaped."""
    for i in range(samples.shape[0]):
        head = head + 1 if head + 1 < ring.shape[0] else 0
        for j in range(samples.shape[1]):
            ring[head, j] = samples[i, j]
        evaluate(q_star, joints, centre, multiples, coefficients, ranges, modes)
        if not shape(
            modes[0], modes[1], zeta_max, longest, period, train, impulses, ring, head, scratch, q_star
        ):
            return i
        for j in range(samples.shape[1]):
            out[i, j] = q_star[j]
    return int(samples.shape[0])
