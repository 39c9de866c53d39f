"""Find modes on which fits of a ring-down from several moments and with several numbers of modes agree.

A real arm is still driven for a while after its target has stopped: its joints overshoot and swing back, which a
single fit takes for a mode. It also rings in several similar modes, and f_d rises by some percent as they decay.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from tvist_lab.metrics.ring_down import (
    CERTAIN,
    DAMPING,
    SIGNIFICANT,
    WINDOWS,
    Mode,
    RingDown,
    RingDownSignal,
    decay_rate,
    not_measurable,
)
from tvist_lab.recordings import Floats

STARTS = 5  # number of moments at which a fit starts
MAX_SPACING = 0.04  # longest time between these moments [s]; vibration must exceed the noise at each
ORDERS = (1, 2, 3, 4)  # numbers of modes to try
LONGEST = 0.6  # duration of a fit [s]; over a longer one, f_d rises too much
AUDIBLE = 2.5  # smallest amplitude of a mode at the start of its fit, over the rms of the residual [-]
SAME_MODE = 0.07  # largest difference of f_d between fits of one mode, and smallest one between two modes [-]
FOUND_IN = 0.7  # smallest share of the fits that must have found a mode [-]
MAX_MODES = 3  # largest number of modes that are returned
FAINT = 0.1  # smallest amplitude of a mode relative to the strongest [-]
HEAVY = 0.1  # damping ratio from which a mode beside a lighter one is suspicious [-]
BESIDE = 1.5  # largest ratio of the frequencies of two such modes [-]
RISE = 0.03  # share by which f_d of a real arm rises while a mode decays [-]
FALL = 0.7  # share by which ζ falls meanwhile [-]
DRIFT_SHARE = 2.0 / 9.0
"""Error of a fit with constant f_d and ζ, as a share of their change during the decay [-].

Let f_d change as e^(-σt), like the amplitude. The mean of f_d, weighted by squared amplitude, is the value
after 1/3 of the change. Least squares fit the phase, where late times count more: the value after 5/9 of it.
"""

_Fit = tuple[list[Mode], float]  # modes and rms of their residual; times count from the fit's start


def agreed_modes(alpha: Floats, time: Floats, period: float, begin: float) -> RingDown:
    """Fit damped sines from several moments, and keep the modes that most of the fits have found.

    f_d and ζ are means over the fits, weighted by their variances. The interval is that of the best fit,
    widened by the others' differences beyond their own noise (Hausman, Econometrica 46, 1978), and by the
    change of f_d and ζ of a real arm while it rings.

    `alpha` [m/s²] has shape (T, 3), `time` after the stop [s] (T,); the arm is presumably driven until
    `begin` [s]. The result is the strongest mode midway between the starts of the fits; amplitudes are
    extrapolated to the stop. `ok` is false, with a `reason`, if the fits disagree.
    """
    first = int(np.searchsorted(time, begin - 1e-9))
    whole = RingDownSignal(alpha[first:], time[first:], period, (0.0,))
    if whole.length < WINDOWS[0]:
        return not_measurable(
            f"only {whole.length:.3f} s were recorded after the stop, {WINDOWS[0]} s are needed"
        )
    starts, fits, step = [begin], list(_fits(whole.cut(LONGEST))), 0.0
    heard = max((_audible(mode, rms, begin) for modes, rms in fits for mode in modes), default=0.0)
    step = max(min(MAX_SPACING, heard / (STARTS + 1), (whole.length - WINDOWS[0]) / (STARTS - 1)), period)
    starts *= len(fits)
    for start in begin + step * np.arange(1, STARTS):
        first = int(np.searchsorted(time, start - 1e-9))
        more = list(_fits(RingDownSignal(alpha[first:], time[first:], period, (0.0,)).cut(LONGEST)))
        fits += more
        starts += [start] * len(more)
    heard_in = [
        [mode for mode in modes if mode.amplitude_at(start) > AUDIBLE * rms and mode.zeta < 0.99 * DAMPING[1]]
        for start, (modes, rms) in zip(starts, fits, strict=True)
    ]
    middle = begin + 0.5 * (STARTS - 1) * step
    modes = _ordered([_mean(group, sum(map(bool, heard_in)), middle) for group in _groups(heard_in)], middle)
    if not modes:
        return not_measurable("fits from several moments after the stop do not agree on any mode")
    rms = float(np.median([rms for _, rms in fits]))
    r_squared = 1.0 - fits[0][1] ** 2 / float(np.mean(whole.cut(LONGEST).alpha ** 2))
    return RingDown(
        **vars(modes[0]),
        rms=rms,
        r_squared=r_squared,
        window=min(whole.length, LONGEST),
        modes=len(modes),
        ok=True,
        found=tuple(modes),
    )


def _fits(signal: RingDownSignal) -> Iterator[_Fit]:
    """Yield the fit with as many modes as improve it significantly, and the next fit with more modes."""
    # If a strong mode changes while it decays, two modes at the same frequency would fit it best: a heavily
    # damped one for its start and a lightly damped one for its end. So modes near each other are merged.
    fits = []
    for f_d, zeta in _poles(signal):
        inside = (f_d > 3.05) & (f_d < 0.98 * signal.highest) & (np.abs(zeta) < 0.9 * DAMPING[1])
        if inside.any():
            start = np.column_stack([f_d[inside], np.clip(zeta[inside], 2.0 * DAMPING[0], 0.6)])
            start = start[np.argsort(start[:, 0])]
            apart = np.flatnonzero(np.diff(np.log(start[:, 0])) > SAME_MODE) + 1
            cost, found = signal.refine(np.concatenate([one.mean(axis=0) for one in np.split(start, apart)]))
            if np.all(np.diff(np.log(np.sort(found[::2]))) > SAME_MODE):
                fits.append((cost, found))
    chosen = 0
    for index in range(1, len(fits)):
        parameters = fits[index][1]
        added = (parameters.size - fits[chosen][1].size) // 2
        gain = signal.alpha.size * math.log((fits[chosen][0] + 1e-300) / (fits[index][0] + 1e-300))
        noise = float(np.mean(signal.colour(signal.unexplained(parameters), parameters[::2])))
        if added > 0 and gain > added * SIGNIFICANT * noise:
            chosen = index
    for _, parameters in fits[chosen : chosen + 2]:
        modes, left = signal.modes_at(parameters)
        yield modes, float(np.sqrt(np.mean(left**2)))


def _poles(signal: RingDownSignal) -> Iterator[tuple[Floats, Floats]]:
    """Estimate f_d and ζ by ESPRIT (Roy and Kailath, IEEE Trans. ASSP 37, 1989), for each number of modes."""
    time, period = signal.time, signal.period
    grid = np.arange(time[0], time[-1] + 0.5 * period, period)
    joined = max(int(0.4 / (signal.highest * period)), 1)
    count = len(grid) // joined
    even = np.column_stack([np.interp(grid, time, axis) for axis in signal.alpha.T])[: count * joined]
    even = (even - even.mean(axis=0)).reshape(count, joined, -1).mean(axis=1)
    windows = [np.lib.stride_tricks.sliding_window_view(axis, count - count // 2 + 1) for axis in even.T]
    signals = np.linalg.svd(np.concatenate(windows), full_matrices=False)[2].T
    for order in ORDERS:
        space = signals[:, : 2 * order + 1]
        turns = np.linalg.eigvals(np.linalg.lstsq(space[:-1], space[1:])[0])
        poles = np.log(turns[turns.imag > 1e-9]) / (joined * period)
        yield poles.imag / (2.0 * np.pi), -poles.real / np.abs(poles)


def _audible(mode: Mode, rms: float, begin: float) -> float:
    """Return the time from the first fit's start until a mode has decayed to the fit's residual [s]."""
    loud = mode.amplitude_at(begin) / max(rms, 1e-12)
    fall = math.log(mode.amplitude / mode.amplitude_at(1.0))
    return math.log(loud) / fall if loud > AUDIBLE else 0.0


def _groups(heard: Sequence[Sequence[Mode]]) -> Iterator[list[Mode]]:
    """Yield modes with about the same f_d in different fits, if enough fits have found them."""
    pool = [list(modes) for modes in heard if modes]
    least = max(FOUND_IN * len(pool), 3.0)
    while candidates := [mode for modes in pool for mode in modes]:
        groups = []
        for candidate in candidates:
            nearest = [min(modes, key=lambda m: abs(m.f_d - candidate.f_d)) for modes in pool if modes]
            groups.append([m for m in nearest if abs(m.f_d / candidate.f_d - 1.0) <= SAME_MODE])
        group = max(groups, key=lambda one: (len(one), -float(np.std([m.f_d for m in one]) / one[0].f_d)))
        if len(group) < least:
            return
        yield group
        pool = [[mode for mode in modes if mode not in group] for modes in pool]


def _mean(group: Sequence[Mode], fits: int, middle: float) -> Mode:
    """Return a group's mean mode; its amplitude is the lower quartile, with 0 for fits without the mode."""
    f_d, f_d_error = _weighted([mode.f_d for mode in group], [mode.f_d_error for mode in group])
    zeta, zeta_error = _weighted([mode.zeta for mode in group], [mode.zeta_error for mode in group])
    f_d_error = math.hypot(f_d_error, DRIFT_SHARE * RISE * f_d / CERTAIN)
    zeta_error = math.hypot(zeta_error, DRIFT_SHARE * FALL * zeta / CERTAIN)
    amplitudes = [mode.amplitude_at(middle) for mode in group] + [0.0] * (fits - len(group))
    amplitude = float(np.quantile(amplitudes, 0.25)) * math.exp(decay_rate(f_d, zeta) * middle)
    return Mode(f_d, zeta, amplitude, f_d_error, zeta_error)


def _weighted(values: Sequence[float], errors: Sequence[float]) -> tuple[float, float]:
    """Return the mean, weighted by inverse variances, and its standard error, which includes disagreement."""
    value, error = np.array(values), np.maximum(errors, 1e-9)
    mean = float(np.average(value, weights=error**-2.0))
    best = float(np.min(error))
    beyond = np.abs(value - mean) - CERTAIN * np.sqrt(np.maximum(error**2 - best**2, 0.0))
    return mean, best + max(float(np.max(beyond)), 0.0) / CERTAIN


def _ordered(modes: Sequence[Mode], middle: float) -> list[Mode]:
    """Return modes strong and certain enough, the strongest first, those with a `lighter_beside` last."""
    certain = [m for m in modes if m.f_d_error < 0.04 * m.f_d and m.zeta_error < max(0.5 * m.zeta, 0.01)]
    loudest = max((mode.amplitude for mode in certain), default=0.0)
    loud = [mode for mode in certain if mode.amplitude >= FAINT * loudest]
    return sorted(
        loud, key=lambda mode: (lighter_beside(mode, loud) is not None, -mode.amplitude_at(middle))
    )[:MAX_MODES]


def lighter_beside(mode: Mode, modes: Sequence[Mode]) -> Mode | None:
    """If a mode has ζ ≥ 0.1, return another of similar frequency with less than half its ζ, or None."""
    near = (one for one in modes if max(one.f_d / mode.f_d, mode.f_d / one.f_d) < BESIDE)
    return next((one for one in near if one.zeta < 0.5 * mode.zeta), None) if mode.zeta >= HEAVY else None
