"""How a recorded stop goes on: its joints overshoot, and its strongest mode changes while it decays."""

from collections.abc import Mapping

import numpy as np

from proof.ringing.matrix_pencil import WINDOW, Floats, matrix_pencil

PART = 0.41
"""Duration of a part of the ringing [s]."""
LATER = 0.3
"""Time between the beginnings of its two parts [s]."""
SAME = 0.1
"""Largest change of f_d between them [-]."""
ARRIVED = 0.05
"""Time after the target's stop from which on a joint overshoots, and does not arrive any more [s]."""
STILL = 5e-4
"""Distance from its end within which a joint is still [rad]."""
END = 20
"""Rows whose mean is a joint's end."""


def changes(time: Floats, alpha: Floats) -> Mapping[str, float | None]:
    """Return f_d [Hz] and ζ of the strongest mode in two parts of its ringing; None where it is not found in both.

    Args:
        time: Time of each sample after the target's stop, shape (T,) [s].
        alpha: Acceleration of the tool without gravity, shape (T, 3) [m/s²].
    """
    early, late = (
        matrix_pencil(time[rows] - shift, alpha[rows])
        for shift in (0.0, LATER)
        for rows in [time <= WINDOW[0] + PART + shift]
    )
    again = [mode for mode in late if early and abs(mode.f_d / early[0].f_d - 1.0) < SAME]
    if not again or time[-1] < WINDOW[0] + PART + LATER:
        return dict.fromkeys(("f_d_early", "f_d_late", "zeta_early", "zeta_late"))
    return {
        "f_d_early": early[0].f_d,
        "f_d_late": again[0].f_d,
        "zeta_early": early[0].zeta,
        "zeta_late": again[0].zeta,
    }


def overshoot(time: Floats, q: Floats) -> Mapping[str, float | None]:
    """Return the largest distance of a joint from its end [mrad], and the time until all are within 0.5 mrad [s].

    Args:
        time: Time of each row after the target's stop, shape (T,) [s].
        q: Measured angles, shape (T, joints) [rad].
    """
    away = np.abs(q - q[-END:].mean(axis=0)).max(axis=1)
    swings = float(np.max(time[away > STILL], initial=0.0))
    return {"overshoot_mrad": 1e3 * float(np.max(away[time > ARRIVED], initial=0.0)), "swings_s": swings}
