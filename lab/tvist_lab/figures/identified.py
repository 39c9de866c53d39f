"""Accuracy of a calibration, compared with the measurements."""

import numpy as np
from matplotlib.figure import Figure

from tvist_controller.api.line import estimator_of
from tvist_lab.figures.style import FAINT, OF_SHAPED, OF_UNSHAPED, explain, legend, panels, title
from tvist_lab.recordings import Floats
from tvist_protocol.calibration import Calibration


def identified_figure(
    calibration: Calibration,
    q: Floats,
    f_d: Floats,
    zeta: Floats,
    true_f_d: Floats | None,
    true_zeta: Floats | None,
) -> Figure:
    """Estimated against measured (f_d, ζ), one point per configuration, and against the truth if it is known.

    Args:
        calibration: Calibration with polynomials.
        q: Configurations, shape (N, n) [rad].
        f_d: Measured damped frequencies, shape (N,) [Hz].
        zeta: Measured damping ratios, shape (N,) [-].
        true_f_d: Damped frequency of the lowest true mode, shape (N,) [Hz].
        true_zeta: Damping ratio of the lowest true mode, shape (N,) [-].
    """
    estimator = estimator_of(calibration)
    estimated = np.array([np.concatenate(estimator.estimate(row)) for row in q]).T
    figure, axes = panels(2, 7.6, share_x=False)
    for panel, estimate, measured, true, name in (
        (axes[0], estimated[0], f_d, true_f_d, "$f_d$ (Hz)"),
        (axes[1], estimated[1], zeta, true_zeta, r"$\zeta$ (–)"),
    ):
        ends = [float(np.min(measured)), float(np.max(measured))]
        panel.plot(ends, ends, color=FAINT, linewidth=1.0, label="Equal")
        if true is not None:
            panel.plot(true, estimate, **OF_UNSHAPED.points(2.5, label="Against the true lowest mode"))
        panel.plot(measured, estimate, **OF_SHAPED.points(2.5, label="Against the ring-down"))
        panel.set(xlabel=f"Measured or true {name}", ylabel=f"Calibration's {name}")
    title(axes[0], f"{calibration.name}: {len(q)} configurations")
    legend(figure, axes[0])
    explain(figure, {"$f_d$": "damped frequency", r"$\zeta$": "damping ratio"})
    return figure
