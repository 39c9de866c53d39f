"""Modes of a ring-down by matrix pencils: another way than the laboratory's, with which it shares no code.

A matrix pencil is linear algebra alone (Hua and Sarkar, IEEE Trans. ASSP 38, 1990): nothing is searched, no model is
compared with another by its residual, and nobody says how many modes there are. Three orders vote.
"""

from typing import NamedTuple

import numpy as np

WINDOW = (0.12, 0.72)
"""Time after the target's stop that is fitted [s]; the arm is still driven before."""
SHORTEST = 0.35
"""Shortest part of it that is fitted, where less rest was recorded [s]."""
ORDERS = (6, 8, 12)
"""Ranks of the signal: two for each mode."""
RATE = 125.0
"""Least rate to which samples are averaged [Hz]: more of them hold noise above the modes, not more of the modes."""
BAND = (3.0, 45.0)
"""Frequencies of modes [Hz]."""
HEAVIEST = 0.15
"""Largest damping ratio of a mode [-]; what decays faster is a tail."""
SAME = 0.05
"""Largest difference of f_d between orders [-]."""
LOUD = 0.3
"""Smallest amplitude of a further mode over the strongest one's [-]."""

LEAST = 0.1
"""Smallest amplitude of a mode [m/s²]; less may be noise."""


class Found(NamedTuple):
    """A mode, median of the orders that have it."""

    f_d: float
    """Damped frequency [Hz]."""
    zeta: float
    """Damping ratio [-]."""
    amplitude: float
    """Largest |α| where the window begins [m/s²]."""


def matrix_pencil(time, alpha):
    """Modes of which at least two of three orders tell, the strongest first."""
    period = float(np.median(np.diff(time)))
    grid = np.arange(WINDOW[0], min(WINDOW[1], time[-1]), period)
    if len(grid) * period < SHORTEST:
        return []
    even = np.column_stack([np.interp(grid, time, axis) for axis in alpha.T])
    joined = max(int(1.0 / (RATE * period) + 0.01), 1)
    even = even[: len(even) // joined * joined].reshape(-1, joined, 3).mean(axis=1)
    even -= even.mean(axis=0)
    votes = [_modes(even, joined * period, order) for order in ORDERS]
    found: list[Found] = []
    for mode in sorted((mode for each in votes for mode in each), key=lambda one: -one.amplitude):
        near = [[other for other in each if abs(other.f_d / mode.f_d - 1.0) < SAME] for each in votes]
        same = [max(each, key=lambda one: one.amplitude) for each in near if each]
        if len(same) < 2:
            continue
        agreed = Found(*np.median(same, axis=0).tolist())
        if all(abs(agreed.f_d / other.f_d - 1.0) > SAME for other in found):
            found.append(agreed)
    found.sort(key=lambda one: -one.amplitude)
    return [mode for mode in found if mode.amplitude >= max(LOUD * found[0].amplitude, LEAST)]


def _modes(even, period, order):
    """Modes of one order, with amplitudes by least squares."""
    length = len(even) // 2
    rows = np.lib.stride_tricks.sliding_window_view(even, length + 1, axis=0).reshape(-1, length + 1)
    signal = np.linalg.svd(rows, full_matrices=False)[2][:order].T
    poles = np.linalg.eigvals(np.linalg.pinv(signal[:-1]) @ signal[1:])
    powers = poles ** np.arange(len(even))[:, None]
    weights = np.linalg.lstsq(powers, even.astype(complex))[0]
    found = []
    for pole, weight in zip(poles, weights, strict=True):
        rate = np.log(pole) / period
        f_d, zeta = float(rate.imag) / (2.0 * np.pi), -float(rate.real / abs(rate))
        if BAND[0] < f_d < BAND[1] and 0.0 < zeta < HEAVIEST:
            size = np.linalg.norm(np.stack([weight.real, weight.imag]), ord=2)
            found.append(Found(f_d, zeta, 2.0 * float(size)))
    return found
